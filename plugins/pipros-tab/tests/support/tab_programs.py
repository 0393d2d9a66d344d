"""Programs of nodes without threads: `tests.graph` runs them in processes, `tests.pyodide` in Pyodide."""

TALKER = """
import rospy
from std_msgs.msg import String

rospy.init_node("talker")
publisher = rospy.Publisher("chatter", String, queue_size=10)
latched = rospy.Publisher("latched", String, latch=True, queue_size=1)
latched.publish("kept")
rospy.set_param("/settings", {"rate": 20, "names": ["a", "b"]})
rospy.on_shutdown(lambda: print("the hook ran"))
rate = rospy.Rate(20)
count = 0
while not rospy.is_shutdown():
    publisher.publish(f"hello {count}")
    count += 1
    if count == 1:
        rospy.loginfo("the talker talks")
    rate.sleep()
print("the talker ended")
"""

SERVER = """
import rospy
from std_srvs.srv import SetBool, Trigger

rospy.init_node("server")

def outer(request):
    # The service of the client calls `inner` back, which is served while this call waits.
    return True, "outer, " + rospy.ServiceProxy("there", Trigger)().message

rospy.Service("outer", SetBool, outer)
rospy.Service("inner", Trigger, lambda request: (True, "inner"))
rospy.Service("broken", Trigger, lambda request: 1 / 0)
rospy.Timer(rospy.Duration(0.1), lambda event: print("tick", flush=True), oneshot=True)
rospy.spin()
print("the server ended")
"""

CLIENT = """
import time
import rospy
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger

rospy.init_node("client")
rospy.wait_for_service("outer", 60)
inner = rospy.ServiceProxy("inner", Trigger)
rospy.Service("there", Trigger, lambda request: (True, "there, " + inner().message))
assert rospy.ServiceProxy("outer", SetBool)(True).message == "outer, there, inner"
try:
    rospy.ServiceProxy("broken", Trigger)()
except rospy.ServiceException as error:
    assert "error processing request: division by zero" in str(error)
try:
    rospy.ServiceProxy("missing", Trigger)()
except rospy.ServiceException as error:
    assert str(error) == "service [/missing] unavailable"

assert rospy.wait_for_message("latched", String, 60).data == "kept"
assert rospy.get_param("/settings") == {"rate": 20, "names": ["a", "b"]}
heard = []
rospy.Subscriber("chatter", String, lambda message: heard.append(int(message.data.split()[1])))
while len(heard) < 10:
    time.sleep(0.05)
assert heard == list(range(heard[0], heard[0] + len(heard)))

# A slow callback with a queue of one gets the newest message.
slow = []
def listen_slowly(message):
    slow.append(int(message.data.split()[1]))
    rospy.sleep(0.3)
subscriber = rospy.Subscriber("chatter", String, listen_slowly, queue_size=1)
while len(slow) < 4:
    rospy.sleep(0)  # as in a loop that is late
subscriber.unregister()
assert all(later - earlier >= 3 for earlier, later in zip(slow[1:], slow[2:])), slow

try:
    rospy.wait_for_message("nothing", String, 0.2)
except rospy.ROSException as error:
    assert str(error) == "timeout exceeded while waiting for message on topic nothing"
print("the client is done")
"""

BROADCASTER = """
import rospy
import tf
import tf_conversions

rospy.init_node("broadcaster")
broadcaster = tf.TransformBroadcaster()
rate = rospy.Rate(20)
stamps = [rospy.Time.now() for _ in range(100)]
assert len(set(stamps)) == len(stamps), "a browser's clock shows milliseconds"
assert tuple(tf_conversions.transformations.quaternion_from_euler(0, 0, 0)) == (0, 0, 0, 1)
while not rospy.is_shutdown():
    turned = tf.transformations.quaternion_from_euler(0, 0, 0.5)
    broadcaster.sendTransform((1, 2, 0), turned, rospy.Time.now(), "turtle1", "world")
    rate.sleep()
"""

FRAME_LISTENER = """
import math
import rospy
import tf
from tf.transformations import euler_from_quaternion

rospy.init_node("frame_listener")
listener = tf.TransformListener()
rate = rospy.Rate(20)
while not rospy.is_shutdown():
    try:
        position, turned = listener.lookupTransform("world", "turtle1", rospy.Time(0))
    except (tf.LookupException, tf.ConnectivityException, tf.ExtrapolationException):
        rate.sleep()
        continue
    assert tuple(position) == (1, 2, 0)
    assert math.isclose(euler_from_quaternion(turned)[2], 0.5)
    print("turned")
    break
"""

BUSY = """
import rospy
rospy.init_node("busy")
print("computing", flush=True)
while True:
    pass
"""

LIMITS = """
import concurrent.futures
import os
import socket
import subprocess
import sys
import threading
import urllib.request

FAR = "a browser tab reaches only its own nodes, not [example.com]"
THREAD = "a browser tab has no threads: use rospy.Timer, or a loop with rospy.sleep"
PROGRAM = "a browser tab runs only Python programs and pipros's commands"
for text, call in (
    (FAR, lambda: socket.create_connection(("example.com", 80))),
    (FAR, lambda: urllib.request.urlopen("http://example.com")),
    ("a browser tab has only TCP streams", lambda: socket.socket(socket.AF_INET, socket.SOCK_DGRAM)),
    (THREAD, lambda: threading.Thread(target=print).start()),
    (THREAD, lambda: threading.Timer(1, print).start()),
    (THREAD, lambda: concurrent.futures.ThreadPoolExecutor().submit(print)),
    (PROGRAM, lambda: os.system("ls")),
    (PROGRAM, lambda: os.fork()),
    (PROGRAM + ", without pipes: rosnode list", lambda: subprocess.check_output(["rosnode", "list"])),
    (PROGRAM + ", without a shell: ls | wc", lambda: subprocess.run("ls | wc", shell=True)),
    ("the programs of a browser tab read keys, but no lines", lambda: input("name? ")),
    ("the programs of a browser tab read keys, but no lines", lambda: list(sys.stdin)),
):
    try:
        call()
    except Exception as error:
        assert text in str(error), error
    else:
        raise AssertionError(text)
"""
