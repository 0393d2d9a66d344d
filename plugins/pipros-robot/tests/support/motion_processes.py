"""Real processes that command velocities, ended in each way: `python -m tests.support.motion_processes`.

A row shows when a base stood. Only programs without a terminal or a page are here; `test_velocity_ends` has
the terminal.
"""

from __future__ import annotations

import contextlib
import itertools
import math
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros.node import Node
from pipros_libraries.nodes.velocities import speeds
from tests.support.environments import make_tool_folder
from tests.support.moving_programs import PROGRAMS, SOURCE_S, SPEED, send_goal
from tests.support.ports import ClaimedPort
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

_STANDALONE: Final = ("nodelet", "nodelet", "standalone")
ARGUMENTS: Final = {
    "twist_mux": ("twist_mux", "twist_mux"),
    "yocs_cmd_vel_mux": (*_STANDALONE, "yocs_cmd_vel_mux/CmdVelMuxNodelet"),
    "yocs_velocity_smoother": (*_STANDALONE, "yocs_velocity_smoother/VelocitySmootherNodelet"),
    "kobuki_safety_controller": (*_STANDALONE, "kobuki_safety_controller/SafetyControllerNodelet"),
    "teleop_twist_joy": ("teleop_twist_joy", "teleop_node"),
    "interactive_marker_twist_server": ("interactive_marker_twist_server", "marker_server"),
    "mimic": ("turtlesim", "mimic"),
    "draw_square": ("turtlesim", "draw_square"),
    "move_base": ("move_base", "move_base"),
}  # fmt: skip
"""Arguments of rosrun."""
OUTPUTS: Final = {
    "twist_mux": "/cmd_vel_out", "yocs_cmd_vel_mux": "/tested/out", "mimic": "/output/cmd_vel",
    "yocs_velocity_smoother": "/tested/smooth_cmd_vel", "kobuki_safety_controller": "/tested/cmd_vel",
    "interactive_marker_twist_server": "/tested/cmd_vel", "draw_square": "/turtle1/cmd_vel",
}  # fmt: skip
"""Topics of velocities other than `/cmd_vel`."""


class Base:
    """A base on a topic of velocities.

    Attributes:
        sent: times and numbers of the velocities, as in a `Rig`.
    """

    def __init__(self, master_uri: str, topic: str) -> None:
        self.sent: list[tuple[float, tuple[float, ...]]] = []
        self._node = Node("base", environment=Environment(master_uri=master_uri))
        self._node.start()
        self._node.subscribe(topic, load_message_class("geometry_msgs/Twist"), self._take, queue_size=100)

    def _take(self, message: Any) -> None:
        self.sent.append((time.monotonic(), tuple(speeds(message))))

    def greatest(self, count: int = 1) -> float:
        """Return the greatest number of the last velocities; infinity if there are not as many."""
        last = self.sent[-count:]
        return max((abs(each) for _, values in last for each in values), default=0.0 if last else math.inf)

    def close(self) -> None:
        self._node.shutdown()


class Sources:
    """What drives a program, in the real time of a thread. It stands in for a `Rig` in `PROGRAMS`."""

    def __init__(self, master_uri: str, base: Base) -> None:
        self.sent = base.sent
        self.world: Any = None
        self.subscribed: Any = None
        self.shown = self.pressed = None
        self._node = Node("sources", environment=Environment(master_uri=master_uri))
        self._node.start()
        self._publishers: dict[str, Any] = {}
        self._work: list[list[Any]] = []
        self._has_ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    @property
    def now_s(self) -> float:
        return time.monotonic()

    def give(self, topic: str, message: Any) -> None:
        """Publish a message."""
        if topic not in self._publishers:
            self._publishers[topic] = self._node.advertise(topic, type(message), queue_size=10)
        self._publishers[topic].publish(message)

    def at(self, when_s: float, do: Callable[[], object]) -> None:
        """Do something repeatedly, because the program may not be connected yet."""
        self.every(1.0, do)

    def every(self, period_s: float, do: Callable[[], object], begin_s: float = 0.0) -> None:
        self._work.append([begin_s, period_s, do])

    def start(self) -> None:
        self._thread.start()

    def _run(self) -> None:
        while not self._has_ended.wait(0.01):
            for work in list(self._work):
                if self.now_s >= work[0]:
                    work[0] = self.now_s + work[1]
                    with contextlib.suppress(PiprosError):  # the master may be gone
                        work[2]()

    def be_silent(self) -> None:
        """Give nothing any more."""
        self._work.clear()

    def close(self) -> None:
        self._has_ended.set()
        if self._thread.is_alive():
            self._thread.join()
        self._node.shutdown()


