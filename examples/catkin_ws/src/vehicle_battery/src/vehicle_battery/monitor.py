"""The node that warns about a low battery."""

import threading

import diagnostic_updater
import rospy
from diagnostic_msgs.msg import DiagnosticStatus
from dynamic_reconfigure.server import Server
from sensor_msgs.msg import BatteryState
from std_srvs.srv import Trigger, TriggerResponse

from vehicle_battery.assessment import CRITICAL, LOW, OK, UNKNOWN, Assessor, Limits
from vehicle_battery.cfg import MonitorConfig
from vehicle_battery.msg import BatteryWarning

_DIAGNOSTIC_LEVELS = {
    OK: DiagnosticStatus.OK,
    LOW: DiagnosticStatus.WARN,
    CRITICAL: DiagnosticStatus.ERROR,
    UNKNOWN: DiagnosticStatus.WARN,
}


class Monitor:
    """Subscribes to `battery_state`; publishes `battery_warning` and diagnostics; serves `~acknowledge`."""

    def __init__(self):
        self._lock = threading.Lock()
        self._assessor = Assessor()
        self._assessment = None
        self._last_state = None
        self._received = rospy.Time()
        self._warned = rospy.Time()
        self._publisher = rospy.Publisher("battery_warning", BatteryWarning, queue_size=10, latch=True)
        self._updater = diagnostic_updater.Updater()
        self._updater.setHardwareID("none")
        self._updater.add("Battery", self._diagnose)
        self._reconfigure = Server(MonitorConfig, self._configure)
        self._service = rospy.Service("~acknowledge", Trigger, self._acknowledge)
        self._subscriber = rospy.Subscriber("battery_state", BatteryState, self._assess, queue_size=10)
        self._timer = rospy.Timer(rospy.Duration(1), lambda _: self._updater.update(), reset=True)

    def _configure(self, config, _level):
        config.critical = min(config.critical, config.low)
        with self._lock:
            self._assessor.limits = Limits(
                config.low, config.critical, config.hysteresis, config.minutes_left
            )
            self._repeat_after = rospy.Duration(config.repeat_after)
            self._stale_after = rospy.Duration(config.stale_after)
        return config

    def _assess(self, state):
        with self._lock:
            self._last_state = state
            self._received = rospy.Time.now()
            percentage = state.percentage if state.present else float("nan")
            self._report(self._assessor.update(state.header.stamp.to_sec(), percentage))
        self._updater.setHardwareID(state.serial_number or state.location or "none")

    def _report(self, assessment):
        before, self._assessment = self._assessment, assessment
        is_new = before is None or assessment.level != before.level
        if is_new or assessment.acknowledged != before.acknowledged:
            self._publish()
        is_due = is_new or rospy.Time.now() - self._warned >= self._repeat_after
        if assessment.level == OK:
            if before is not None and is_new:
                rospy.loginfo(assessment.text)
        elif is_due and not assessment.acknowledged:
            self._warned = rospy.Time.now()
            (rospy.logerr if assessment.level == CRITICAL else rospy.logwarn)(assessment.text)

    def _publish(self):
        warning = BatteryWarning(
            level=self._assessment.level,
            percentage=self._assessment.percentage,
            time_left=self._assessment.time_left,
            acknowledged=self._assessment.acknowledged,
            text=self._assessment.text,
        )
        warning.header.stamp = self._last_state.header.stamp
        warning.header.frame_id = self._last_state.header.frame_id
        self._publisher.publish(warning)

    def _acknowledge(self, _request):
        with self._lock:
            assessment = self._assessor.acknowledge()
            if assessment is None:
                return TriggerResponse(False, "there is nothing to acknowledge")
            self._report(assessment)
            return TriggerResponse(True, assessment.text)

    def _diagnose(self, status):
        with self._lock:
            assessment, state = self._assessment, self._last_state
            age = rospy.Time.now() - self._received
            is_stale = age > self._stale_after
        if assessment is None:
            status.summary(DiagnosticStatus.STALE, "no battery state yet")
            return status
        if is_stale:
            status.summary(DiagnosticStatus.ERROR, f"no battery state for {age.to_sec():.0f} s")
        else:
            status.summary(_DIAGNOSTIC_LEVELS[assessment.level], assessment.text)
        status.add("Charge (%)", f"{100 * assessment.percentage:.1f}")
        status.add("Voltage (V)", f"{state.voltage:.2f}")
        status.add("Current (A)", f"{state.current:.2f}")
        status.add("Temperature (C)", f"{state.temperature:.1f}")
        status.add("Time left (s)", f"{assessment.time_left:.0f}")
        status.add("Acknowledged", str(assessment.acknowledged))
        return status


def main():
    """Run the monitor until the node shuts down."""
    rospy.init_node("battery_monitor")
    Monitor()  # kept alive by its subscriber, service and timer
    rospy.spin()
