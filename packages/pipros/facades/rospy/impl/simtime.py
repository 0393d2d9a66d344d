"""`rospy.impl.simtime`: simulated time."""

from __future__ import annotations

from pipros.basics.lazy_names import star_names as _star_names
from rospy.session import session

_star_names(__name__, "rosgraph_msgs.msg:Clock rosgraph rospy traceback")


def init_simtime() -> None:
    """Make the node use `/clock` if `/use_sim_time` is true. `init_node` does this itself.

    Raises:
        ROSInitException: init_node has not been called.
    """
    session.follow_simulated_time()
