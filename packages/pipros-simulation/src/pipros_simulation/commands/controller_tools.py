"""The programs of controller_manager: `spawner` and `controller_manager`."""

from __future__ import annotations

import sys
import threading
import time
from argparse import ArgumentParser
from collections.abc import Callable, Sequence
from typing import Any

from pipros.basics import names
from pipros.basics.errors import PiprosError
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.msg import load_message_class, load_service_class
from pipros.node import Node
from pipros.node.roscpp_program import roscpp_program

CALL_S = 30.0
"""Time within which a controller manager must answer."""
STRICT = 2


class ManagerClient:
    """Calls the services of a controller manager."""

    def __init__(self, node: Node, namespace: str = "") -> None:
        self._node = node
        self._prefix = names.join(namespace, "controller_manager/") if namespace else "controller_manager/"

    def call(self, service: str, kind: str, timeout_s: float = CALL_S, **fields: Any) -> Any:
        """Call a service, and wait for it up to `timeout_s`.

        Raises:
            PiprosError: the call failed.
        """
        service_class: Any = load_service_class(f"controller_manager_msgs/{kind}")
        client = self._node.client(f"{self._prefix}{service}", service_class)
        return client.call(service_class._request_class(**fields), timeout_s)

    def wait(self, timeout_s: float | None) -> bool:
        """Wait until the manager offers all services. Return False after `timeout_s`, or at shutdown."""
        end_s = None if timeout_s is None else time.monotonic() + timeout_s
        service_class: Any = load_service_class("controller_manager_msgs/ListControllers")
        while not self._node.is_ending and (end_s is None or time.monotonic() < end_s):
            try:
                for service in ("load", "unload", "switch"):
                    name = f"{self._prefix}{service}_controller"
                    self._node.client(name, service_class).probe(1.0)  # which ignores the class
                self.call("list_controllers", "ListControllers", 1.0)
                return True
            except PiprosError:
                self._node.wait_for_shutdown(0.2)
        return False

    def load(self, name: str) -> bool:
        return bool(self.call("load_controller", "LoadController", name=name).ok)

    def unload(self, name: str) -> bool:
        return bool(self.call("unload_controller", "UnloadController", name=name).ok)

    def switch(self, start: Sequence[str] = (), stop: Sequence[str] = (), timeout_s: float = CALL_S) -> bool:
        """Start and stop controllers: all of them or none."""
        return bool(
            self.call(
                "switch_controller",
                "SwitchController",
                timeout_s,
                start_controllers=list(start),
                stop_controllers=list(stop),
                strictness=STRICT,
            ).ok
        )


@exits_after_ctrl_c()
def spawner(argv: Sequence[str] | None = None) -> int:
    """Load and start controllers; stop and unload them at the end. Return 1 if there is no manager."""
    parser = ArgumentParser(prog="spawner", description="Loads and starts controllers until it ends.")
    parser.add_argument("--stopped", action="store_true", help="load the controllers, but do not start them")
    parser.add_argument(
        "--wait-for", metavar="TOPIC", help="start and stop them by a std_msgs/Bool on a topic"
    )
    parser.add_argument("--namespace", default="", help="namespace of the controller manager")
    parser.add_argument("--timeout", type=float, default=30.0, help="seconds to wait for the manager")
    parser.add_argument("--no-timeout", action="store_true", help="wait for the manager without limit")
    parser.add_argument(
        "--shutdown-timeout", type=float, default=3.0, help="seconds for each call at the end"
    )
    parser.add_argument("controllers", nargs="+", metavar="CONTROLLER")
    arguments = sys.argv[1:] if argv is None else list(argv)
    given = parser.parse_args([word for word in arguments if ":=" not in word])
    with roscpp_program("spawner", "controller_manager", arguments) as (node, log):
        manager = ManagerClient(node, given.namespace)
        log.info("waiting for the controller manager")
        if not manager.wait(None if given.no_timeout else given.timeout):
            if not node.is_ending:
                log.error("no controller manager answered within %g s; is the robot started?", given.timeout)
            return 0 if node.is_ending else 1
        loaded = [name for name in given.controllers if _reported(log, "load", manager.load, name)]
        switch = _Switch(manager, loaded, log)
        if given.wait_for:
            boolean: Any = load_message_class("std_msgs/Bool")
            node.subscribe(given.wait_for, boolean, lambda message: switch(is_on=message.data))
        elif not given.stopped:
            switch(is_on=True)
        node.on_shutdown(lambda: _give_back(manager, loaded, switch, log, given.shutdown_timeout))
        node.wait_for_shutdown()
    return 0


