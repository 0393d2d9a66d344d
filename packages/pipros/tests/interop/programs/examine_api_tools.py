"""Call functions of the tools' modules with valid and invalid arguments; see `examine_api_nodes.py`."""

import contextlib
import io
import os
import sys
import warnings

import rospkg
from examination import begin, examine

warnings.simplefilter("ignore")


def printed(function):
    """Return the result and the output of a function."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
        result = function()
    return result, out.getvalue()


class Loader:
    def construct_scalar(self, node):
        return node.value


class Node:
    def __init__(self, value):
        self.value = value


def examine_rosmsg():
    from geometry_msgs.msg import Polygon, PoseStamped
    from std_msgs.msg import String

    import rosmsg

    begin("rosmsg")
    for kind in ("int32[]", "string[3]", "int32", "bool[]", "uint8[]", "float64[]", "none/X[]"):
        examine(kind, lambda: rosmsg.get_array_type_instance(kind))
    for kind, package in (
        ("std_msgs/String[]", None), ("String[]", "std_msgs"), ("Header[]", None), ("time[]", None),
    ):  # fmt: skip
        examine(kind, lambda: str(rosmsg.get_array_type_instance(kind, package)))
    # Fields are in the order of the definition in pipros, alphabetical in genuine ROS.
    examine("yaml", lambda: sorted(rosmsg.get_yaml_for_msg(PoseStamped()).splitlines()))
    examine("yaml", lambda: rosmsg.get_yaml_for_msg(String("x"), "  "))
    examine("yaml", lambda: rosmsg.get_yaml_for_msg(Polygon(), fill_arrays_=True))
    examine("yaml", lambda: rosmsg.get_yaml_for_msg(Polygon(), flow_style_=True))
    examine("filter", lambda: list(rosmsg.create_names_filter(["header"])(PoseStamped())))
    examine("mode", lambda: rosmsg.list_types("std_srvs", "nonsense"))
    package = rospkg.RosPack().get_path("std_srvs")
    for folder, extension in (("srv", ".srv"), ("srv", ".msg"), ("none", ".msg")):
        path = os.path.join(package, folder)
        examine(f"types {folder}", lambda: rosmsg._list_types(path, folder, extension))


PROTOTYPES = (
    "msg std_msgs/String", "msg String", "msg -H geometry_msgs/PoseStamped", "msg -p .. geometry_msgs/Pose",
    "msg -f 1 geometry_msgs/Pose", "msg -f 0 geometry_msgs/Pose", "msg -x header geometry_msgs/PoseStamped",
    "msg -e sensor_msgs/JointState", "msg sensor_msgs/JointState", "msg std_msgs/Empty",
    "srv std_srvs/SetBool", "srv SetBool", "srv Empty", "msg", "-s msg", "nonsense std_msgs/String",
    "msg -s Nope", "msg Nope", "srv Nope", "msg nowhere_msgs/Nope", "msg -s nowhere_msgs/Nope", "msg a/b/c",
    "msg std_msgs::String", "msg -s std_msgs::String", "msg std_msgs.String",
)  # fmt: skip


def examine_prototypes():
    """Must be called last, because genuine ROS then replaces PyYAML's loaders by some that fail."""
    import rosmsg

    begin("prototypes")
    sys.argv = ["rosmsg-proto"]  # the name in its errors
    for line in PROTOTYPES:
        examine(line, lambda: exits(lambda: rosmsg.rosmsg_cmd_prototype(line.split())))


def exits(function):
    """Return the result and the output of a function that may end the process, and the exit code."""
    out, errors = io.StringIO(), io.StringIO()
    result, code = None, None
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(errors):
        try:
            result = function()
        except SystemExit as error:
            code = error.code
    lines = [line for line in errors.getvalue().splitlines() if "rosdep view is empty" not in line]
    return result, out.getvalue(), lines, code


