"""Genuine rospy's internal modules, with the names that other code imports from them."""

from __future__ import annotations

from pipros.basics.lazy_names import lazy_names as _lazy_names
from pipros.basics.lazy_names import star_names as _star_names

_MODULES = (
    *("init", "masterslave", "paramserver", "registration", "rosout", "simtime", "statistics", "tcpros"),
    *("tcpros_base", "tcpros_pubsub", "tcpros_service", "transport", "validators"),
)
"""The attributes that `import rospy` sets in Noetic. Here they are imported on first use."""

__getattr__, __dir__ = _lazy_names(__name__, {}, submodules=_MODULES)

_star_names(__name__, " ".join(f"rospy.impl.{name}" for name in _MODULES))
