"""Messages of smach_msgs, made from their definitions by `pipros stubs`."""

from pipros.msg import base as _base
import std_msgs.msg

class SmachContainerInitialStatusCmd(_base.Message):
    """Sets where a container of a state machine starts. Subscribed by a SMACH introspection server."""
    path: str
    """path of the container, such as /SM_ROOT/SUB"""
    initial_states: list[str]
    """labels of the states that are active first"""
    local_data: str
    """user data of the container, pickled by Python"""
    def __init__(self, path: str | None = ..., initial_states: list[str] | None = ..., local_data: str | None = ...) -> None: ...

class SmachContainerStatus(_base.Message):
    """The active states of a container of a state machine, published when they change. Viewers highlight them."""
    header: std_msgs.msg.Header
    """stamp: when it was published"""
    path: str
    """path of the container, such as /SM_ROOT/SUB"""
    initial_states: list[str]
    """labels of the states that are active first"""
    active_states: list[str]
    """labels of the states that are active now"""
    local_data: str
    """user data of the container, pickled by Python"""
    info: str
    """why the status was published"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., path: str | None = ..., initial_states: list[str] | None = ..., active_states: list[str] | None = ..., local_data: str | None = ..., info: str | None = ...) -> None: ...

class SmachContainerStructure(_base.Message):
    """The states of a container of a state machine, and the transitions between them, as a graph for viewers."""
    header: std_msgs.msg.Header
    """stamp: when it was published"""
    path: str
    """path of the container, such as /SM_ROOT/SUB"""
    children: list[str]
    """labels of its states"""
    internal_outcomes: list[str]
    """The transitions, with the same index in the three lists: the outcome of a state, and where it leads.
    outcomes"""
    outcomes_from: list[str]
    """labels of the states with these outcomes"""
    outcomes_to: list[str]
    """labels of the next states, or outcomes of the container"""
    container_outcomes: list[str]
    """outcomes of the container itself"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., path: str | None = ..., children: list[str] | None = ..., internal_outcomes: list[str] | None = ..., outcomes_from: list[str] | None = ..., outcomes_to: list[str] | None = ..., container_outcomes: list[str] | None = ...) -> None: ...
