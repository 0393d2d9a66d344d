"""Services of std_srvs, made from their definitions by `pipros stubs`."""

from typing import ClassVar as _ClassVar
from pipros.msg import base as _base

class EmptyRequest(_base.Message):
    """Triggers an action; the response is empty. The service's name says what happens. To learn whether it worked,
    use Trigger."""
    def __init__(self) -> None: ...

class EmptyResponse(_base.Message):
    def __init__(self) -> None: ...

class SetBoolRequest(_base.Message):
    """Switches something on or off."""
    data: bool
    """true: on, false: off"""
    def __init__(self, data: bool | None = ...) -> None: ...

class SetBoolResponse(_base.Message):
    success: bool
    """true if it was switched"""
    message: str
    """human-readable: what happened, or why it did not"""
    def __init__(self, success: bool | None = ..., message: str | None = ...) -> None: ...

class TriggerRequest(_base.Message):
    """Triggers an action, and returns whether it worked. The request is empty."""
    def __init__(self) -> None: ...

class TriggerResponse(_base.Message):
    success: bool
    """true if it worked"""
    message: str
    """human-readable: what happened, or why it did not"""
    def __init__(self, success: bool | None = ..., message: str | None = ...) -> None: ...

class Empty:
    """Triggers an action; the response is empty. The service's name says what happens. To learn whether it worked,
    use Trigger."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[EmptyRequest]]
    _response_class: _ClassVar[type[EmptyResponse]]

class SetBool:
    """Switches something on or off."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[SetBoolRequest]]
    _response_class: _ClassVar[type[SetBoolResponse]]

class Trigger:
    """Triggers an action, and returns whether it worked. The request is empty."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[TriggerRequest]]
    _response_class: _ClassVar[type[TriggerResponse]]
