"""Who hears of what the node registers, as `rospy.impl.registration` has it."""

from __future__ import annotations

import threading

from rospy.logs import logerr


class Registration:
    """The kinds of registrations."""

    PUB = "pub"
    SUB = "sub"
    SRV = "srv"


class RegistrationListener:
    """Hears of what the node registers. Derive from it."""

    def reg_added(self, resolved_name: str, data_type_or_uri: str, reg_type: str) -> None:
        """The node offers or wants a topic or service: its type, or for a service its URI."""

    def reg_removed(self, resolved_name: str, data_type_or_uri: str, reg_type: str) -> None:
        """It does no longer."""


class RegistrationListeners:
    """The listeners of a process.

    Attributes:
        listeners: those that were added.
    """

    def __init__(self) -> None:
        self.listeners: list[RegistrationListener] = []
        self.lock = threading.Lock()

    def add_listener(self, l: RegistrationListener) -> None:  # noqa: E741  # rospy's name for it
        """Has a listener hear of registrations from now on."""
        with self.lock:
            self.listeners.append(l)

    def notify_added(self, resolved_name: str, data_type: str, reg_type: str) -> None:
        """Tells the listeners that something was registered. One that fails does not stop the others."""
        for listener in list(self.listeners):
            try:
                listener.reg_added(resolved_name, data_type, reg_type)
            except Exception as error:
                logerr("error notifying listener of registration: %s", error)

    def notify_removed(self, resolved_name: str, data_type_or_uri: str, reg_type: str) -> None:
        """As `notify_added`, for what was taken back."""
        for listener in list(self.listeners):
            try:
                listener.reg_removed(resolved_name, data_type_or_uri, reg_type)
            except Exception as error:
                logerr("error notifying listener of unregistration: %s", error)

    def clear(self) -> None:
        """Forgets all listeners."""
        with self.lock:
            self.listeners.clear()
