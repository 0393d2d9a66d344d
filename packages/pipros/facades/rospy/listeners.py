"""Listeners for the node's registrations, as in `rospy.impl.registration`."""

from __future__ import annotations

import threading

from rospy.logs import logerr


class Registration:
    """Kinds of registration."""

    PUB = "pub"
    SUB = "sub"
    SRV = "srv"


class RegistrationListener:
    """Base class of objects that are notified of the node's registrations."""

    def reg_added(self, resolved_name: str, data_type_or_uri: str, reg_type: str) -> None:
        """Handle the registration of a topic with its type, or of a service with its URI."""

    def reg_removed(self, resolved_name: str, data_type_or_uri: str, reg_type: str) -> None:
        """Handle the removal of a registration."""


class RegistrationListeners:
    """The listeners of this process.

    Attributes:
        listeners: the listeners added so far.
    """

    def __init__(self) -> None:
        self.listeners: list[RegistrationListener] = []
        self.lock = threading.Lock()

    def add_listener(self, l: RegistrationListener) -> None:  # noqa: E741  # rospy's name for it
        """Add a listener, which is notified of all later registrations and removals."""
        with self.lock:
            self.listeners.append(l)

    def notify_added(self, resolved_name: str, data_type: str, reg_type: str) -> None:
        """Notify the listeners of a registration.

        If a listener raises, the error is logged and the others are still notified.
        """
        for listener in list(self.listeners):
            try:
                listener.reg_added(resolved_name, data_type, reg_type)
            except Exception as error:
                logerr("error notifying listener of registration: %s", error)

    def notify_removed(self, resolved_name: str, data_type_or_uri: str, reg_type: str) -> None:
        """Notify the listeners that a registration was removed. Errors are handled as in `notify_added`."""
        for listener in list(self.listeners):
            try:
                listener.reg_removed(resolved_name, data_type_or_uri, reg_type)
            except Exception as error:
                logerr("error notifying listener of unregistration: %s", error)

    def clear(self) -> None:
        """Remove all listeners."""
        with self.lock:
            self.listeners.clear()
