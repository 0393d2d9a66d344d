"""Report diagnostics of one node, and print the messages on /diagnostics."""

from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import Imu

import diagnostic_updater as du
import rospy

rospy.init_node("device")
got = []
subscriber = rospy.Subscriber("/diagnostics", DiagnosticArray, got.append)
updater = du.Updater()
while not updater.publisher.get_num_connections():
    rospy.sleep(0.01)
updater.setHardwareID("none")
publisher = rospy.Publisher("imu", Imu, queue_size=5)


def state(stat):
    stat.summary(du.WARN, "warm")
    stat.add("degrees", 51.5)
    return stat


updater.add("temperature", state)
updater.add(du.Heartbeat())
diagnosed = du.DiagnosedPublisher(
    publisher, updater, du.FrequencyStatusParam({"min": 0.001}), du.TimeStampStatusParam()
)
message = Imu()
message.header.stamp = rospy.Time.now()
diagnosed.publish(message)
updater.force_update()
print(updater.removeByName("Heartbeat"), updater.removeByName("nothing"))
updater.broadcast(du.ERROR, "gone")
while len(got) < 5 and not rospy.is_shutdown():
    rospy.sleep(0.01)
for array in got:
    for status in array.status:
        shown = [value.key for value in status.values]
        print(status.name, status.level, status.message, repr(status.hardware_id), shown)
