"""Handlers for SIGINT and SIGTERM, shared by all nodes that a process starts one after another."""

from __future__ import annotations

from collections.abc import Callable

from pipros.node import Node
from pipros.node.signals import NotInMainThread, Signals
from rospy.exceptions import ROSInitException


class SignalHandlers:
    """The process's signal handlers, which stay installed for later nodes.

    Attributes:
        are_installed: whether the handlers are installed.
    """

    def __init__(self, end: Callable[[str], object]) -> None:
        """Set up the handlers. `end` is called with the reason when a signal arrives."""
        self._end = end
        self.forget()

    def forget(self) -> None:
        """Reset to the state before the first node. Called in a forked child, which needs new handlers."""
        self._signals = Signals(self._end, dies_of_hang_up=True)
        self._have_listened = self.are_installed = False

    def install(self) -> None:
        """Install the handlers unless already installed. Signals are held back until `listen` is called.

        Raises:
            ROSInitException: called outside the main thread.
        """
        if self.are_installed:
            return
        try:
            self._signals.install()
        except NotInMainThread:
            raise ROSInitException(
                "init_node() must be called in the main thread, or with disable_signals=True: "
                "only the main thread can handle signals"
            ) from None
        self.are_installed = True

    def start(self, node: Node) -> None:
        """Install the handlers and start the node. Signals are held back until `listen` is called."""
        was_installed = self.are_installed
        self.install()
        try:
            node.start()
        except BaseException:
            if not was_installed:
                self.are_installed = False
                self._signals.uninstall()
            raise

    def listen(self, node: Node) -> None:
        """Make signals shut the node down."""
        listen = self._signals.listen_anew if self._have_listened else self._signals.listen
        self._have_listened = True
        listen(node)