class _Switch:
    """Starts and stops the loaded controllers together."""

    def __init__(self, manager: ManagerClient, loaded: Sequence[str], log: Any) -> None:
        self._manager, self._loaded, self._log = manager, loaded, log
        self._lock = threading.Lock()
        self._is_on = False

    def __call__(self, *, is_on: bool, timeout_s: float = CALL_S) -> None:
        with self._lock:
            if is_on is self._is_on or not self._loaded:
                return
            started, stopped = (self._loaded, ()) if is_on else ((), self._loaded)
            what = "start" if is_on else "stop"
            if _reported(
                self._log,
                what,
                lambda _: self._manager.switch(started, stopped, timeout_s),
                ", ".join(self._loaded),
            ):
                self._is_on = is_on


def _give_back(
    manager: ManagerClient, loaded: Sequence[str], switch: _Switch, log: Any, timeout_s: float
) -> None:
    switch(is_on=False, timeout_s=timeout_s)
    for name in reversed(loaded):
        try:
            manager.call("unload_controller", "UnloadController", timeout_s, name=name)
        except PiprosError as error:  # the manager has ended, too
            log.debug("%s", error)
            return


def _reported(log: Any, what: str, do: Callable[[str], bool], name: str) -> bool:
    """Return what `do` returns for a controller, and log an error if it fails."""
    try:
        is_done = do(name)
    except PiprosError as error:
        log.error("cannot %s [%s]: %s", what, name, error)
        return False
    if is_done:
        log.info("%s %s: done", what, name)
    else:
        log.error("cannot %s [%s]; the manager's log says why", what, name)
    return is_done


def controller_manager(argv: Sequence[str] | None = None) -> int:
    """List controllers and types, or load, unload, start and stop controllers. Return 1 if that fails."""
    from pipros_tools.cli.command_node import command_node

    arguments = sys.argv[1:] if argv is None else list(argv)
    parser = ArgumentParser(prog="controller_manager", description="Inspects and changes controllers.")
    commands = ("list", "list-types", "load", "unload", "start", "stop", "spawn", "kill", "reload-libraries")
    parser.add_argument("command", choices=commands)
    parser.add_argument("controllers", nargs="*", metavar="CONTROLLER")
    given = parser.parse_args([word for word in arguments if ":=" not in word])
    try:
        with command_node("controller_manager", arguments, wall_time=True) as node:
            return _command(ManagerClient(node), given.command, given.controllers)
    except PiprosError as error:
        print(f"controller_manager: {error}", file=sys.stderr)
        return 1


def _command(manager: ManagerClient, word: str, controllers: Sequence[str]) -> int:
    if word == "list":
        for each in manager.call("list_controllers", "ListControllers").controller:
            interfaces = ", ".join(used.hardware_interface for used in each.claimed_resources)
            print(f"'{each.name}' - '{interfaces}' ( {each.state} )")
        return 0
    if word == "list-types":
        print("\n".join(manager.call("list_controller_types", "ListControllerTypes").types))
        return 0
    if word == "reload-libraries":
        return int(not manager.call("reload_controller_libraries", "ReloadControllerLibraries").ok)
    steps: dict[str, list[Callable[[str], bool]]] = {
        "load": [manager.load],
        "unload": [manager.unload],
        "start": [lambda name: manager.switch(start=[name])],
        "stop": [lambda name: manager.switch(stop=[name])],
        "spawn": [manager.load, lambda name: manager.switch(start=[name])],
        "kill": [lambda name: manager.switch(stop=[name]), manager.unload],
    }
    failed = [name for name in controllers if not all(step(name) for step in steps[word])]
    for name in failed:
        print(f"controller_manager: cannot {word} {name}; the manager's log says why", file=sys.stderr)
    return int(bool(failed))
