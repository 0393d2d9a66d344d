"""A genuine rospy node with one endpoint of each kind: the counterpart of genuine_ros2_node.py.

The argument is a file with the definition of actionlib_tutorials/FibonacciAction.
"""

import hashlib
import sys
import threading
from pathlib import Path

from geometry_msgs.msg import Quaternion
from sensor_msgs.msg import CameraInfo, Imu
from std_msgs.msg import Int32, String, UInt8MultiArray
from std_srvs.srv import SetBool, SetBoolResponse

import actionlib
import genpy.dynamic
import rospy

KIND = "actionlib_tutorials/FibonacciAction"
Fibonacci = genpy.dynamic.generate_dynamic(KIND, Path(sys.argv[1]).read_text())[KIND]
Goal = type(Fibonacci().action_goal.goal)
Feedback = type(Fibonacci().action_feedback.feedback)
Result = type(Fibonacci().action_result.result)


def say(*words):
    sys.stdout.write(" ".join(map(str, words)) + "\n")  # one call, as threads print at the same time
    sys.stdout.flush()


class Kit:
    def __init__(self):
        self.last = {}
        self.number = 0
        self.sending = [
            rospy.Publisher(topic, Int32, queue_size=100) for topic in ("/r1_reliable", "/r1_best_effort")
        ]
        self.latched = rospy.Publisher("/r1_latched", String, queue_size=1, latch=True)
        self.latched.publish("kept in ROS 1")
        self.camera = rospy.Publisher("/r1_camera", CameraInfo, queue_size=1, latch=True)
        self.camera.publish(CameraInfo(distortion_model="plumb_bob", K=range(9)))
        self.imu = rospy.Publisher("/r1_imu", Imu, queue_size=1, latch=True)
        self.imu.publish(Imu(orientation=Quaternion(1, 2, 3, 4)))
        self.big = rospy.Publisher("/r1_big", UInt8MultiArray, queue_size=4)
        self.receiving = [
            rospy.Subscriber(topic, Int32, self.on_number, topic)
            for topic in ("/r2_reliable", "/r2_best_effort")
        ]
        self.receiving += [
            rospy.Subscriber("/r2_big", UInt8MultiArray, self.on_big, buff_size=1 << 24),
            rospy.Subscriber("/r2_camera", CameraInfo, self.on_camera),
            rospy.Subscriber("/r2_imu", Imu, self.on_imu),
        ]
        self.late = []
        self.timer = rospy.Timer(rospy.Duration(0.05), self.send)
        self.service = rospy.Service(
            "/r1_switch", SetBool, lambda request: SetBoolResponse(not request.data, "by rospy")
        )
        self.server = actionlib.SimpleActionServer("/r1_fibonacci", Fibonacci, self.execute, False)
        self.server.start()
        self.client = actionlib.SimpleActionClient("/r2_fibonacci", Fibonacci)

    def send(self, _):
        for publisher in self.sending:
            publisher.publish(self.number)
        self.number += 1

    def on_number(self, message, topic):
        last = self.last.get(topic)
        self.last[topic] = message.data
        if last is None:
            say("first", topic)
        elif message.data not in (last + 1, 0) and "reliable" in topic:
            say("gap", topic, last, message.data)
        if message.data % 10 == 0:
            say("at", topic, message.data)

    def on_big(self, message):
        say("big", len(message.data), hashlib.sha256(message.data).hexdigest())

    def on_camera(self, message):
        say("camera", message.distortion_model, *message.K)

    def on_imu(self, message):
        say("imu", message.orientation.x, message.orientation.w, len(message.angular_velocity_covariance))

    def execute(self, goal):
        sequence = [0, 1]
        for _ in range(goal.order):
            if self.server.is_preempt_requested():
                self.server.set_preempted(Result(sequence))
                return
            sequence.append(sequence[-1] + sequence[-2] if len(sequence) < 20 else 0)
            self.server.publish_feedback(Feedback(sequence))
            rospy.sleep(0.02)
        self.server.set_succeeded(Result(sequence))

    # Commands.

    def subscribe_late(self):
        self.late.append(rospy.Subscriber("/r2_latched", String, lambda each: say("latched", each.data)))

    def send_big(self, count):
        data = bytes(range(256)) * (int(count) // 256)
        say("sent", hashlib.sha256(data).hexdigest())
        self.big.publish(UInt8MultiArray(data=data))

    def call(self, value):
        """Call the service of ROS 2 as soon as it answers: its gateway or server may have ended just now."""
        while not rospy.is_shutdown():
            try:
                rospy.wait_for_service("/r2_switch", 60)
                answer = rospy.ServiceProxy("/r2_switch", SetBool)(value == "1")
            except (rospy.ServiceException, rospy.ROSException) as error:
                say("failed", error)
                rospy.sleep(0.1)
            else:
                say("answer", answer.success, answer.message)
                return

    def send_goal(self, order):
        count = []

        def on_feedback(_):
            count.append(1)
            if len(count) == 1:
                say("feedback")

        def on_done(status, result):
            say("result", status, *result.sequence[:6])

        say("server", self.client.wait_for_server(rospy.Duration(60)))
        self.client.send_goal(Goal(int(order)), on_done, lambda: say("active"), on_feedback)

    def cancel(self):
        self.client.cancel_goal()

    def obey(self):
        for line in sys.stdin:
            name, *words = line.split()
            getattr(self, name)(*words)


rospy.init_node("kit", disable_rosout=True)
kit = Kit()
threading.Thread(target=kit.obey, daemon=True).start()
say("ready")
rospy.spin()
