"""Move a frame in steps, and print which of them are reported on tf_changes."""

import threading
from xmlrpc.client import ServerProxy

from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

import rospy
import tf2_ros
from tf.transformations import quaternion_from_euler

FAR = [(float(step), 0.0) for step in range(1, 4)]
STEPS = [(0.0, 0.0), (0.09, 0.0), (0.3, 0.0), (0.3, 0.15), (0.3, 0.5), *FAR]
TOO_NEAR = {(0.09, 0.0), (0.3, 0.15)}  # to the previous one, to be reported


class Mover:
    def __init__(self):
        self.broadcaster = tf2_ros.TransformBroadcaster()
        self.told = threading.Semaphore(0)
        self.told_last = None
        rospy.Subscriber("tf_changes", TFMessage, self.on_change)

    def on_change(self, message):
        for transform in message.transforms:
            found = transform.transform
            names = transform.header.frame_id, transform.child_frame_id
            self.told_last = names, round(found.translation.x, 3), round(found.rotation.z, 3)
            self.told.release()

    def send(self, x, yaw):
        message = TransformStamped()
        message.header.stamp = rospy.Time.now()
        message.header.frame_id, message.child_frame_id = "odom", "hand"
        message.transform.translation.x = x
        rotation = message.transform.rotation
        rotation.x, rotation.y, rotation.z, rotation.w = quaternion_from_euler(0, 0, yaw)
        self.broadcaster.sendTransform(message)

    def move(self, x, yaw, tries=1200):
        """Publish the pose until it was reported, or the listener must have checked it."""
        for _ in range(tries):
            self.send(x, yaw)
            if self.told.acquire(timeout=0.05):
                return self.told_last
        return None


def is_connected():
    """Return whether the notifier has the link to this node, and reports nothing in vain."""
    code, _, uri = rospy.get_master().lookupNode("/notifier")
    return code == 1 and any(row[2] == "o" for row in ServerProxy(uri).getBusInfo("/mover")[2])


rospy.init_node("mover")
mover = Mover()
while not is_connected() and not rospy.is_shutdown():
    rospy.sleep(0.01)
while mover.move(-1.0, 0.0) is None and not rospy.is_shutdown():
    pass  # the notifier begins
for place in STEPS:
    print(place, mover.move(*place, 40 if place in TOO_NEAR else 1200), flush=True)
