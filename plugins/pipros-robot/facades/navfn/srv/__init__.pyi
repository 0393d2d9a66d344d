"""Services of navfn, made from their definitions by `pipros stubs`."""

from typing import ClassVar as _ClassVar
from pipros.msg import base as _base
from pipros.msg import stub_types as _types
import geometry_msgs.msg

class MakeNavPlanRequest(_base.Message):
    """Plan a path on the costmap of the node."""
    start: geometry_msgs.msg.PoseStamped
    """in the costmap's frame"""
    goal: geometry_msgs.msg.PoseStamped
    """in the costmap's frame"""
    def __init__(self, start: geometry_msgs.msg.PoseStamped | None = ..., goal: geometry_msgs.msg.PoseStamped | None = ...) -> None: ...

class MakeNavPlanResponse(_base.Message):
    plan_found: int
    """1 if there is a path, otherwise 0"""
    error_message: str
    """empty"""
    path: list[geometry_msgs.msg.PoseStamped]
    """from start to goal"""
    def __init__(self, plan_found: int | None = ..., error_message: str | None = ..., path: list[geometry_msgs.msg.PoseStamped] | None = ...) -> None: ...

class SetCostmapRequest(_base.Message):
    """Replace the costs on which to plan. No program of the package offers it."""
    @property
    def costs(self) -> bytes:
        """row by row"""
    @costs.setter
    def costs(self, value: _types.Octets) -> None: ...
    height: int
    """number of rows"""
    width: int
    """cells of a row"""
    def __init__(self, costs: _types.Octets | None = ..., height: int | None = ..., width: int | None = ...) -> None: ...

class SetCostmapResponse(_base.Message):
    def __init__(self) -> None: ...

class MakeNavPlan:
    """Plan a path on the costmap of the node."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[MakeNavPlanRequest]]
    _response_class: _ClassVar[type[MakeNavPlanResponse]]

class SetCostmap:
    """Replace the costs on which to plan. No program of the package offers it."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[SetCostmapRequest]]
    _response_class: _ClassVar[type[SetCostmapResponse]]
