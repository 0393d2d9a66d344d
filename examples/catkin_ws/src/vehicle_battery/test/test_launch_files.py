"""Test the launch files with pipros's pytest fixtures `ros_launch`, `ros_node` and `ros_wait_until`."""

from sensor_msgs.msg import BatteryState
from vehicle_battery.msg import BatteryWarning


def test_a_recorded_discharge_ends_critical(ros_launch, ros_node, ros_wait_until):
    levels = []
    ros_node.subscribe("/battery_warning", BatteryWarning, lambda warning: levels.append(warning.level))

    ros_launch("vehicle_battery", "replay.launch", rate=2000)

    ros_wait_until(lambda: BatteryWarning.CRITICAL in levels, timeout_s=60, what="a critical battery")
    assert BatteryWarning.LOW in levels


def test_the_driver_publishes_the_simulated_state(ros_launch, ros_node, ros_wait_until):
    states = []
    ros_node.subscribe("/battery_state", BatteryState, states.append)

    ros_launch("vehicle_battery", "battery.launch", source="simulated", percentage=0.5, rate=20, speed=60)

    ros_wait_until(lambda: len(states) > 3, timeout_s=60, what="states of the battery")
    assert states[0].location == "simulated"
    assert 0.4 < states[-1].percentage < states[0].percentage <= 0.5
