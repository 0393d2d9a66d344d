"""Where genuine rospy keeps its inner parts. Names that others import from there are found here."""

from __future__ import annotations

from types import ModuleType

_MODULES = (
    *("init", "masterslave", "paramserver", "registration", "rosout", "simtime", "statistics", "tcpros"),
    *("tcpros_base", "tcpros_pubsub", "tcpros_service", "transport", "validators"),
)
"""What `import rospy` makes attributes in Noetic, and what is imported here when it is asked for."""


def __getattr__(name: str) -> ModuleType:
    if name in _MODULES:
        from importlib import import_module

        return import_module(f"rospy.impl.{name}")
    raise AttributeError(f"module 'rospy.impl' has no attribute '{name}'")