def examine_rostopic():
    from geometry_msgs.msg import Point32, Polygon, PoseStamped
    from std_msgs.msg import String

    import rostopic
    from genpy import Time

    begin("rostopic")
    pose = PoseStamped()
    pose.header.frame_id = "map"
    pose.pose.position.x = 1.5
    shape = Polygon([Point32(1, 2, 3)] * 2)
    arguments = {"topic": "/t", "type_information": "geometry_msgs/PoseStamped"}
    field_filter = rostopic.create_field_filter(True, False)
    for more in (
        {}, {"plot": True}, {"count": 1, "echo_all_topics": True}, {"fixed_numeric_width": 8},
        {"field_filter_fn": field_filter}, {"plot": True}, {"plot": True, "field_filter_fn": field_filter},
        {"plot": True, "field_filter_fn": rostopic.create_field_filter(True, True)},
        {"value_transform_fn": rostopic.create_value_transform(True, True)},
        {"filter_fn": lambda message: False}, {"echo_clear": True},
        {"msg_eval": rostopic.msgevalgen("/pose/position")},
    ):  # fmt: skip
        options = {"msg_eval": None, **more}
        echo = rostopic.CallbackEcho("/t", **options)
        for _ in range(2):
            examine(f"echo {sorted(more)}", lambda: printed(lambda: echo.callback(pose, arguments)))
        received = Time(7, 9)
        examine("received", lambda: printed(lambda: echo.callback(pose, arguments, current_time=received)))
        examine("state", lambda: (echo.done, echo.count, echo.prefix, echo.suffix, echo.max_count))
    other = {"topic": "/other", "type_information": "std_msgs/String"}
    examine("other", lambda: printed(lambda: rostopic.CallbackEcho("/t", None).callback(String("x"), other)))
    for value in (String("x"), 5, [1, 2], "text"):
        examine("text", lambda: rostopic.CallbackEcho("/t", None).custom_strify_message(value))
    for no_texts, no_arrays in ((True, False), (False, True), (True, True)):
        fields = rostopic.create_field_filter(no_texts, no_arrays)
        examine("fields", lambda: (list(fields(pose)), list(fields(shape)), list(fields(String()))))
        change = rostopic.create_value_transform(no_texts, no_arrays)
        examine("sizes", lambda: str(change(pose, "geometry_msgs/PoseStamped")))
        examine("sizes", lambda: str(change(shape, "geometry_msgs/Polygon")))
    for path in ("", "/", "/a[x]", "/data", "/data[0]", "/none"):
        found = printed(lambda: rostopic.msgevalgen(path))[0]
        examine(f"path {path}", lambda: found is None or printed(lambda: found(String("xyz"))))
    examine("file", lambda: rostopic.file_yaml_arg("/nowhere"))
    examine_measures(rostopic)


def examine_measures(rostopic):
    import rospy

    rospy.rostime.set_rostime_initialized(True)
    rate = rostopic.ROSTopicHz(5)
    for topic in (None, "/t"):
        examine("empty", lambda: (rate.get_hz(topic), rate.get_times(topic), rate.get_msg_t0(topic)))
        for second in (1, 2, 4, 5, 6, 7, 9):
            rospy.rostime._set_rostime(rospy.Time(second))
            rate.callback_hz(None, topic) if topic else rate.callback_hz(None)
            examine("hz", lambda: (rate.get_hz(topic), rate.get_times(topic), rate.get_msg_tn(topic)))
        examine("again", lambda: rate.get_hz(topic))
    examine("print", lambda: printed(lambda: rate.print_hz(["/t"])))


def examine_the_rest():
    import rosgraph
    import rosnode
    import rosparam
    import rosservice

    begin("the rest")
    for text in ("rad(pi/2)", "rad(2*pi)", "pi/2", "90"):
        examine(text, lambda: rosparam.construct_angle_radians(Loader(), Node(text)))
    for text in ("deg(90)", "90", "x"):
        examine(text, lambda: rosparam.construct_angle_degrees(Loader(), Node(text)))
    for text in ("rad(1)", "deg(1)", "1"):
        examine(text, lambda: bool(rosparam.pattern.match(text)))
    examine("names", lambda: (rosparam.NAME, rosparam.NS, rosparam.GLOBALNS, rosnode.ID, rosnode.NAME))
    line = "tcp connection on port 1 to [/a on socket 5]"
    examine("pattern", lambda: rosnode.CONNECTION_PATTERN.match(line).groups())
    for uri in ("rosrpc://127.0.0.1:1", "http://q", "rosrpc://127.0.0.1"):
        examine(uri, lambda: rosservice.get_service_headers("/x", uri))
    for function in (
        lambda: rosparam.get_param("/x"), lambda: rosparam.delete_param("/x"),
        lambda: rosparam.list_params("/"), lambda: rosparam.load_file("/nowhere"),
        lambda: rosparam.upload_params("/", 5), lambda: rosservice.get_service_list(),
        lambda: rosservice.get_service_type("/x"), lambda: rosservice.has_service_args("/x"),
        lambda: rosnode.get_node_names(), lambda: rosnode.rosnode_ping("/x", 1),
        lambda: rosnode.lookup_uri(None, [[], [], []], "/t", "http://x:1"),
        lambda: rosparam.load_str("a: 1", "file"), lambda: rosparam.load_str("[1]", "file"),
    ):  # fmt: skip
        examine("call", lambda: printed(function)[0])
    del rosgraph
    for module, main in ((rosparam, "yamlmain"), (rosnode, "rosnodemain"), (rosservice, "rosservicemain")):
        for arguments in (["tool", "list"], ["tool", "nonsense"]):

            def ended():
                try:
                    return getattr(module, main)(arguments)
                except SystemExit as error:
                    return (
                        f"exit {error.code}" if error.code else None
                    )  # after the usage, 0 in pipros and None in genuine ROS

            examine(f"{main} {arguments[1]}", lambda: printed(ended)[0])


examine_rosmsg()
examine_rostopic()
examine_the_rest()
examine_prototypes()
