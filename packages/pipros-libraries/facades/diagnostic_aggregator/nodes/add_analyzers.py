"""`rosrun diagnostic_aggregator add_analyzers`: add analyzers to an aggregator while this node runs."""

from __future__ import annotations

import argparse
from typing import Any

import rospy
from bondpy.bondpy import Bond
from pipros.basics.errors import PiprosError
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.msg import load_service_class
from pipros_tools.graph.param_files import read_file

SERVICE = "/diagnostics_agg/add_diagnostics"


@exits_after_ctrl_c()
def main() -> int:
    """Add the analyzers of a file, or of the parameter `~analyzers`, and remove them on shutdown.

    Return the exit code.
    """
    arguments = _arguments()
    rospy.init_node("add_analyzers")
    try:
        for values, namespace in read_file(arguments.file, rospy.get_name()) if arguments.file else ():
            rospy.set_param(namespace, values)
    except PiprosError as error:
        rospy.logerr("%s", error)
        return 1
    if not rospy.has_param("~analyzers"):
        rospy.logerr(
            "%s/analyzers is not set: name a YAML file with the key analyzers, or load the parameters first",
            rospy.get_name(),
        )
        return 1
    service: Any = load_service_class("diagnostic_msgs/AddDiagnostics")
    owner = rospy.get_name()
    bond = Bond(
        f"/diagnostics_agg/bond{owner}", owner, on_broken=lambda: rospy.signal_shutdown("no aggregator")
    )
    bond.start()
    rospy.loginfo("waiting for %s", SERVICE)
    try:
        rospy.wait_for_service(SERVICE, arguments.timeout)
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


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="add_analyzers", description="Add analyzers to a running aggregator."
    )
    parser.add_argument(
        "file",
        nargs="?",
        help="YAML file with the key analyzers; by default, the parameter ~analyzers is used",
    )
    parser.add_argument(
        "-t", "--timeout", type=float, metavar="SECONDS", help=f"wait at most so long for {SERVICE}"
    )
    return parser.parse_args(rospy.myargv()[1:])
