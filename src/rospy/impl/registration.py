"""`rospy.impl.registration`: what the node has registered, and who listens to that."""

from __future__ import annotations

from typing import Any

from pipros.lazy_names import star_names as _star_names
from rospy.core import add_preshutdown_hook as add_preshutdown_hook
from rospy.core import is_shutdown as is_shutdown
from rospy.core import is_shutdown_requested as is_shutdown_requested
from rospy.core import logdebug as logdebug
from rospy.core import logerr as logerr
from rospy.core import logfatal as logfatal
from rospy.core import loginfo as loginfo
from rospy.core import logwarn as logwarn
from rospy.core import signal_shutdown as signal_shutdown
from rospy.core import xmlrpcapi as xmlrpcapi
from rospy.impl.transport import InternalOfRospy
from rospy.listeners import Registration as Registration
from rospy.listeners import RegistrationListener as RegistrationListener
from rospy.listeners import RegistrationListeners as RegistrationListeners
from rospy.managers import managers
from rospy.names import get_caller_id as get_caller_id
from rospy.names import get_namespace as get_namespace


class RegManager(InternalOfRospy, RegistrationListener):
    """Keeps genuine rospy's registrations at the master; here `pipros.node.registration` does."""


_listeners = RegistrationListeners()


def get_registration_listeners() -> RegistrationListeners:
    """The listeners of this process. They hear of what the node registers from now on."""
    managers.watch(_listeners.notify_added, _listeners.notify_removed)
    return _listeners


def get_topic_manager() -> Any:
    """The topics of the node; see `rospy.managers.TopicManager`."""
    return managers.topics


def set_topic_manager(tm: Any) -> None:
    """Has `get_topic_manager` answer that from now on. What publishes and subscribes stays as it is."""
    managers.topics = tm


def get_service_manager() -> Any:
    """The services of the node; see `rospy.managers.ServiceManager`."""
    return managers.services


def set_service_manager(sm: Any) -> None:
    """Has `get_service_manager` answer that from now on. What is served stays as it is."""
    managers.services = sm


def __getattr__(name: str) -> Any:
    """The managers under the names by which some packages reach for them."""
    if name == "_topic_manager":
        return managers.topics
    if name == "_service_manager":
        return managers.services
    if name == "_registration_listeners":
        return _listeners
    raise AttributeError(f"module 'rospy.impl.registration' has no attribute '{name}'")


_star_names(__name__, "errno logging socket sys threading time traceback xmlrpcclient=xmlrpc.client")
