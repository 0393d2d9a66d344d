"""The internal modules of genuine rospy, with the names that other code imports from them."""

from __future__ import annotations

from types import ModuleType

from pipros.basics.lazy_names import star_names as _star_names

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


_star_names(
    __name__,
    "rospy.impl.init rospy.impl.masterslave rospy.impl.paramserver rospy.impl.registration "
    "rospy.impl.rosout rospy.impl.simtime rospy.impl.statistics rospy.impl.tcpros rospy.impl.tcpros_base "
    "rospy.impl.tcpros_pubsub rospy.impl.tcpros_service rospy.impl.transport rospy.impl.validators",
)
