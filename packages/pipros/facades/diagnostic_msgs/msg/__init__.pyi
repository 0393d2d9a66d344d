"""Messages of diagnostic_msgs, made from their definitions by `pipros stubs`."""

from typing import Final as _Final
from pipros.msg import base as _base
import std_msgs.msg

class DiagnosticArray(_base.Message):
    """States of the parts of a robot. Drivers and nodes publish on /diagnostics, about once a second; the
    aggregator sorts these and publishes /diagnostics_agg."""
    header: std_msgs.msg.Header
    """stamp: when the states were determined; frame_id is not used"""
    status: list[DiagnosticStatus]
    """one for each part"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., status: list[DiagnosticStatus] | None = ...) -> None: ...

class DiagnosticStatus(_base.Message):
    """State of one part of a robot: a device, a driver, a topic."""
    OK: _Final = 0
    """works as it should"""
    WARN: _Final = 1
    """works, but needs attention"""
    ERROR: _Final = 2
    """does not work"""
    STALE: _Final = 3
    """has not reported for too long; set by the aggregator"""
    level: int
    """OK, WARN, ERROR or STALE"""
    name: str
    """the part and the check, such as /camera: frame rate; must not change"""
    message: str
    """human-readable: the state in a few words"""
    hardware_id: str
    """identifies the device, for example by its serial number; may be empty"""
    values: list[KeyValue]
    """measured values and details"""
    def __init__(self, level: int | None = ..., name: str | None = ..., message: str | None = ..., hardware_id: str | None = ..., values: list[KeyValue] | None = ...) -> None: ...

class KeyValue(_base.Message):
    """One detail of a diagnostic status."""
    key: str
    """its name, such as Temperature (C)"""
    value: str
    """its value as text"""
    def __init__(self, key: str | None = ..., value: str | None = ...) -> None: ...
