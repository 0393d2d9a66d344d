"""Every program that commands velocities, taken through every fault, and through the edges of its parameters.

`test_velocities_after_faults` has all but the parameters of move_base, which take an hour:
`python -m tests.support.motion_table` prints what is wrong with them. After the end, the last velocity must
be zero.
"""

import contextlib
import io
import itertools
import math
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final

import pytest

from pipros.master.master import Master
from pipros.msg import load_message_class, load_service_class
from pipros_libraries.nodes.params import InvalidParameter
from pipros_robot.navigation.navfn.navfn_node import NavfnPlanner
from tests.support.motion import STEP_S, Rig
from tests.support.moving_programs import PROGRAMS, SOURCE_S, SPEED, Program, send_goal
from tests.support.unlinked_node import odometry

FAULT_S, END_S = 1.6, 3.6
MARGIN_S: Final = 0.1
"""What may be added to a period, or to the silence after which the base is stopped."""
STOPS, GOES_ON, NEVER = "stops", "goes on", "the base never moved"
EDGES: Final = (0.0, -1.0, 1e-9, 1e9, math.nan, math.inf)
"""Values of numeric parameters."""


class Run:
    """A program that is driven until a fault, and maybe afterwards.

    Attributes:
        speed: what its source sends; None if it sends nothing.
    """

    def __init__(self, program: Program, rig: Rig) -> None:
        self.program, self.rig = program, rig
        self.speed: float | None = SPEED
        rig.every(SOURCE_S, self.drive, 0.2)

    def drive(self) -> None:
        if self.speed is not None:
            self.program.drive(self.rig, self.speed)

    def send(self, speed: float | None) -> None:
        self.speed = speed

    def mask(self) -> None:
        assert self.program.mask is not None
        self.program.mask(self.rig)

    def abandon(self) -> None:
        self.speed, self.rig.is_abandoned = None, True

    def leave(self) -> None:
        """Let whatever drives the robot end."""
        self.abandon()
        if self.program.mask is not None:
            self.program.mask(self.rig)

    def jump(self, seconds: float) -> None:
        self.rig.jump_s += seconds

    def flood(self, hz: float) -> None:
        self.rig.every(1 / hz, self.drive, self.rig.now_s)

    # -- move_base ---------------------------------------------------------------

    def goals(self, hz: float) -> None:
        self.rig.every(1 / hz, lambda: send_goal(self.rig), self.rig.now_s)

    def lose(self, topic: str) -> None:
        self.rig.world.lost.add(topic)

    def lie(self, value: float) -> None:
        """Measure a velocity that no base has."""
        measured = odometry()
        measured.twist.twist.linear.x = measured.twist.twist.angular.z = value
        for topic in ("/odom", "/tested/odometry"):
            self.rig.every(STEP_S, partial(self.rig.give, topic, measured), self.rig.now_s)

    def reconfigure(self, name: str, value: float) -> None:
        """Change a setting as a client of dynamic_reconfigure does. Then, the source falls silent."""
        request: Any = load_service_class("dynamic_reconfigure/Reconfigure")._request_class()
        doubles: Any = load_message_class("dynamic_reconfigure/DoubleParameter")
        space, _, key = name.rpartition("/")
        request.config.doubles = [doubles(key.lstrip("~"), value)]
        service = f"{space}/set_parameters" if space else "~set_parameters"
        self.rig.node.services[service](request)
        self.rig.at(self.rig.now_s + 0.3, self.leave)


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault, what the base must do after it ("" if both are right), and the time that it may take."""

    happens: Callable[[Run], object]
    then: str = ""
    takes_s: float = 0.0


def _slow_planner(run: Run) -> None:
    make = NavfnPlanner.make_plan

    def slow(self: Any, *arguments: Any) -> Any:
        run.rig.run(1.0)  # other timers go on, as other threads do
        return make(self, *arguments)

    run.rig.patch.setattr(NavfnPlanner, "make_plan", slow)
    send_goal(run.rig, 2.0)


COMMON: Final[Mapping[str, Fault]] = {
    "none": Fault(lambda run: None, GOES_ON), "released": Fault(lambda run: run.send(0.0), STOPS),
    "silent": Fault(lambda run: run.send(None), STOPS), "ended": Fault(Run.abandon, STOPS),
    "masked": Fault(Run.mask, STOPS), "nan": Fault(lambda run: run.send(math.nan), STOPS),
    "infinite": Fault(lambda run: run.send(-math.inf), STOPS), "huge": Fault(lambda run: run.send(1e300)),
    "flood": Fault(lambda run: run.flood(500.0), GOES_ON), "odom huge": Fault(partial(Run.lie, value=1e9)),
    "clock back": Fault(lambda run: run.jump(-3600.0), GOES_ON),
    "clock ahead": Fault(lambda run: run.jump(3600.0), GOES_ON),
}  # fmt: skip
GOALS: Final[Mapping[str, Fault]] = {
    **{f"goals {hz} Hz": Fault(partial(Run.goals, hz=hz), GOES_ON) for hz in (1, 5, 10, 20, 100, 500)},
    "goal nan": Fault(lambda run: send_goal(run.rig, math.nan), STOPS),
    "goal far": Fault(lambda run: send_goal(run.rig, 1e9), STOPS),
    "tf lost": Fault(lambda run: run.lose("/tf"), STOPS, takes_s=0.5),
    "scan lost": Fault(lambda run: run.lose("/scan")), "odom nan": Fault(partial(Run.lie, value=math.nan)),
    "odom lost": Fault(lambda run: run.lose("/odom")), "slow plan": Fault(_slow_planner, GOES_ON),
}  # fmt: skip
_UNTOUCHED: Final[Mapping[str, set[str]]] = {
    "move_base": {"released", "silent", "ended", "nan", "infinite", "huge", "flood"},  # goals do not repeat
    "turtle_teleop_key": {"released", "silent", "ended", "nan", "infinite", "huge"},  # pulses, as genuine
    "teleop_twist_keyboard": {"nan", "infinite", "huge"},
    "rqt_robot_steering": {"nan", "infinite"},
    "kobuki_safety_controller": {"nan", "infinite", "huge", "silent"},
    "draw_square": {"released", "silent", "nan", "infinite", "huge"},  # only turtlesim is silent
}
"""Faults that a program's source cannot have."""


