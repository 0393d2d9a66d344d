"""Start the node, as `init_node` does."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Sequence
from types import TracebackType
from typing import Any

from pipros.basics import names
from pipros.basics.errors import Interrupted
from pipros.node import Node
from pipros.node.logger_services import serve_loggers
from pipros.node.missing_master import NoMaster
from pipros.node.start_params import check_remappings, is_on, set_private_params, window_limits
from rospy.exceptions import ROSException, ROSInitException, ROSInterruptException
from rospy.session import Session


class InitInterrupted(ROSInitException, ROSInterruptException):
    """Shutdown was requested while `init_node` was waiting for the master."""


def start_node(
    session: Session,
    name: str,
    argv: Sequence[str] | None,
    *,
    anonymous: bool,
    log_level: int | None,
    disable_rostime: bool,
    disable_rosout: bool,
    disable_signals: bool,
    rpc_port: int,
    tcpros_port: int,
) -> None:
    """Start the node; see `rospy.init_node`."""
    argv = sys.argv if argv is None else argv
    arguments = (name, list(argv), anonymous, log_level, disable_rostime, disable_signals)
    if not name:
        raise ValueError("name must not be empty")
    if "/" in name:
        raise ValueError("namespaces are not allowed in node names")
    if not _claim(session, arguments):
        return
    try:
        _end_previous(session)
        _start(session, arguments, disable_rosout, rpc_port, tcpros_port)
    except BaseException:
        if session.node is None:
            session.init_arguments = None
        raise


def _claim(session: Session, arguments: tuple[Any, ...]) -> bool:
    """Return True if the caller must start a node, or False if one was started with the same arguments.

    Raises:
        ROSException: a node was started with different arguments, and the program is not in a notebook.
    """
    with session.lock:
        if session.init_arguments is None:
            session.init_arguments = arguments
            return True
        if session.init_arguments == arguments and not (_is_in_notebook() and session.is_shutdown):
            return False
        if _is_in_notebook():
            session.init_arguments = arguments
            return True
        raise ROSException(
            f"rospy.init_node() has already been called with different arguments: {session.init_arguments}"
        )


def _is_in_notebook() -> bool:
    """Return whether the program runs in IPython, for example in a notebook."""
    shell: Any = sys.modules.get("IPython")
    return shell is not None and shell.get_ipython() is not None


def _end_previous(session: Session) -> None:
    """Shut down the previous node if it is still running.

    A program can start another node after it has set `rospy.client._init_node_args` to None. A notebook can
    also start a node with different arguments, or after a shutdown.

    Raises:
        ROSInitException: the previous node was shut down, and the program is not in a notebook.
    """
    if _is_in_notebook():
        session.set_shutdown(False)
    if session.is_shutdown:
        raise ROSInitException(
            "init_node interrupted before it could complete: rospy has been shut down "
            "(to call init_node again, set rospy.core._shutdown_flag = False)"
        )
    if session.node is not None:
        session.forget_node()


def _take_arguments(session: Session, node: Node) -> None:
    try:
        check_remappings(node)
        set_private_params(node)
    except ValueError as error:
        session.forget_node()
        raise ROSInitException(f"invalid command-line parameters: {error}") from None


def _start(
    session: Session, arguments: tuple[Any, ...], disable_rosout: bool, rpc_port: int, tcpros_port: int
) -> None:
    name, argv, anonymous, log_level, disable_rostime, disable_signals = arguments
    if not names.is_legal_base(name):
        warnings.warn(
            f"'{name}' is not a legal ROS base name. This may cause problems with other ROS tools.",
            stacklevel=4,
        )
    node = Node(
        name,
        anonymous=anonymous,
        argv=argv,
        log=session.logger,
        on_shutdown_request=session.end_by_request,
        rpc_port=rpc_port,
        tcpros_port=tcpros_port,
    )
    node.calls.add(session.calls)
    node.on_shutdown(lambda: session.hooks.call_first(session.end_reason))
    session.process_id = os.getpid()
    session.logs.open(node, log_level)
    handles_signals = session.signals.are_installed or not disable_signals
    if handles_signals:
        session.signals.start(node)
    else:
        node.start()
    session.node = node
    if handles_signals:
        session.signals.listen(node)
    try:
        node.wait_for_master(lambda _: _warn_no_master(node))
        _take_arguments(session, node)
        _open_logs_and_time(session, node, disable_rosout, disable_rostime)
    except Interrupted:
        _end_without_traceback()
        raise InitInterrupted("init_node interrupted before it could complete") from None
    except NoMaster as error:
        session.forget_node()
        raise ROSInitException(str(error)) from None
    session.logger.debug("init_node, name[%s], pid[%s]", node.name, os.getpid())
    session.run_deferred(node)


def _end_without_traceback() -> None:
    """Suppress the traceback of an uncaught InitInterrupted, because the user requested the shutdown."""
    report = sys.excepthook

    def report_others(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        if not isinstance(error, InitInterrupted):
            report(kind, error, trace)

    sys.excepthook = report_others


def _open_logs_and_time(session: Session, node: Node, disable_rosout: bool, disable_rostime: bool) -> None:
    if not disable_rosout:
        session.logs.open_rosout(node)
    if not disable_rostime:
        session.follow_simulated_time()
    if is_on(node, "/enable_statistics"):
        node.enable_statistics(window_limits(node))
    session.has_time = True
    session.logs.create_internal_loggers()
    serve_loggers(node)


def _warn_no_master(node: Node) -> None:
    uri = node.environment.master_uri
    print(
        f"Unable to register with master node [{uri}]: master may not be running yet. Will keep trying.",
        flush=True,
    )
