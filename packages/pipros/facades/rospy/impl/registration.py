"""`rospy.impl.registration`: the node's registrations, and their listeners."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pipros.basics.lazy_names import star_names as _star_names
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
    """Genuine rospy's class that keeps registrations with the master up to date.

    In pipros, `pipros.node.registration` does this.
    """


_listeners = RegistrationListeners()


def get_registration_listeners() -> RegistrationListeners:
    """Return this process's listeners, which are notified of all later registrations."""
    managers.watch(_listeners.notify_added, _listeners.notify_removed)
    return _listeners


def get_topic_manager() -> Any:
    """Return the node's topics; see `rospy.managers.TopicManager`."""
    return managers.topics


def set_topic_manager(tm: Any) -> None:
    """Set the result of `get_topic_manager`. Publishers and subscribers are not affected."""
    managers.topics = tm


def get_service_manager() -> Any:
    """Return the node's services; see `rospy.managers.ServiceManager`."""
    return managers.services


def set_service_manager(sm: Any) -> None:
    """Set the result of `get_service_manager`. Services are not affected."""
    managers.services = sm


def _variable(name: str) -> Any:
    """Return a manager or the listeners, by the private name that some packages use."""
    if name == "_topic_manager":
        return managers.topics
    if name == "_service_manager":
        return managers.services
    if name == "_registration_listeners":
        return _listeners
    raise AttributeError(f"module 'rospy.impl.registration' has no attribute '{name}'")


if not TYPE_CHECKING:  # with __getattr__, type checkers would accept any name
    __getattr__ = _variable


_star_names(__name__, "errno logging socket sys threading time traceback xmlrpcclient=xmlrpc.client")
