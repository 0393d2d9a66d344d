"""Look up `hand` in `map`, and unknown frames, at the buffer server named by the argument."""

import rospy
import tf2_ros

rospy.init_node("asker")
# It fails if a response is later than that, even if the server is merely slow.
client = tf2_ros.BufferClient("tf2_buffer_server", timeout_padding=rospy.Duration(60))
print(client.wait_for_server(rospy.Duration(60)))
found = client.lookup_transform("map", "hand", rospy.Time(0), rospy.Duration(30))
print(found.header.frame_id, found.child_frame_id, found.transform.translation.x, found.transform.rotation.z)
now = rospy.Time.now()
full = client.lookup_transform_full("map", now, "hand", now, "map", rospy.Duration(30))
print(round(full.transform.translation.x, 6), client.can_transform("map", "hand", rospy.Time(0)))
for wanted in ("nowhere", "/hand", ""):
    try:
        client.lookup_transform("map", wanted, rospy.Time(0), rospy.Duration(0.1))
    except tf2_ros.TransformException as error:
        print(type(error).__name__, error)
