"""Messages of dynamic_reconfigure, made from their definitions by `pipros stubs`."""

from typing import Final as _Final
from pipros.msg import base as _base

class BoolParameter(_base.Message):
    """A Boolean parameter."""
    name: str
    """name of the parameter"""
    value: bool
    """its value"""
    def __init__(self, name: str | None = ..., value: bool | None = ...) -> None: ...

class Config(_base.Message):
    """Values of parameters that can be changed while a node runs. A node publishes all of its values, latched, on
    NODE/parameter_updates; a request needs only the values to change."""
    bools: list[BoolParameter]
    """Boolean values"""
    ints: list[IntParameter]
    """integers, including values of enumerations"""
    strs: list[StrParameter]
    """strings"""
    doubles: list[DoubleParameter]
    """floating-point numbers"""
    groups: list[GroupState]
    """states of the groups"""
    def __init__(self, bools: list[BoolParameter] | None = ..., ints: list[IntParameter] | None = ..., strs: list[StrParameter] | None = ..., doubles: list[DoubleParameter] | None = ..., groups: list[GroupState] | None = ...) -> None: ...

class ConfigDescription(_base.Message):
    """The parameters of a node that can be changed, and their bounds; latched on NODE/parameter_descriptions."""
    groups: list[Group]
    """the parameters by groups; the first is the default group, which contains the others"""
    max: Config
    """largest values"""
    min: Config
    """smallest values"""
    dflt: Config
    """default values"""
    def __init__(self, groups: list[Group] | None = ..., max: Config | None = ..., min: Config | None = ..., dflt: Config | None = ...) -> None: ...

class DoubleParameter(_base.Message):
    """A floating-point parameter."""
    name: str
    """name of the parameter"""
    value: float
    """its value"""
    def __init__(self, name: str | None = ..., value: float | None = ...) -> None: ...

class Group(_base.Message):
    """Parameters that belong together and are shown together."""
    name: str
    """name of the group"""
    type: str
    """how it is shown: collapse, tab, hide, apply; empty for the default"""
    parameters: list[ParamDescription]
    """its parameters, without those of groups in it"""
    parent: int
    """id of the group around it"""
    id: int
    """its number; 0 for the default group, which is its own parent"""
    def __init__(self, name: str | None = ..., type: str | None = ..., parameters: list[ParamDescription] | None = ..., parent: int | None = ..., id: int | None = ...) -> None: ...

class GroupState(_base.Message):
    """Whether a group of parameters is open."""
    name: str
    """name of the group"""
    state: bool
    """true if it is open"""
    id: int
    """its number, as in Group"""
    parent: int
    """id of the group around it"""
    def __init__(self, name: str | None = ..., state: bool | None = ..., id: int | None = ..., parent: int | None = ...) -> None: ...

class IntParameter(_base.Message):
    """An integer parameter."""
    name: str
    """name of the parameter"""
    value: int
    """its value"""
    def __init__(self, name: str | None = ..., value: int | None = ...) -> None: ...

class ParamDescription(_base.Message):
    """Describes a parameter, for the tools that show it."""
    name: str
    """name of the parameter"""
    type: str
    """bool, int, double or str"""
    level: int
    """bits passed to the callback when it changes, which tell the node what to restart; see SensorLevels"""
    description: str
    """human-readable: what it does"""
    edit_method: str
    """for enumerations: their values as the text of a Python dictionary; otherwise empty"""
    def __init__(self, name: str | None = ..., type: str | None = ..., level: int | None = ..., description: str | None = ..., edit_method: str | None = ...) -> None: ...

class SensorLevels(_base.Message):
    """Levels for parameters of drivers: how far the device must be shut down to change them."""
    RECONFIGURE_CLOSE: _Final = 3
    """the device must be closed and opened again"""
    RECONFIGURE_STOP: _Final = 1
    """the data stream must be stopped and started again"""
    RECONFIGURE_RUNNING: _Final = 0
    """may change while data flows"""
    def __init__(self) -> None: ...

class StrParameter(_base.Message):
    """A string parameter."""
    name: str
    """name of the parameter"""
    value: str
    """its value"""
    def __init__(self, name: str | None = ..., value: str | None = ...) -> None: ...
