"""The programs that run in the system of `soak_system.py`."""

#: The beginning of the programs that print their counts as JSON.
COUNTING = """
import json, rospy
done, turns = {"failures": 0}, 0
def count(topic, kind, name):
    done[name] = 0
    def add(_):
        done[name] += 1
    rospy.Subscriber(topic, kind, add)
def attempt(name, work):
    done.setdefault(name, 0)
    try:
        good = work()
    except Exception as error:
        good = False
        rospy.logwarn("%s: %s", name, error)
    done[name if good else "failures"] += 1
def report_each(count):
    global turns
    turns += 1
    if turns % count == 0:
        print(json.dumps(done), flush=True)
"""
NODES = {
    "talker": """
import os, rospy
from std_msgs.msg import String
from std_srvs.srv import Trigger, TriggerResponse
rospy.init_node("talker")
publisher, count = rospy.Publisher("chat", String, queue_size=10), 0
rate = rospy.Rate(float(os.environ["RATE_HZ"]))
rospy.Service("ask", Trigger, lambda _: TriggerResponse(True, str(count)))
while not rospy.is_shutdown():
    count += 1
    publisher.publish(str(count))
    rate.sleep()
""",
    "frames": """
import os, rospy, tf2_ros
from geometry_msgs.msg import TransformStamped
rospy.init_node("frames")
broadcaster, rate = tf2_ros.TransformBroadcaster(), rospy.Rate(float(os.environ["RATE_HZ"]))
while not rospy.is_shutdown():
    sent = []
    for number in range(10):
        made = TransformStamped()
        made.header.stamp, made.header.frame_id = rospy.Time.now(), f"frame_{number}"
        made.child_frame_id, made.transform.rotation.w = f"frame_{number + 1}", 1.0
        sent.append(made)
    broadcaster.sendTransform(sent)
    rate.sleep()
""",
    "server": """
import actionlib, rospy
from actionlib.msg import TestAction, TestFeedback
rospy.init_node("server")
def work(goal):
    server.publish_feedback(TestFeedback(goal.goal))
    server.set_succeeded()
server = actionlib.SimpleActionServer("go", TestAction, work, auto_start=False)
server.start()
rospy.spin()
""",
    "client": COUNTING
    + """
import actionlib, tf2_ros
from actionlib.msg import TestAction, TestGoal
from actionlib_msgs.msg import GoalStatus
from std_msgs.msg import String
from std_srvs.srv import Trigger
rospy.init_node("client")
count("chat", String, "messages")
buffer = tf2_ros.Buffer(rospy.Duration(5))
listener = tf2_ros.TransformListener(buffer)
client, ask = actionlib.SimpleActionClient("go", TestAction), rospy.ServiceProxy("ask", Trigger)
client.wait_for_server()
ask.wait_for_service()
rate, wait = rospy.Rate(10), rospy.Duration(10)
def set_and_get():
    rospy.set_param("/soak/turn", turns)
    return rospy.get_param("/soak/turn") == turns
while not rospy.is_shutdown():
    attempt("lookups", lambda: buffer.lookup_transform("frame_0", "frame_10", rospy.Time(0), wait))
    attempt("goals", lambda: client.send_goal_and_wait(TestGoal(turns), wait) == GoalStatus.SUCCEEDED)
    attempt("calls", lambda: ask().success)
    attempt("parameters", set_and_get)
    report_each(50)
    rate.sleep()
""",
}
ENDING = """#!/usr/bin/env python3
import sys, rospy
from std_msgs.msg import String
rospy.init_node("ending")
heard = []
rospy.Subscriber("/chat", String, heard.append)
rospy.Publisher("said", String, queue_size=1, latch=True).publish("here")
rospy.sleep(rospy.get_param("~lives"))
sys.exit(rospy.get_param("~code"))
"""
LAUNCH = """<launch>
  <node name="ends" pkg="soak" type="ending.py" respawn="true" ns="a">
    <param name="lives" value="{0}"/> <param name="code" value="0"/>
  </node>
  <node name="fails" pkg="soak" type="ending.py" respawn="true" ns="b">
    <param name="lives" value="{1}"/> <param name="code" value="3"/>
  </node>
</launch>"""

