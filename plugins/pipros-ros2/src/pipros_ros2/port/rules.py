"""What becomes what: calls of rospy that have a counterpart in rclpy, and how they are written there.

A template names the arguments of the call. `NODE` stands for the variable with the node.
"""

from __future__ import annotations

from array import array
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

NODE: Final = "NODE"
NOW: Final = f"{NODE}.get_clock().now()"


@dataclass(frozen=True, slots=True)
class Rule:
    """A function of ROS 1 and the expression that replaces a call.

    Attributes:
        signature: its parameters, in order. Those in parentheses have no counterpart, which makes no
            difference to most programs. The others have the text after `=` if they are not given.
        template: the expression; empty if there is none.
        kind: what the expression yields; see `pipros_ros2.port.kinds`.
        needs: modules and helpers of the draft that it uses, separated by spaces.
        reason: why a person must look at the result; empty if it is sure.
    """

    signature: str
    template: str
    kind: str = ""
    needs: str = ""
    reason: str = ""

    @property
    def defaults(self) -> dict[str, str]:
        """The text of each parameter that is not given, by name; empty if there is none. In order."""
        parts = (each.partition("=") for each in self.signature.split(", ") if each)
        return {name.strip("()"): default for name, _, default in parts}

    def has_no_counterpart(self, parameter: str) -> bool:
        """Return whether a parameter may be left out."""
        return f"({parameter})" in self.signature.split(", ")


_GONE: Final = "ROS 2 has no such function"
_SHUTDOWN: Final = "in ROS 2, nothing can be published while the callback runs"
_TIME: Final = "Time(seconds={secs}, clock_type=ClockType.ROS_TIME)"
_EXACT: Final = "Time(seconds={secs}, nanoseconds={nsecs}, clock_type=ClockType.ROS_TIME)"

CALLS: Final[Mapping[str, Rule]] = {
    "rospy.Publisher": Rule(
        "name, data_class, subscriber_listener, (tcp_nodelay), latch, headers, queue_size=10",
        "NODE.create_publisher({data_class}, {name}, {queue_size})",
    ),
    "rospy.Subscriber": Rule(
        "name, data_class, callback=lambda _message: None, callback_args, queue_size=10, (buff_size), "
        "(tcp_nodelay)",
        "NODE.create_subscription({data_class}, {name}, {callback}, {queue_size})",
    ),
    "rospy.Service": Rule(
        "name, service_class, handler, (buff_size), error_handler",
        "NODE.create_service({service_class}, {name}, lambda request, _: ({handler})(request))",
    ),
    "rospy.ServiceProxy": Rule(
        "name, service_class, (persistent), headers", "client({service_class}, {name})", needs="client"
    ),
    "rospy.wait_for_service": Rule(
        "service, timeout=None", "wait_for_service({service}, {timeout})", needs="wait_for_service"
    ),
    "rospy.wait_for_message": Rule(
        "topic, topic_type, timeout=None",
        "wait_for_message({topic}, {topic_type}, {timeout})",
        needs="wait_for_message",
    ),
    "rospy.Rate": Rule("hz, (reset)", "NODE.create_rate({hz})", "rate", needs="thread"),
    "rospy.sleep": Rule("duration", "NODE.get_clock().sleep_for({duration})", needs="thread"),
    "rospy.Timer": Rule(
        "period, callback, oneshot, (reset)", "NODE.create_timer({period}, lambda: ({callback})(None))"
    ),
    "rospy.Time.now": Rule("", NOW, "time"),
    "rospy.get_rostime": Rule("", NOW, "time"),
    "rospy.get_time": Rule("", f"({NOW}.nanoseconds / 1e9)", "float"),
    "rospy.Time": Rule("secs=0, nsecs=0", _EXACT, "time", "Time"),
    "rospy.Time.from_sec": Rule("secs", _TIME, "time", "Time"),
    "rospy.Duration": Rule(
        "secs=0, nsecs=0", "Duration(seconds={secs}, nanoseconds={nsecs})", "duration", "Duration"
    ),
    "rospy.Duration.from_sec": Rule("secs", "Duration(seconds={secs})", "duration", "Duration"),
    "rospy.is_shutdown": Rule("", "(not rclpy.ok())", "bool"),
    "rospy.signal_shutdown": Rule("(reason)", "rclpy.try_shutdown()"),
    "rospy.on_shutdown": Rule("h", "NODE.context.on_shutdown({h})", reason=_SHUTDOWN),
    "rospy.spin": Rule("", "spin()", needs="spin"),
    "rospy.get_name": Rule("", "NODE.get_fully_qualified_name()", "str"),
    "rospy.get_caller_id": Rule("", "NODE.get_fully_qualified_name()", "str"),
    "rospy.get_namespace": Rule("", "NODE.get_namespace()", "str"),
    "rospy.resolve_name": Rule("name", "NODE.resolve_topic_name({name})", "str"),
    "rospy.myargv": Rule("argv=None", "remove_ros_args({argv})", needs="remove_ros_args"),
    "rospy.get_param": Rule("param_name, default", "get_param"),
    "rospy.set_param": Rule("param_name, param_value", "set_param"),
    "rospy.has_param": Rule("param_name", "NODE.has_parameter", "bool"),
    "tf2_ros.TransformListener": Rule("buffer, queue_size", "tf2_ros.TransformListener({buffer}, NODE)"),
    "tf2_ros.TransformBroadcaster": Rule("", "tf2_ros.TransformBroadcaster(NODE)"),
    "tf2_ros.StaticTransformBroadcaster": Rule("", "tf2_ros.StaticTransformBroadcaster(NODE)"),
    "message_filters.Subscriber": Rule("topic, cls", "message_filters.Subscriber(NODE, {cls}, {topic})"),
}
"""Functions by their full names."""

