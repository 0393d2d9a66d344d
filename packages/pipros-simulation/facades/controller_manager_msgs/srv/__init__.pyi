"""Services of controller_manager_msgs, made from their definitions by `pipros stubs`."""

from typing import ClassVar as _ClassVar
from typing import Final as _Final
from pipros.msg import base as _base
import controller_manager_msgs.msg

class ListControllerTypesRequest(_base.Message):
    """Lists the types of controllers that can be loaded."""
    def __init__(self) -> None: ...

class ListControllerTypesResponse(_base.Message):
    types: list[str]
    """types of plugins"""
    base_classes: list[str]
    """base class of each type"""
    def __init__(self, types: list[str] | None = ..., base_classes: list[str] | None = ...) -> None: ...

class ListControllersRequest(_base.Message):
    """Lists the controllers that are loaded."""
    def __init__(self) -> None: ...

class ListControllersResponse(_base.Message):
    controller: list[controller_manager_msgs.msg.ControllerState]
    """all controllers"""
    def __init__(self, controller: list[controller_manager_msgs.msg.ControllerState] | None = ...) -> None: ...

class LoadControllerRequest(_base.Message):
    """Loads a controller."""
    name: str
    """name of the controller"""
    def __init__(self, name: str | None = ...) -> None: ...

class LoadControllerResponse(_base.Message):
    ok: bool
    """whether it succeeded"""
    def __init__(self, ok: bool | None = ...) -> None: ...

class ReloadControllerLibrariesRequest(_base.Message):
    """Reloads the libraries of all controllers, which must not be loaded meanwhile."""
    force_kill: bool
    """whether to stop and unload all controllers first"""
    def __init__(self, force_kill: bool | None = ...) -> None: ...

class ReloadControllerLibrariesResponse(_base.Message):
    ok: bool
    """whether it succeeded"""
    def __init__(self, ok: bool | None = ...) -> None: ...

class SwitchControllerRequest(_base.Message):
    """Stops and starts controllers, all in the same update."""
    BEST_EFFORT: _Final = 1
    """switch the others"""
    STRICT: _Final = 2
    """switch none"""
    start_controllers: list[str]
    """names of controllers to start"""
    stop_controllers: list[str]
    """names of controllers to stop"""
    strictness: int
    """what to do if one of them cannot be started or stopped"""
    start_asap: bool
    """whether to start each controller as soon as its hardware is ready"""
    timeout: float
    """seconds to wait for the hardware; 0 means without limit"""
    def __init__(self, start_controllers: list[str] | None = ..., stop_controllers: list[str] | None = ..., strictness: int | None = ..., start_asap: bool | None = ..., timeout: float | None = ...) -> None: ...

class SwitchControllerResponse(_base.Message):
    ok: bool
    """whether it succeeded"""
    def __init__(self, ok: bool | None = ...) -> None: ...

class UnloadControllerRequest(_base.Message):
    """Unloads a controller."""
    name: str
    """name of the controller"""
    def __init__(self, name: str | None = ...) -> None: ...

class UnloadControllerResponse(_base.Message):
    ok: bool
    """whether it succeeded"""
    def __init__(self, ok: bool | None = ...) -> None: ...

class ListControllerTypes:
    """Lists the types of controllers that can be loaded."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[ListControllerTypesRequest]]
    _response_class: _ClassVar[type[ListControllerTypesResponse]]

class ListControllers:
    """Lists the controllers that are loaded."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[ListControllersRequest]]
    _response_class: _ClassVar[type[ListControllersResponse]]

class LoadController:
    """Loads a controller."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[LoadControllerRequest]]
    _response_class: _ClassVar[type[LoadControllerResponse]]

class ReloadControllerLibraries:
    """Reloads the libraries of all controllers, which must not be loaded meanwhile."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[ReloadControllerLibrariesRequest]]
    _response_class: _ClassVar[type[ReloadControllerLibrariesResponse]]

class SwitchController:
    """Stops and starts controllers, all in the same update."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[SwitchControllerRequest]]
    _response_class: _ClassVar[type[SwitchControllerResponse]]

class UnloadController:
    """Unloads a controller."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[UnloadControllerRequest]]
    _response_class: _ClassVar[type[UnloadControllerResponse]]
