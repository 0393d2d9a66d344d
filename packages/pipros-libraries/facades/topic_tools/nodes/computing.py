"""`rosrun topic_tools transform` and `relay_field`: publish values computed from a topic's messages."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

import rospy
import rostopic
from pipros.basics.errors import PiprosError
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.msg import load_message_class
from pipros.msg.from_yaml import fill_message_args
from pipros_libraries.topic_tools.expressions import Template, Transformation
from pipros_tools.graph.message_path import has_field, parse_path
from topic_tools.nodes.output import check_names


def _parser(program: str, description: str, expression: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(program, description=description)
    parser.add_argument("input", help="Input topic or topic field.")
    parser.add_argument("output_topic", help="Output topic.")
    parser.add_argument("output_type", help="Output topic type.")
    parser.add_argument("expression", help=expression)
    parser.add_argument("--wait-for-start", action="store_true", help="Wait for input messages.")
    parser.add_argument(
        "--tcpnodelay", dest="tcp_nodelay", action="store_true", help="Request TCP_NODELAY from publishers."
    )
    return parser


def _output_class(options: argparse.Namespace) -> type[Any]:
    """Check the topics on the command line, and return the output's message class.

    Raises:
        SystemExit: a name is invalid, or the type is unknown. The check does not require a master.
    """
    field = options.input.partition("[")[0]
    check_names("topic", field, options.output_topic)
    try:
        return load_message_class(options.output_type)
    except PiprosError as error:
        raise SystemExit(f"ERROR: {error}") from None


def _has(message_class: type[Any], part: str) -> bool:
    try:
        return has_field(message_class, parse_path(part))
    except PiprosError:
        return False


def _run(
    options: argparse.Namespace,
    topic: str,
    output_class: type[Any],
    latch: bool,
    compute: Callable[[Any], list[Any]],
) -> int:
    """Publish the result of `compute` for each message or field until shutdown. Return the exit code."""
    try:
        input_class, input_topic, part = rostopic.get_topic_class(topic, blocking=options.wait_for_start)
    except rostopic.ROSTopicException as error:
        raise SystemExit(f"ERROR: {error}") from None
    if input_class is None or input_topic is None or not _has(input_class, topic[len(input_topic) :]):
        raise SystemExit(f"ERROR: Wrong input topic (or topic field): {topic}")
    publisher = rospy.Publisher(options.output_topic, output_class, queue_size=1, latch=latch)

    def on_message(message: Any) -> None:
        try:
            publisher.publish(*compute(part(message) if part else message))
        except (PiprosError, rospy.ROSException, TypeError, AttributeError, ValueError) as error:
            rospy.logerr_throttle_identical(60, str(error))

    rospy.Subscriber(input_topic, input_class, on_message, tcp_nodelay=options.tcp_nodelay)
    rospy.spin()
    return 0


@exits_after_ctrl_c()
def transform() -> int:
    """Run `transform`. Return the exit code."""
    parser = _parser(
        "transform",
        "For each message 'm' on a topic, or one of its fields, publish the value of an expression: "
        "transform /imu/orientation/x /degrees std_msgs/Float64 'numpy.rad2deg(m)'",
        "Python expression in the input message 'm', limited to arithmetic and reading messages.",
    )
    parser.add_argument(
        "-i",
        "--import",
        dest="modules",
        nargs="+",
        default=["numpy"],
        help="List of Python modules to import.",
    )
    parser.add_argument("--latch", action="store_true", help="Set publisher to latched.")
    options = parser.parse_args(rospy.myargv()[1:])
    try:
        made = Transformation(options.expression, options.modules, rospy.get_rostime)
    except PiprosError as error:
        raise SystemExit(f"ERROR: {error}") from None
    output_class = _output_class(options)
    rospy.init_node("transform", anonymous=True)
    if options.modules != parser.get_default("modules"):
        for module, reason in made.missing.items():
            rospy.logwarn("Failed to import module: %s (%s)", module, reason)
    topic = options.input if options.input.startswith("/") else rospy.get_namespace() + options.input
    return _run(options, topic, output_class, options.latch, lambda message: list(made.arguments(message)))


@exits_after_ctrl_c()
def relay_field() -> int:
    """Run `relay_field`. Return the exit code."""
    parser = _parser(
        "relay_field",
        "Publish messages whose fields are computed from messages on another topic: "
        "relay_field /chatter /header std_msgs/Header '{seq: 0, stamp: now, frame_id: m.data}'",
        "Fields as YAML; strings may be Python expressions in the input message 'm'.",
    )
    options = parser.parse_args(rospy.myargv()[1:])
    try:
        template = Template(options.expression)
    except PiprosError as error:
        raise SystemExit(f"ERROR: {error}") from None
    output_class = _output_class(options)
    rospy.init_node("relay_field", anonymous=True)
    header: Any = load_message_class("std_msgs/Header")

    def compute(message: Any) -> list[Any]:
        now = rospy.get_rostime()
        made = output_class()
        fill_message_args(made, [template.fields(message)], {"now": now, "auto": header(stamp=now)})
        return [made]

    return _run(options, options.input, output_class, False, compute)