LOGGING: Final = {"debug": "debug", "info": "info", "warn": "warning", "err": "error", "fatal": "fatal"}
"""The log functions: `rospy.logwarn` becomes `get_logger().warning`."""

METHODS: Final[Mapping[str, Mapping[str, str]]] = {
    "pub": {"get_num_connections": "get_subscription_count", "unregister": "destroy"},
    "sub": {"unregister": "destroy"},
    "timer": {"shutdown": "cancel"},
    "service": {"shutdown": "destroy"},
}
"""Methods with another name, by the kind of their object."""

KEPT: Final[Mapping[str, frozenset[str]]] = {
    "pub": frozenset({"publish", "get_num_connections", "unregister"}),
    "sub": frozenset({"unregister"}),
    "array": frozenset(dir(array)),
    "timer": frozenset({"shutdown"}),
    "service": frozenset({"shutdown"}),
    "proxy": frozenset({"call"}),
    "rate": frozenset({"sleep"}),
    "time": frozenset({"to_sec", "to_nsec"}),
    "duration": frozenset({"to_sec", "to_nsec"}),
    "stamp": frozenset({"to_sec", "to_nsec", "secs", "nsecs", "sec", "nanosec"}),
    "span": frozenset({"to_sec", "to_nsec", "secs", "nsecs", "sec", "nanosec"}),
}
"""What a draft can use of an object, by its kind. rclpy may lack all else that rospy's object has."""

EXCEPTIONS: Final = {
    "rospy.ROSInterruptException": (
        "(KeyboardInterrupt, ExternalShutdownException, ROSInterruptException)",
        "interrupts",
        "",
    ),
    "rospy.ServiceException": ("Exception", "", "a service of ROS 2 reports no errors"),
    "rospy.ROSException": ("Exception", "", "rclpy raises other exceptions than rospy"),
}
"""Exceptions: their counterparts, what they need, and why a person must look at them."""

EXACT: Final = "fields of messages need values of their exact types, such as 1.0 for a float"
FIELDS: Final = {
    "byte": "a byte of a message is bytes of length 1 in ROS 2, not a number",
    "array": "an array of numbers in a message of ROS 2 is no list and no bytes: convert it first",
}
"""Fields that are of other types in ROS 2, by their kind."""

LATE: Final = {
    "lambda: ({callback})(None)": "lambda call=({callback}): call(None)",
    "lambda request, _: ({handler})(request)": "lambda request, _, call=({handler}): call(request)",
}
"""Parts of templates, and what must replace them if the function is a variable with other values later."""

_ROS1: Final = (
    *("genpy", "nodelet", "ros_numpy", "rosbag", "rosgraph", "roslaunch", "rosmsg", "rosnode", "rosparam"),
    *("rosservice", "rostest", "rostopic", "rosunit", "smach", "smach_ros", "tf_conversions", "topic_tools"),
)

UNSURE: Final = {
    "actionlib.": "goals are futures in rclpy.action: send_goal_async, then the result of its handle",
    "tf.": "tf has become tf2_ros, with lookup_transform; PyPI has no tf2_ros for ROS 2",
    "dynamic_reconfigure.": "parameters of a node can be set at run time: add_on_set_parameters_callback",
    "rospkg.": "ament_index_python.packages.get_package_share_directory finds packages",
    "rospy.SubscribeListener": "rclpy.event_handler.PublisherEventCallbacks learn of subscriptions",
    "rospy.": _GONE,
    "roslib.": _GONE,
    "sensor_msgs.point_cloud2.": "sensor_msgs_py.point_cloud2, which PyPI lacks, has such functions",
    "std_msgs.msg.Duration.": "builtin_interfaces.msg.Duration takes its place",
    "std_msgs.msg.Time.": "builtin_interfaces.msg.Time takes its place",
    "rosgraph_msgs.msg.Log.": "rcl_interfaces.msg.Log takes its place",
    **{f"{module}.": f"ROS 2 has no module {module}" for module in _ROS1},
}
"""Reasons for names without a rule, by prefix."""

