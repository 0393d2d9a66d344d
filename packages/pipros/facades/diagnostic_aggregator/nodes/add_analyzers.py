"""`rosrun diagnostic_aggregator add_analyzers`: add analyzers to an aggregator while this node runs."""

from __future__ import annotations

from typing import Any

import rospy
from bondpy.bondpy import Bond
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.msg import load_service_class

SERVICE = "/diagnostics_agg/add_diagnostics"


@exits_after_ctrl_c()
def main() -> int:
    """Add the analyzers in the parameter `~analyzers`, and remove them on shutdown. Return the exit code."""
    rospy.init_node("add_analyzers", anonymous=True)
    if not rospy.has_param("~analyzers"):
        rospy.logerr("%s/analyzers is not set: load the parameters of the analyzers first", rospy.get_name())
        return 1
    service: Any = load_service_class("diagnostic_msgs/AddDiagnostics")
    owner = rospy.get_name()
    bond = Bond(
        f"/diagnostics_agg/bond{owner}", owner, on_broken=lambda: rospy.signal_shutdown("no aggregator")
    )
    bond.start()
    rospy.loginfo("waiting for %s", SERVICE)
    try:
        rospy.wait_for_service(SERVICE)
        answer = rospy.ServiceProxy(SERVICE, service)(load_namespace=owner)
    except (rospy.ROSException, rospy.ServiceException) as error:
        rospy.logerr("the analyzers were not added: %s", error)
        return 1
    if not answer.success:
        rospy.logerr("the analyzers were not added: %s", answer.message)
        bond.shutdown()
        return 1
    rospy.loginfo("the analyzers were added; they will be removed when this node ends")
    rospy.on_shutdown(bond.break_bond)
    rospy.spin()
    return 0
