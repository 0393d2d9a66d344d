"""Hierarchical state machines for robots: states, containers, and states for actions, services and topics."""

from state_machines.containers import Concurrence, StateMachine
from state_machines.introspection import IntrospectionServer
from state_machines.ros_states import MonitorState, ServiceState, SimpleActionState
from state_machines.states import InvalidTransition, State, UserData

__all__ = [
    "Concurrence",
    "IntrospectionServer",
    "InvalidTransition",
    "MonitorState",
    "ServiceState",
    "SimpleActionState",
    "State",
    "StateMachine",
    "UserData",
]