NOT_ON_PYPI: Final = (
    *("angles", "camera_info_manager", "cv_bridge", "diagnostic_updater", "image_geometry", "laser_geometry"),
    *("interactive_markers", "message_filters", "tf2_geometry_msgs", "tf2_py", "tf2_ros", "tf2_sensor_msgs"),
)
"""Modules that ROS 2 has, but for which there are no wheels."""


def unsure(name: str) -> str | None:
    """Return why a person must look at a name, or None. The name of a module ends with a dot."""
    return next((reason for prefix, reason in UNSURE.items() if name.startswith(prefix)), None)


IMPORTS: Final = {
    "Time": "from rclpy.clock import ClockType\nfrom rclpy.time import Time",
    "Duration": "from rclpy.duration import Duration",
    "latched": "from rclpy.qos import DurabilityPolicy, QoSProfile",
    "interrupts": "from rclpy.exceptions import ROSInterruptException\n"
    "from rclpy.executors import ExternalShutdownException",
    "spin": "import contextlib\nfrom rclpy.executors import ExternalShutdownException",
    "thread": "import atexit\nimport threading\n"
    "from rclpy.executors import ExternalShutdownException\n"
    "from rclpy.executors import MultiThreadedExecutor",
    "remove_ros_args": "from rclpy.utilities import remove_ros_args",
    "get_param": "from rcl_interfaces.msg import ParameterDescriptor",
    "set_param": "from rclpy.parameter import Parameter",
    "client": "from rclpy.callback_groups import ReentrantCallbackGroup",
    "wait_for_service": "import time",
    "wait_for_message": "import queue",
}
"""What each need imports."""

IMPLIED: Final = {
    "client": "thread",
    "wait_for_service": "thread",
    "wait_for_message": "thread",
    "set_param": "get_param",
}
"""Needs of needs. Code that waits needs a thread that runs the callbacks, as rospy has."""

HELPERS: Final = {
    "thread": """def run_callbacks():
    executor = MultiThreadedExecutor()
    executor.add_node(NODE)
    try:
        while rclpy.ok():
            executor.spin_once(timeout_sec=0.5)  # Ctrl-C does not always wake it
    except ExternalShutdownException:
        pass
    except RuntimeError as error:
        if "cannot schedule new futures" not in str(error):  # as it does when Python ends
            raise
    finally:
        spinner_ended.set()


def end():
    rclpy.try_shutdown()
    if spinner.is_alive():
        spinner.join()


spinner_ended = threading.Event()  # after Ctrl-C in join(), Python takes a running thread for ended
spinner = threading.Thread(target=run_callbacks, daemon=True)
atexit.register(end)
""",
    "spin": '''def spin():
    """Run callbacks until Ctrl-C."""
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        SPIN
''',
    "get_param": '''def get_param(name, default=None):
    """Return a parameter of the node, which is declared when it is read first."""
    if not NODE.has_parameter(name):
        NODE.declare_parameter(name, default, ParameterDescriptor(dynamic_typing=True))
    value = NODE.get_parameter(name).value
    if value is None and default is None:
        raise KeyError(name)
    return value
''',
    "set_param": '''def set_param(name, value):
    """Set a parameter of the node."""
    if not NODE.has_parameter(name):
        NODE.declare_parameter(name, value, ParameterDescriptor(dynamic_typing=True))
    NODE.set_parameters([Parameter(name, value=value)])
''',
    "client": '''def client(kind, name):
    """Return a client whose calls may be made in callbacks."""
    return NODE.create_client(kind, name, callback_group=ReentrantCallbackGroup())
''',
    "wait_for_service": '''def wait_for_service(name, timeout=None):
    """Wait until a node offers a service."""
    end = None if timeout is None else time.monotonic() + timeout
    while NODE.resolve_service_name(name) not in dict(NODE.get_service_names_and_types()):
        if not rclpy.ok() or (end is not None and time.monotonic() > end):
            raise RuntimeError(f"service {name} is not available")
        time.sleep(0.05)
''',
    "wait_for_message": '''def wait_for_message(topic, kind, timeout=None):
    """Return the next message of a topic."""
    messages = queue.Queue()
    subscription = NODE.create_subscription(kind, topic, messages.put, 1)
    try:
        return messages.get(timeout=timeout)
    finally:
        NODE.destroy_subscription(subscription)
''',
}
"""Functions that a draft contains if it needs them."""