#: The programs of `--everything`.
MORE_NODES = {
    "source": """
import math, rospy, struct, tf2_ros
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import CameraInfo, Image, PointCloud2, PointField
from std_msgs.msg import Float64
from visualization_msgs.msg import Marker
rospy.init_node("source")
links = "".join(
    f'<link name="frame_{n}"><visual><geometry><box size="0.2 0.1 0.1"/></geometry></visual></link>'
    + (f'<joint name="j{n}" type="fixed"><parent link="frame_{n - 1}"/><child link="frame_{n}"/></joint>'
       if n else "")
    for n in range(11))
rospy.set_param("/robot_description", f'<robot name="chain">{links}</robot>')
odom = TransformStamped(child_frame_id="odom")
odom.header.frame_id, odom.transform.rotation.w = "frame_0", 1.0
static = tf2_ros.StaticTransformBroadcaster()
static.sendTransform(odom)
numbers = rospy.Publisher("number", Float64, queue_size=10)
marks = rospy.Publisher("marks", Marker, queue_size=10)
clouds = rospy.Publisher("cloud", PointCloud2, queue_size=1)
images = rospy.Publisher("image", Image, queue_size=1)
raw = rospy.Publisher("camera/image_raw", Image, queue_size=1)
camera = rospy.Publisher("camera/camera_info", CameraInfo, queue_size=1)
info = CameraInfo(width=480, height=320, distortion_model="plumb_bob", D=[0.1, 0, 0, 0, 0],
                  K=[400, 0, 240, 0, 400, 160, 0, 0, 1], R=[1, 0, 0, 0, 1, 0, 0, 0, 1],
                  P=[400, 0, 240, 0, 0, 400, 160, 0, 0, 0, 1, 0])
fields = [PointField(name, 4 * n, PointField.FLOAT32, 1) for n, name in enumerate("xyz")]
cloud = PointCloud2(height=1, width=2000, point_step=12, row_step=24000, fields=fields)
cloud.data = b"".join(struct.pack("<3f", n % 50 / 10, n // 50 / 10, 0) for n in range(2000))
mark = Marker(ns="marks", type=Marker.CUBE)
mark.pose.orientation.w = mark.scale.x = mark.scale.y = mark.scale.z = mark.color.a = 1.0
cloud.header.frame_id = mark.header.frame_id = "frame_0"
rate, count = rospy.Rate(20), 0
while not rospy.is_shutdown():
    count += 1
    numbers.publish(math.sin(count / 50))
    if count % 10 == 0:
        cloud.header.stamp = mark.header.stamp = rospy.Time.now()
        mark.id = mark.pose.position.x = count // 10 % 10
        marks.publish(mark)
        clouds.publish(cloud)
        images.publish(Image(width=160, height=120, step=480, encoding="rgb8",
                             data=bytes([count // 10 % 256]) * 57600))
        picture = Image(width=480, height=320, step=480, encoding="bayer_rggb8", data=bytes(153600))
        picture.header.stamp = info.header.stamp = rospy.Time.now()
        raw.publish(picture)
        camera.publish(info)
    if count % 100 == 0:
        rospy.loginfo("published %d numbers", count)
    rate.sleep()
""",
    "driver": COUNTING
    + """
from example_interfaces.msg import Blob
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Image, LaserScan
from std_msgs.msg import String
from std_srvs.srv import Empty, SetBool
from turtlesim.msg import Pose
rospy.init_node("driver")
count("scan", LaserScan, "scans")
count("odom", Odometry, "odometry")
count("turtle1/pose", Pose, "poses")
count("operator/report", String, "of the fleet")
count("camera/image_rect_color", Image, "through nodelets")
def check(blob):
    attempt("of ROS 2", lambda: blob.data == bytes([blob.number % 256]) * 100)
rospy.Subscriber("back", Blob, check)
robot, turtle = (rospy.Publisher(name, Twist, queue_size=1) for name in ("cmd_vel", "turtle1/cmd_vel"))
blobs = rospy.Publisher("blob", Blob, queue_size=10)
charge, reset = rospy.ServiceProxy("charge", SetBool), rospy.ServiceProxy("reset_positions", Empty)
charge.wait_for_service()
done["failures"] += not charge(True).success
command, rate = Twist(), rospy.Rate(10)
command.linear.x, command.angular.z = 0.2, 0.5
while not rospy.is_shutdown():
    blobs.publish(Blob(turns, bytes([turns % 256]) * 100))
    if turns % 2 == 0:
        robot.publish(command)
        turtle.publish(command)
    if turns % 100 == 0:
        attempt("resets", lambda: reset() is not None)
    report_each(50)
    rate.sleep()
""",
}
#: The program on the second master.
OPERATOR = f"""{COUNTING}
from nav_msgs.msg import Odometry
from std_msgs.msg import String
from std_srvs.srv import Trigger
rospy.init_node("operator")
count("robot/chat", String, "chat over the fleet")
count("robot/odom", Odometry, "odometry over the fleet")
reports = rospy.Publisher("report", String, queue_size=10)
ask, rate = rospy.ServiceProxy("robot/ask", Trigger), rospy.Rate(2)
ask.wait_for_service()
while not rospy.is_shutdown():
    reports.publish(str(turns))
    attempt("calls over the fleet", lambda: ask().success)
    report_each(10)
    rate.sleep()
"""
#: The program that sends move_base to one room and back.
NAVIGATOR = f"""{COUNTING}
import actionlib
from actionlib_msgs.msg import GoalStatus
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
rospy.init_node("navigator")
client = actionlib.SimpleActionClient("move_base", MoveBaseAction)
client.wait_for_server()
goal = MoveBaseGoal()
goal.target_pose.header.frame_id, goal.target_pose.pose.orientation.w = "map", 1.0
place, limit = goal.target_pose.pose.position, rospy.Duration(120)
while not rospy.is_shutdown():
    place.x, place.y = ((3.2, 2.0), (2.8, 1.0))[turns % 2]
    attempt("drives", lambda: client.send_goal_and_wait(goal, limit) == GoalStatus.SUCCEEDED)
    report_each(1)
"""
NAVIGATION = """<launch>
  <include file="$(find turtlebot3_bringup)/launch/turtlebot3_robot.launch">
    <arg name="headless" value="true"/>
  </include>
  <include file="$(find turtlebot3_navigation)/launch/turtlebot3_navigation.launch">
    <arg name="open_rviz" value="false"/>
  </include>
</launch>"""
#: Converts images with Bayer patterns to colour, then rectifies them.
NODELETS = """<launch>
  <group ns="camera">
    <node pkg="nodelet" type="nodelet" name="camera_manager" args="manager"/>
    <include file="$(find image_proc)/launch/image_proc.launch">
      <arg name="manager" value="/camera/camera_manager"/>
    </include>
  </group>
</launch>"""
FLEET_FILE = """
share: {topics: [/chat, /odom]}
accept: {services: [/ask]}
"""
SCENE = """\
Visualization Manager:
  Displays:
    - {Class: rviz/Grid, Name: Grid}
    - {Class: rviz/TF, Name: TF}
    - {Class: rviz/RobotModel, Name: Robot}
    - {Class: rviz/Marker, Name: Marks, Marker Topic: /marks}
    - {Class: rviz/PointCloud2, Name: Cloud, Topic: /cloud}
    - {Class: rviz/LaserScan, Name: Scan, Topic: /scan}
  Global Options: {Fixed Frame: frame_0, Frame Rate: 1}
Window Geometry: {Hide Left Dock: true}
"""