class Running:
    """A program of `PROGRAMS` as a process, its sources and its base."""

    def __init__(self, ros: RosSystem, name: str, **parameters: Any) -> None:
        self.program = PROGRAMS[name]
        self.base = Base(ros.master_uri, OUTPUTS.get(name, "/cmd_vel"))
        made: Any = Sources(ros.master_uri, self.base)
        self.sources = made
        with Node("setter", environment=Environment(master_uri=ros.master_uri)) as node:
            for key, value in {**self.program.parameters, **parameters}.items():
                node.params.set(f"/tested/{key}", value)
        self.program.setup(self.sources)
        self.process: Process = ros.pipros.start("rosrun", *ARGUMENTS[name], "__name:=tested")
        goals = itertools.cycle((2.4, 2.5))
        if name == "move_base":
            self.sources.every(1.0, lambda: send_goal(self.sources, next(goals)))
        else:
            self.sources.every(SOURCE_S, lambda: self.program.drive(self.sources, SPEED))
        self.sources.start()

    def drives(self) -> None:
        """Wait until the base moves."""
        wait_until(
            lambda: len(self.base.sent) > 5 and self.base.greatest() > 0, what=lambda: self.process.output
        )

    def stops(self) -> None:
        """Wait until the base stands."""
        wait_until(lambda: self.base.greatest() == 0, 10, lambda: str(self.base.sent[-3:]))

    def close(self) -> None:
        self.sources.close()
        self.process.end()
        self.base.close()

    def __enter__(self) -> Running:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


ENDS: Final = (
    "SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGUSR1", "SIGTSTP", "source ends", "source is silent",
    "master is gone",
)  # fmt: skip


def happens(each: str, running: Running, master: Process) -> str:
    """Let an end happen to a driving base. Return what the base has done then."""
    count, began_s = len(running.base.sent), time.monotonic()
    if each == "master is gone":
        master.kill()
        wait_until(lambda: len(running.base.sent) > count + 20)
        assert running.base.greatest(5) > 0, "stands"
        return "drives on"
    if each.startswith("SIG"):
        running.process.send_signal(getattr(signal, each))
    else:
        running.sources.close() if each == "source ends" else running.sources.be_silent()
    running.stops()
    return f"stands after {running.base.sent[-1][0] - began_s:5.2f} s"


def applies(name: str, each: str) -> bool:
    """Goals and pressed bumpers do not repeat; a turtle is only silent with its simulator."""
    own = {"source is silent"} if name in ("kobuki_safety_controller", "draw_square") else set()
    return each not in (own if name != "move_base" else {"source ends", "source is silent"})


def main() -> int:
    """Print the table, and return 1 if a base drives on."""
    failed = 0
    for number in (signal.SIGHUP, signal.SIGQUIT):  # children of nohup, and of a shell's `&`, ignore them
        signal.signal(number, signal.SIG_DFL)
    for name, each in itertools.product(ARGUMENTS, ENDS):
        if not applies(name, each):
            continue
        port = ClaimedPort()
        with tempfile.TemporaryDirectory() as folder:
            home = Path(folder)
            ros = RosSystem(port.number, home, make_tool_folder(home / "bin"))
            try:
                master = ros.pipros.start_bare_master()
                with Running(ros, name) as running:
                    running.drives()
                    text = happens(each, running, master)
            except AssertionError as error:
                failed, text = failed + 1, f"wrong: {error}"
            finally:
                ros.close()
                port.release()
        print(f"{name:32} {each:18} {text}", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
