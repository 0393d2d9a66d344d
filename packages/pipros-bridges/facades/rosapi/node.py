"""`rosrun rosapi rosapi_node`: services that describe the running system to rosbridge clients.

Parameters: `~topics_glob`, `~services_glob`, `~params_glob` (patterns for the names that clients may use).
"""

from __future__ import annotations

import rospy
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros_bridges.rosapi import Allowed, RosApi
from pipros_bridges.rosbridge.globs import Globs
from rospy.session import session


@exits_after_ctrl_c()
def main() -> int:
    """Run until the node is shut down. Return the exit code."""
    rospy.init_node("rosapi")
    names = ("~topics_glob", "~services_glob", "~params_glob")
    allowed = Allowed(*(Globs.parse(rospy.get_param(name, "")) for name in names))
    if session.node is not None:
        RosApi(session.node, allowed).serve()
    rospy.spin()
    return 0
