"""A node that publishes 10,000 log entries a second, like /rosout, until it is terminated."""

import itertools
import time

from rosgraph_msgs.msg import Log

import rospy

rospy.init_node("busy")
publisher = rospy.Publisher("/rosout_agg", Log, queue_size=10000)
begin = time.monotonic()
for number in itertools.count():
    level = (Log.DEBUG, Log.INFO, Log.INFO, Log.WARN, Log.ERROR)[number % 5]
    publisher.publish(
        Log(level=level, name="/busy", msg=f"entry {number}", file="busy.py", line=number % 100)
    )
    if number % 500 == 0:
        time.sleep(max(0.0, begin + number / 10000 - time.monotonic()))
    if rospy.is_shutdown():
        break
