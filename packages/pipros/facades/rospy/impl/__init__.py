"""Genuine rospy's internal modules, with the names that other code imports from them."""

from __future__ import annotations

import typing as _typing

from pipros.basics.lazy_names import lazy_names as _lazy_names
from pipros.basics.lazy_names import star_names as _star_names

_MODULES = (
    *("init", "masterslave", "paramserver", "registration", "rosout", "simtime", "statistics", "tcpros"),
    *("tcpros_base", "tcpros_pubsub", "tcpros_service", "transport", "validators"),
)
"""The attributes that `import rospy` sets in Noetic. Here they are imported on first use."""

if _typing.TYPE_CHECKING:
    from rospy.impl import init as init
    from rospy.impl import masterslave as masterslave
    from rospy.impl import paramserver as paramserver
    from rospy.impl import registration as registration
    from rospy.impl import rosout as rosout
    from rospy.impl import simtime as simtime
    from rospy.impl import statistics as statistics
    from rospy.impl import tcpros as tcpros
    from rospy.impl import tcpros_base as tcpros_base
    from rospy.impl import tcpros_pubsub as tcpros_pubsub
    from rospy.impl import tcpros_service as tcpros_service
    from rospy.impl import transport as transport
    from rospy.impl import validators as validators
else:
    __getattr__, __dir__ = _lazy_names(__name__, {}, submodules=_MODULES)

_star_names(__name__, " ".join(f"rospy.impl.{name}" for name in _MODULES))
