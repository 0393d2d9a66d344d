"""`rospy.impl.simtime`: simulated time."""

from __future__ import annotations

from rospy.session import session


def init_simtime() -> None:
    """Has the node take its time from `/clock` if `/use_sim_time` is set. `init_node` sees to it for others.

    Raises:
        ROSInitException: before init_node.
    """
    session.follow_simulated_time()
