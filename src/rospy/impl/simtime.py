"""`rospy.impl.simtime`: simulated time."""

from __future__ import annotations

from rospy.session import session


def init_simtime() -> None:
    """Make the node use `/clock` if `/use_sim_time` is set. `init_node` does this itself.

    Raises:
        ROSInitException: before init_node.
    """
    session.follow_simulated_time()
