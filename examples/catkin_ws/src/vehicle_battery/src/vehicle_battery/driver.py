"""The node that publishes the state of a battery."""

import rospy
from composiv_tryouts.msg import BatteryLevel
from sensor_msgs.msg import BatteryState

from vehicle_battery.power_supply import NoBattery, PowerSupply, find_batteries
from vehicle_battery.simulated_pack import SimulatedPack


def open_source(name, percentage=1.0):
    """Return the battery `name` of this computer, or the simulated one.

    "auto" selects the first battery of the computer, or the simulated one if there is none.

    Raises:
        NoBattery: the computer has no battery of that name.
        ValueError: `percentage` is not from 0 to 1.
    """
    if name == "auto":
        name = next(iter(find_batteries()), "simulated")
    return SimulatedPack(percentage) if name == "simulated" else PowerSupply(name)


def main():
    """Read `~source` at `~rate`; publish `battery_state`, and its charge as text on `battery_topic`."""
    rospy.init_node("battery_driver")
    frame = rospy.get_param("~frame_id", "battery")
    speed = rospy.get_param("~speed", 1.0)
    hz = rospy.get_param("~rate", 1.0)
    try:
        source = open_source(rospy.get_param("~source", "auto"), rospy.get_param("~percentage", 1.0))
        if hz <= 0:
            raise ValueError(f"rate must be positive, got {hz}")
    except (NoBattery, ValueError) as error:
        rospy.logfatal("%s", error)
        return 1
    rate = rospy.Rate(hz)
    state_publisher = rospy.Publisher("battery_state", BatteryState, queue_size=10)
    text_publisher = rospy.Publisher("battery_topic", BatteryLevel, queue_size=10)
    rospy.loginfo("battery: %s", source.read().location)
    while not rospy.is_shutdown():
        reading = source.read()
        state = reading.to_message()
        state.header.stamp = rospy.Time.now()
        state.header.frame_id = frame
        state_publisher.publish(state)
        if reading.percentage == reading.percentage:
            text_publisher.publish(f"%{100 * reading.percentage:.0f}")
        source.advance(speed / hz)
        try:
            rate.sleep()
        except rospy.ROSInterruptException:
            break
    return 0
