"""`rosrun diagnostic_aggregator aggregator_node`: publish diagnostics as a tree, and the overall level."""

from __future__ import annotations

import threading
from typing import Any

import rospy
from bondpy.bondpy import Bond
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.basics.printable import printable
from pipros.msg import load_message_class, load_service_class
from pipros_libraries.diagnostics.aggregation import Aggregation, whole_level
from pipros_libraries.diagnostics.analyzers import BadAnalyzer
from pipros_libraries.diagnostics.items import ComponentStatus

DiagnosticArray: Any = load_message_class("diagnostic_msgs/DiagnosticArray")
DiagnosticStatus: Any = load_message_class("diagnostic_msgs/DiagnosticStatus")
KeyValue: Any = load_message_class("diagnostic_msgs/KeyValue")
AddDiagnostics: Any = load_service_class("diagnostic_msgs/AddDiagnostics")


class Aggregator:
    """Subscriber to /diagnostics that publishes the analyzers' results."""

    def __init__(self) -> None:
        analyzers = rospy.get_param("~analyzers", {})
        self._aggregation = Aggregation(
            str(rospy.get_param("~base_path", "")),
            analyzers if isinstance(analyzers, dict) else {"analyzers": analyzers},
            other_as_errors=bool(rospy.get_param("~other_as_errors", False)),
        )
        for path, reason in self._aggregation.problems().items():
            rospy.logerr("the analyzer %s is ignored: %s", path, reason)
        self._is_critical = bool(rospy.get_param("~critical", False))
        self._lock = threading.Lock()
        self._level = -1
        self._bonds: dict[str, Bond] = {}
        self._without_stamp: set[str] = set()
        self._all = rospy.Publisher("/diagnostics_agg", DiagnosticArray, queue_size=1)
        self._whole = rospy.Publisher("/diagnostics_toplevel_state", DiagnosticStatus, queue_size=1)
        rospy.Subscriber("/diagnostics", DiagnosticArray, self._on_diagnostics, queue_size=1000)
        rospy.Service("/diagnostics_agg/add_diagnostics", AddDiagnostics, self._on_add)

    def _on_diagnostics(self, array: Any) -> None:
        self._check_stamp(array)
        now_s = rospy.get_time()
        with self._lock:
            for status in array.status:
                self._aggregation.take(_status_of(status), now_s)
            worst = max((status.level for status in array.status), default=0)
        if self._is_critical and worst > self._level:
            self.publish()

    def _check_stamp(self, array: Any) -> None:
        if array.header.stamp.is_zero() and len(self._without_stamp) < 1000:
            for status in array.status:
                if status.name not in self._without_stamp:
                    self._without_stamp.add(status.name)
                    rospy.logwarn("no stamp is set in the diagnostics of %s", printable(status.name))

    def publish(self) -> None:
        """Publish all statuses and the overall level."""
        with self._lock:
            reported = self._aggregation.report(rospy.get_time())
        array = DiagnosticArray(status=[_message_of(status) for status in reported])
        array.header.stamp = rospy.Time.now()
        self._all.publish(array)
        self._level = whole_level(reported)
        self._whole.publish(DiagnosticStatus(name="toplevel_state", level=self._level))

    # -- analyzers added by other nodes ---------------------------------------------------

    def _on_add(self, request: Any) -> Any:
        """Add the analyzers in a node's parameters; they are removed when the node's bond breaks."""
        owner = rospy.resolve_name(request.load_namespace)
        analyzers = rospy.get_param(f"{owner.rstrip('/')}/analyzers", {})
        try:
            with self._lock:
                self._aggregation.add(owner, analyzers if isinstance(analyzers, dict) else {"": analyzers})
        except BadAnalyzer as error:
            return AddDiagnostics._response_class(success=False, message=str(error))
        bond = Bond(f"/diagnostics_agg/bond{owner}", owner, on_broken=lambda: self._on_broken(owner))
        self._bonds[owner] = bond
        bond.start()
        return AddDiagnostics._response_class(success=True, message="")

    def _on_broken(self, owner: str) -> None:
        with self._lock:
            self._aggregation.remove(owner)
        bond = self._bonds.pop(owner, None)
        if bond is not None:
            bond.shutdown()


def _status_of(message: Any) -> ComponentStatus:
    values = tuple((pair.key, pair.value) for pair in message.values)
    return ComponentStatus(message.name, message.level, message.message, message.hardware_id, values)


def _message_of(status: ComponentStatus) -> Any:
    return DiagnosticStatus(
        level=status.level,
        name=status.name,
        message=status.message,
        hardware_id=status.hardware_id,
        values=[KeyValue(key, value) for key, value in status.values],
    )


@exits_after_ctrl_c()
def main() -> int:
    """Run until the node is shut down. Return the exit code."""
    rospy.init_node("diagnostic_aggregator")
    rate = rospy.get_param("~pub_rate", 1.0)
    if isinstance(rate, bool) or not isinstance(rate, (int, float)) or not 0 < rate < 1e4:
        rospy.logfatal("~pub_rate must be a number above 0 and below 10000, got %s", rate)
        return 1
    aggregator = Aggregator()
    pause = rospy.Rate(rate, reset=True)
    while not rospy.is_shutdown():
        aggregator.publish()
        try:
            pause.sleep()
        except rospy.ROSInterruptException:
            break
    return 0
