"""A genuine rclpy node with one endpoint of each kind, for tests of `pipros ros2`.

It publishes 0, 1, 2, … on three topics, and prints what it receives: the first number, each gap of a reliable
topic, and each tenth number. Lines of its standard input are commands; see `Kit.COMMANDS`.
"""

import array
import contextlib
import hashlib
import sys
import threading
import time

import rclpy
from geometry_msgs.msg import Quaternion
from rclpy.action import ActionClient, ActionServer, CancelResponse, get_action_names_and_types
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.qos import QoSDurabilityPolicy, QoSProfile, QoSReliabilityPolicy, qos_profile_sensor_data
from sensor_msgs.msg import CameraInfo, Imu
from std_msgs.msg import Int32, String, UInt8MultiArray
from std_srvs.srv import SetBool
from test_msgs.action import Fibonacci

RELIABLE = QoSProfile(depth=100)
LATCHED = QoSProfile(depth=1, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL)
BIG = QoSProfile(depth=4, reliability=QoSReliabilityPolicy.RELIABLE)


def say(*words):
    sys.stdout.write(" ".join(map(str, words)) + "\n")  # one call, as threads print at the same time
    sys.stdout.flush()


class Kit:
    def __init__(self, node):
        self.node = node
        self.group = ReentrantCallbackGroup()
        self.last = {}
        self.number = 0
        self.lock = threading.Lock()  # as the timer may send while a burst begins
        self.sending = [
            node.create_publisher(Int32, "/r2_reliable", QoSProfile(depth=1000)),
            node.create_publisher(Int32, "/r2_best_effort", qos_profile_sensor_data),
        ]
        self.latched = node.create_publisher(String, "/r2_latched", LATCHED)
        self.latched.publish(String(data="kept in ROS 2"))
        self.camera = node.create_publisher(CameraInfo, "/r2_camera", LATCHED)
        self.camera.publish(CameraInfo(distortion_model="plumb_bob", k=[float(each) for each in range(9)]))
        self.imu = node.create_publisher(Imu, "/r2_imu", LATCHED)
        self.imu.publish(Imu(orientation=Quaternion(x=1.0, y=2.0, z=3.0, w=4.0)))
        self.big = node.create_publisher(UInt8MultiArray, "/r2_big", BIG)
        self.receiving = [
            node.create_subscription(Int32, topic, self.on_number(topic), qos, callback_group=self.group)
            for topic, qos in (("/r1_reliable", RELIABLE), ("/r1_best_effort", qos_profile_sensor_data))
        ]
        self.receiving += [
            node.create_subscription(UInt8MultiArray, "/r1_big", self.on_big, BIG),
            node.create_subscription(CameraInfo, "/r1_camera", self.on_camera, LATCHED),
            node.create_subscription(Imu, "/r1_imu", self.on_imu, LATCHED),
        ]
        self.late = []
        self.timer = node.create_timer(0.05, self.send)
        node.create_service(SetBool, "/r2_switch", self.on_switch, callback_group=self.group)
        self.client = node.create_client(SetBool, "/r1_switch", callback_group=self.group)
        self.server = ActionServer(
            *(node, Fibonacci, "/r2_fibonacci", self.execute),
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=self.group,
        )
        self.actions = ActionClient(node, Fibonacci, "/r1_fibonacci", callback_group=self.group)
        self.goal = None

    def send(self):
        with self.lock:
            for publisher in self.sending:
                publisher.publish(Int32(data=self.number))
            self.number += 1

    def on_number(self, topic):
        def receive(message):
            last = self.last.get(topic)
            self.last[topic] = message.data
            if last is None:
                say("first", topic)
            elif message.data not in (last + 1, 0) and "reliable" in topic:
                say("gap", topic, last, message.data)
            if message.data % 10 == 0:
                say("at", topic, message.data)

        return receive

    def on_big(self, message):
        say("big", len(message.data), hashlib.sha256(message.data).hexdigest())

    def on_camera(self, message):
        say("camera", message.distortion_model, *message.k)

    def on_imu(self, message):
        say("imu", message.orientation.x, message.orientation.w, len(message.angular_velocity_covariance))

    def on_switch(self, request, response):
        response.success, response.message = not request.data, "by rclpy"
        return response

    def execute(self, handle):
        sequence = [0, 1]
        feedback = Fibonacci.Feedback()
        for _ in range(handle.request.order):
            if handle.is_cancel_requested:
                handle.canceled()
                return Fibonacci.Result(sequence=sequence)
            sequence.append(sequence[-1] + sequence[-2] if len(sequence) < 20 else 0)
            feedback.sequence = sequence
            handle.publish_feedback(feedback)
            time.sleep(0.02)
        handle.succeed()
        return Fibonacci.Result(sequence=sequence)

    # Commands.

    def burst(self, count):
        """Send numbers without a pause between them."""
        self.timer.cancel()
        for _ in range(int(count)):
            self.send()
        self.timer.reset()

    def nodes(self):
        say("nodes", *sorted(self.node.get_node_names()))
        for name, types in get_action_names_and_types(self.node):
            say("action", name, *sorted(types))

    def subscribe_late(self):
        self.late.append(
            self.node.create_subscription(
                String, "/r1_latched", lambda each: say("latched", each.data), LATCHED
            )
        )

    def send_big(self, count):
        data = array.array("B", bytes(range(256)) * (int(count) // 256))
        say("sent", hashlib.sha256(data).hexdigest())
        self.big.publish(UInt8MultiArray(data=data))

    def call(self, value):
        if not self.client.wait_for_service(60):
            say("no service")
        future = self.client.call_async(SetBool.Request(data=value == "1"))
        future.add_done_callback(lambda each: say("answer", each.result().success, each.result().message))

    def send_goal(self, order):
        """Send a goal, print whether it is accepted, the number of feedback messages, and the result."""
        count = []
        if not self.actions.wait_for_server(60):
            say("no action server")

        def on_accepted(future):
            self.goal = future.result()
            say("accepted", self.goal.accepted)
            self.goal.get_result_async().add_done_callback(on_result)

        def on_feedback(_):
            count.append(1)
            if len(count) == 1:
                say("feedback")

        def on_result(future):
            found = future.result()
            say("result", found.status, *found.result.sequence[:6])

        sending = self.actions.send_goal_async(
            Fibonacci.Goal(order=int(order)), feedback_callback=on_feedback
        )
        sending.add_done_callback(on_accepted)

    def cancel(self):
        self.goal.cancel_goal_async().add_done_callback(
            lambda each: say("cancelling", len(each.result().goals_canceling))
        )

    def obey(self):
        for line in sys.stdin:
            name, *words = line.split()
            getattr(self, name)(*words)


rclpy.init()
kit = Kit(rclpy.create_node("kit"))
threading.Thread(target=kit.obey, daemon=True).start()
executor = MultiThreadedExecutor(4)
executor.add_node(kit.node)
say("ready")
with contextlib.suppress(KeyboardInterrupt):
    executor.spin()
