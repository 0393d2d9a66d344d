"""Services of diagnostic_msgs, made from their definitions by `pipros stubs`."""

from typing import ClassVar as _ClassVar
from pipros.msg import base as _base
import diagnostic_msgs.msg

class AddDiagnosticsRequest(_base.Message):
    """Loads further analyzers while the diagnostic aggregator, which offers it as
    /diagnostics_agg/add_diagnostics, is running. The analyzers are removed when the node that requested them
    ends."""
    load_namespace: str
    """Namespace of the parameters that describe the analyzers. Without a leading slash, it is relative to the
    namespace of the aggregator."""
    def __init__(self, load_namespace: str | None = ...) -> None: ...

class AddDiagnosticsResponse(_base.Message):
    success: bool
    """true if the analyzers were loaded"""
    message: str
    """human-readable: why they were not"""
    def __init__(self, success: bool | None = ..., message: str | None = ...) -> None: ...

class SelfTestRequest(_base.Message):
    """Runs the self-test of a driver, which may interrupt the device; drivers offer it as NODE/self_test.
    The request is empty."""
    def __init__(self) -> None: ...

class SelfTestResponse(_base.Message):
    id: str
    """identifies the tested device, for example by its serial number"""
    passed: int
    """1 if all tests passed, otherwise 0"""
    status: list[diagnostic_msgs.msg.DiagnosticStatus]
    """the result of each test"""
    def __init__(self, id: str | None = ..., passed: int | None = ..., status: list[diagnostic_msgs.msg.DiagnosticStatus] | None = ...) -> None: ...

class AddDiagnostics:
    """Loads further analyzers while the diagnostic aggregator, which offers it as
    /diagnostics_agg/add_diagnostics, is running. The analyzers are removed when the node that requested them
    ends."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[AddDiagnosticsRequest]]
    _response_class: _ClassVar[type[AddDiagnosticsResponse]]

class SelfTest:
    """Runs the self-test of a driver, which may interrupt the device; drivers offer it as NODE/self_test.
    The request is empty."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[SelfTestRequest]]
    _response_class: _ClassVar[type[SelfTestResponse]]
