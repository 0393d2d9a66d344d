"""`mux_add`, `mux_delete`, `mux_list`, `mux_select` and `switch_mux` (deprecated): call a mux's services."""

from __future__ import annotations

from typing import Any

import rospy
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.msg import load_service_class
from pipros_libraries.topic_tools.selection import NONE
from topic_tools.nodes.output import base_name, check_names


def _call(name: str, kind: str, doing: str, *topic: str) -> Any:
    """Wait indefinitely for a mux service, and call it. Print progress and errors.

    Return the response, or None if the call fails.
    """
    print(f'Waiting for service "{name}"', flush=True)
    rospy.wait_for_service(name)
    print(doing, flush=True)
    try:
        return rospy.ServiceProxy(name, load_service_class(f"topic_tools/Mux{kind}"))(*topic)
    except rospy.ServiceException as error:
        print(f"Service call failed: {error}")
        return None


@exits_after_ctrl_c(130)
def _with_topic(program: str, kind: str, doing: str) -> int:
    arguments = rospy.myargv()[1:]
    if len(arguments) != 2:
        print(f"USAGE: {program} MUX_NAME TOPIC")
        return 1
    mux, topic = arguments
    check_names("service", mux)
    if topic != NONE:
        check_names("topic", topic)
    _call(f"{mux}/{kind.lower()}", kind, doing.format(mux=mux, topic=topic), topic)
    return 0


def add() -> int:
    """Run `mux_add MUX_NAME TOPIC`. Return the exit code."""
    return _with_topic("mux_add", "Add", 'Adding "{topic}" to mux "{mux}"')


def delete() -> int:
    """Run `mux_delete MUX_NAME TOPIC`. Return the exit code."""
    return _with_topic("mux_delete", "Delete", 'Deleting "{topic}" from mux "{mux}"')


def select() -> int:
    """Run `mux_select MUX_NAME TOPIC`. Return the exit code."""
    return _with_topic("mux_select", "Select", 'Selecting "{topic}" at mux "{mux}"')


@exits_after_ctrl_c(130)
def list_topics() -> int:
    """Run `mux_list MUX_NAME`. Return the exit code."""
    arguments = rospy.myargv()[1:]
    if len(arguments) != 1:
        print("USAGE: mux_list MUX_NAME")
        return 1
    check_names("service", arguments[0])
    response = _call(f"{arguments[0]}/list", "List", f'Listing topics from mux "{arguments[0]}"')
    if response is not None:
        print(response.topics)
    return 0


@exits_after_ctrl_c(130)
def switch() -> int:
    """Run `switch_mux MUXED_TOPIC SELECT_TOPIC`. Return the exit code."""
    arguments = rospy.myargv()[1:]
    if len(arguments) < 2:
        print("usage: switch MUXED_TOPIC SELECT_TOPIC")
        return 1
    output, topic = arguments[:2]
    name = base_name(output) if topic == NONE else base_name(output, topic)
    rospy.init_node(f"{name}_switcher", anonymous=True)
    rospy.logwarn("topic_tools/switch_mux is deprecated; please use topic_tools/mux_select instead")
    name = f"{output}_select"
    rospy.loginfo("Waiting for service %s...\n", name)
    rospy.wait_for_service(name)
    try:
        before = rospy.ServiceProxy(name, load_service_class("topic_tools/MuxSelect"))(topic).prev_topic
    except rospy.ServiceException:
        rospy.logerr("failed to switch muxed topic %s to %s", output, topic)
        return 1
    rospy.loginfo("muxed topic %s successfully switched from %s to %s", output, before, topic)
    return 0