def faults(name: str) -> dict[str, Fault]:
    """Return the faults that apply to a program."""
    found = {**COMMON, **(GOALS if name == "move_base" else {})}
    without = {"masked"} if PROGRAMS[name].mask is None else set()
    if name not in ("move_base", "yocs_velocity_smoother"):
        without.add("odom huge")
    return {each: fault for each, fault in found.items() if each not in _UNTOUCHED.get(name, set()) | without}


def run(program: Program, happens: Callable[[Run], object], uri: str, **parameters: float) -> Rig:
    """Run a program with a fault, to its end."""
    with pytest.MonkeyPatch.context() as patch:
        rig = Rig(patch, uri, END_S)
        program = replace(program, parameters={**program.parameters, **parameters})
        one = Run(program, rig)
        rig.at(FAULT_S, lambda: happens(one))
        printed = contextlib.redirect_stdout(io.StringIO())  # what a keyboard's program explains
        with printed, contextlib.suppress(InvalidParameter), contextlib.closing(rig):  # a nodelet's
            program.begin(rig)
        return rig


def problems(program: Program, rig: Rig, fault: Fault) -> Iterator[str]:
    """Yield what is wrong with the velocities that the base has received."""
    longest_s = program.period_s + MARGIN_S
    if fault.then and not rig.greatest():
        yield NEVER
    if rig.greatest() > program.limit:
        yield f"greatest {rig.greatest():g}"
    if rig.last():
        yield f"{rig.last():g} after the end"
    if fault.then == STOPS:
        limit_s = longest_s + fault.takes_s + (program.silence_s if math.isfinite(program.silence_s) else 0.0)
        if not rig.stopped_s() <= FAULT_S + limit_s:
            yield f"stopped after {rig.stopped_s() - FAULT_S:.2f} s"
    elif fault.then == GOES_ON:
        if not rig.last(END_S - 0.001):
            yield "stands"
        if rig.gap(0.0, END_S) > longest_s + 0.015:
            yield f"nothing for {rig.gap(0.0, END_S):.2f} s"


def numbers(name: str, uri: str) -> dict[str, bool]:
    """Return the names of all private parameters that may be numbers, and whether clients can change them."""
    asked: dict[str, Any] = {}

    class Spied(Rig):
        def prepare(self) -> None:
            get = self.node.params.get

            def spy(name: str, *rest: Any) -> Any:
                asked[name] = None
                asked[name] = get(name, *rest)
                return asked[name]

            self.node.params.get = spy

    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(io.StringIO()):
        rig = Spied(patch, uri, 0.5)
        PROGRAMS[name].begin(rig)
    own = f"/{rig.node.name.lstrip('/')}/"
    is_number = {each: not isinstance(value, dict | list | str) for each, value in asked.items()}
    found = {each[1:]: False for each in asked if each.startswith("~") and each != "~" and is_number[each]}
    for topic, sent in rig.node.sent.items():
        if topic.startswith(own) and topic.endswith("/parameter_updates"):
            space = topic.removeprefix(own).removesuffix("parameter_updates")
            found |= {f"{space}{each.name}": True for each in (*sent[-1].doubles, *sent[-1].ints)}
    return found


def sweep(name: str, uri: str) -> Iterator[tuple[str, list[str]]]:
    """Yield what is wrong if a numeric parameter has an edge value at the start, or gets it meanwhile.

    The source falls silent afterwards. A program may refuse the value and send nothing at all.
    """
    program = PROGRAMS[name]
    for (key, is_tunable), value in itertools.product(numbers(name, uri).items(), EDGES):
        is_huge = abs(value) >= 1e9
        sought = replace(program, limit=math.inf) if is_huge else program
        never = is_huge or f"{key} = {value:g}" == "key_timeout = 0"
        silent = Fault(Run.leave, "" if never else STOPS)
        rig = run(sought, silent.happens, uri, **{key: value})
        yield f"{key} = {value:g}", [each for each in problems(sought, rig, silent) if each != NEVER]
        if is_tunable:
            changed = Fault(partial(Run.reconfigure, name=f"~{key}", value=value), silent.then, 0.3)
            yield f"{key} -> {value:g}", list(problems(sought, run(sought, changed.happens, uri), changed))


def main() -> int:
    with Master(port=0) as master:
        found = dict(sweep("move_base", master.uri))
    wrong = [f"{each}: {'; '.join(problems)}" for each, problems in found.items() if problems]
    print(*wrong, f"move_base: {len(found)} runs, {len(wrong)} wrong", sep="\n")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
