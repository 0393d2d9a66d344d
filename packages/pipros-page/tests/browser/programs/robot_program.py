"""A node that publishes data for every tab of the page, with pipros or with genuine rospy."""

import contextlib
import math
import sys

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import BatteryState, Image, Imu
from tf2_msgs.msg import TFMessage

import rospy

WIDTH, HEIGHT = 96, 64
FRAMES = (("map", "base_link"), ("base_link", "camera"), ("base_link", "imu"), ("base_link", "wheel_left"))


def picture():
    """Return a picture of a floor, a sky and a lit post, like that of a camera."""
    data = bytearray()
    for y in range(HEIGHT):
        for x in range(WIDTH):
            if y < 26:
                pixel = 150 + y * 3, 175 + y * 2, 225
            elif (int((x - 48) * 3 / (y - 20) + 50) + int(130 / (y - 20))) % 2:
                pixel = 96 + y, 88 + y, 80 + y
            else:
                pixel = 66 + y, 62 + y, 60 + y
            if 58 <= x < 66 and 14 <= y < 50:
                pixel = 235 - (x - 58) * 14, 120 - (x - 58) * 8, 40
            data += bytes(pixel)
    return bytes(data)


def status(name, level, message, **values):
    pairs = [KeyValue(key, str(value)) for key, value in sorted(values.items())]
    return DiagnosticStatus(level=level, name=name, message=message, hardware_id="robot 7", values=pairs)


def transform(parent, child, turn):
    made = TransformStamped()
    made.header.stamp = rospy.Time.now()
    made.header.frame_id, made.child_frame_id = parent, child
    made.transform.rotation.w, made.transform.rotation.z = math.cos(turn), math.sin(turn)
    return made


rospy.init_node(sys.argv[1])
images = rospy.Publisher("camera/image_raw", Image, queue_size=1)
views = rospy.Publisher("front/image_raw", Image, queue_size=1)
imus = rospy.Publisher("imu", Imu, queue_size=1)
batteries = rospy.Publisher("battery", BatteryState, queue_size=1)
diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=1)
transforms = rospy.Publisher("/tf", TFMessage, queue_size=10)
rospy.set_param("~wheel_radius", 0.15)
rospy.set_param("~drive", {"controller": "pure_pursuit", "gains": [1.2, 0.0, 0.05], "max_speed": 0.8})
view = Image(width=WIDTH, height=HEIGHT, step=3 * WIDTH, encoding="rgb8", data=picture())
view.header.frame_id = "camera"
rate = rospy.Rate(20)
count = 0
while not rospy.is_shutdown():
    count += 1
    red = b"\xff\x00\x00"
    images.publish(Image(width=8, height=4, step=24, encoding="rgb8", data=red * 32))
    imu = Imu()
    imu.angular_velocity.x = math.sin(count / 20.0)
    imu.angular_velocity.y = 0.6 * math.cos(count / 13.0)
    imu.linear_acceleration.z = 9.81 + 0.1 * math.sin(count / 3.0)
    imus.publish(imu)
    transforms.publish(TFMessage([transform(parent, child, count / 200.0) for parent, child in FRAMES]))
    if count % 4 == 0:
        views.publish(view)
        batteries.publish(BatteryState(voltage=24.1, percentage=0.625, present=True))
        warmth = 68 + count % 7
        is_hot = count // 40 % 2 == 1
        diagnostics.publish(
            DiagnosticArray(
                status=[
                    status("/Motors/left", 1, "warm", temperature=warmth, current="2.1 A"),
                    status("/Motors/right", 2 if is_hot else 0, "hot" if is_hot else "OK", temperature=41),
                    status("/Power/battery", 0, "62 %", voltage="24.1 V"),
                    status("/Sensors/imu", 0, "20 Hz", rate="20.0"),
                ]
            )
        )
    if count % 10 == 0:
        rospy.logwarn("wheel slips: %d", count)
    if count % 30 == 5:
        rospy.loginfo("waypoint %d reached", count // 30)
    if count % 70 == 5:
        rospy.logerr("no answer of the gripper for %.1f s", count / 20.0)
    with contextlib.suppress(rospy.ROSInterruptException):
        rate.sleep()
