"""Acts that a policy allows and a human approves. They are logged on `/pipros/acts`.

This module serves clients that are not trusted with their own connection to ROS; `act_gate.py` serves all
other clients.
"""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any, Final, NamedTuple, TypeVar

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.basics.hidden_text import safe
from pipros.msg import load_message_class
from pipros.node import Node
from pipros.node.publisher import Publisher
from pipros_server.act_gate import ActGate, GatedPublisher
from pipros_server.approvals import Approvals, Question
from pipros_server.limited_process import LimitedProcesses
from pipros_server.policy.decisions import Act, PolicyState
from pipros_server.policy.model import ActKind, ActRefused, ActRule, Policy

TOPIC: Final = "/pipros/acts"
CONNECTING_S: Final = 2.0
"""Maximum time to wait until the subscribers of a topic have connected."""

ENDING_S: Final = 10.0
"""Maximum time to wait for the end of a program."""
NOT_NEEDED: Final = "not needed, because it stops"
GOALS: Final = 1000
"""Maximum number of goals that can be cancelled; the oldest are forgotten."""

T = TypeVar("T")


class Caller(NamedTuple):
    """A client during one call. The event `over` is set when the client leaves or the call ends.

    The identity consists of a token and a session.
    """

    identity: tuple[str, str]
    over: threading.Event


class ActLimits(NamedTuple):
    """Limits of `ApprovedActs`.

    Attributes:
        waiting: maximum number of acts that await approval.
        wait_s: maximum time that each act waits.
        characters: maximum length of an act's values as JSON, which the human sees in full.
        runs: maximum number of programs that run at the same time.
    """

    waiting: int
    wait_s: float
    characters: int
    runs: int


class System(NamedTuple):
    """A connection to the running system, for acts."""

    node: Node
    gate: ActGate
    log: Publisher[Any]
    publishers: dict[str, GatedPublisher]


class ApprovedActs:
    """The acts of all clients of a server. Thread-safe.

    Attributes:
        policy: the rules for the clients' acts.
        approvals: the acts that await approval.
        runs: launch files and recordings.
        goals: the action of each goal that was sent, by goal id.
        environment: determines the master.
    """

    def __init__(self, environment: Environment, policy: Policy, limits: ActLimits) -> None:
        """Store the arguments. The first act connects to the master."""
        self.environment = environment
        self.policy = policy
        self.limits = limits
        self.approvals = Approvals(environment.master_uri, limits.waiting)
        self.runs = LimitedProcesses(limits.runs)
        self.goals: dict[str, str] = {}
        self._state = PolicyState()
        self._system: System | None = None
        self._lock = threading.Lock()

    def system(self) -> System:
        """Return the connection. Connect if there is none, or if the master was restarted.

        Raises:
            Unreachable: the master does not answer.
        """
        with self._lock:
            found = self._system
            if found is not None:
                with suppress(PiprosError):
                    if found.node.master.lookup_node(found.node.name) == found.node.uri:
                        return found
                self._system = None
                self._disconnect(found)
            node = Node("pipros_acts", anonymous=True, environment=self.environment)
            node.start()
            try:
                node.master.get_system_state()  # fails at once without a master
                gate = ActGate(node, self.policy, state=self._state)
                gate.start()
                log = node.advertise(TOPIC, load_message_class("std_msgs/String"), queue_size=100)
            except BaseException:
                node.shutdown()
                raise
            self._system = System(node, gate, log, {})
            return self._system

    def note_goal(self, identity: str, action: str) -> None:
        """Remember the action of a goal, so that the tool `cancel_goal` can cancel the goal."""
        with self._lock:
            while len(self.goals) >= GOALS:
                del self.goals[next(iter(self.goals))]
            self.goals[identity] = action

    def close(self) -> None:
        """Refuse pending acts, let the guardian publish pending stops, and end the programs and the node."""
        self.approvals.stop()
        self.runs.stop()
        with self._lock:
            found, self._system = self._system, None
        if found is not None:
            self._disconnect(found)

    @staticmethod
    def _disconnect(system: System) -> None:
        system.gate.close()
        system.node.shutdown()

    def rule(self, kind: ActKind, name: str) -> ActRule:
        """Return the rule for a name. If there is none, log the refusal and raise `ActRefused`."""
        found = self.policy.rules.get((kind, name))
        if found is None:
            with self._logged(f"act on {kind.value}", name, ""):
                found = self.system().gate.rule(kind, name)
        return found

    def perform(
        self,
        caller: Caller,
        tool: str,
        acts: Sequence[Act],
        values: object,
        carry_out: Callable[[System], T],
        *,
        needs_human: bool = True,
    ) -> T:
        """Carry out acts that the policy allows, after a human has approved them.

        Args:
            values: the values that the human sees.
            carry_out: carries out the acts through the gate, which checks them again and counts them.
            needs_human: False for acts that only end what was approved earlier.

        Raises:
            ActRefused: the policy refuses, the values are too long to be shown, the call has ended, or
                `Approvals.wait` raises this.
            Unreachable: the master does not answer.
        """
        system = self.system()
        text = json.dumps(safe(values))  # in ASCII, because some other letters look alike
        name = ", ".join(each.name for each in acts)
        with self._logged(tool, name, text) as note:
            rules = [system.gate.preview(each) for each in acts]
            if len(text) > self.limits.characters:
                raise ActRefused(f"the values have {len(text)} characters, too many to show to a human")
            approval = NOT_NEEDED
            if needs_human and not all(_is_stop(*each) for each in zip(acts, rules, strict=True)):
                question = Question(tool, name, text, "; ".join(map(_shown, rules)))
                approval = self.approvals.wait(caller.identity, question, self.limits.wait_s, caller.over)
            note("approved", approval=approval)
            if caller.over.is_set():
                raise ActRefused("the client has disconnected, or has cancelled the call")
            return carry_out(system)

    def end_run(self, run: int) -> bool | None:
        """Stop a program, and wait up to `ENDING_S`. Return whether it ended; None if it does not exist."""
        found = self.runs.get(run)
        if found is None:
            return None
        with self._logged("stop_run", str(run), "") as note:
            note("approved", approval=NOT_NEEDED)
            return found.stop(ENDING_S)

    @contextmanager
    def _logged(self, tool: str, name: str, values: str) -> Iterator[Callable[..., None]]:
        """Log the outcome of the act in the `with` block. Yield a function that logs earlier events."""

        def note(outcome: str, **more: str) -> None:
            kept = values[: self.limits.characters]
            act = {"time": round(time.time(), 3), "tool": tool, "name": name, "values": kept}
            row = safe({**act, "outcome": outcome, **more})
            self.approvals.note(row)
            system = self._system
            with suppress(PiprosError, RuntimeError):  # the node is shut down
                if system is not None:
                    system.log.publish(load_message_class("std_msgs/String")(json.dumps(row)))

        try:
            yield note
            note("done")
        except ActRefused as error:
            note("refused", reason=str(error))
            raise
        except Exception as error:
            note("failed", reason=str(error))
            raise


def _is_stop(act: Act, rule: ActRule) -> bool:
    return rule.stop is not None and bool(act.value == rule.stop)


def _shown(rule: ActRule) -> str:
    """Describe a rule for humans: its place and its limits."""
    parts = [rule.place]
    if rule.per_minute is not None:
        parts.append(f"at most {rule.per_minute} a minute")
    if rule.time_limit_s is not None:
        parts.append(f"stopped after {rule.time_limit_s:g} s")
    return ", ".join(parts)
