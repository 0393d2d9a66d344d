"""The internal modules of genuine rospy, with the names that other code imports from them."""

from __future__ import annotations

from types import ModuleType

_MODULES = (
    *("init", "masterslave", "paramserver", "registration", "rosout", "simtime", "statistics", "tcpros"),
    *("tcpros_base", "tcpros_pubsub", "tcpros_service", "transport", "validators"),
)
"""The attributes that `import rospy` sets in Noetic; here they are imported at their first use."""


def __getattr__(name: str) -> ModuleType:
    if name in _MODULES:
        from importlib import import_module

        return import_module(f"rospy.impl.{name}")
    raise AttributeError(f"module 'rospy.impl' has no attribute '{name}'")
