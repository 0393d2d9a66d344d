"""Let a human approve a program's acts in another program of the same user on the same machine.

Theory of operation. The program that acts has an `Approvals`, whose `wait` blocks until a human has answered.
Other programs list the acts that await approval, and answer them through `net/local_requests.py`. The
operating system identifies their user, so only programs of this user and root can answer. Approving acts over
ROS is not possible. Requests and responses:

    {"do": "list"}                                     {"master": …, "waiting": […], "acts": […]}
    {"do": "answer", "id": …, "verdict": "once"}       {}

A human approves one act, or all acts of the same client with the same tool and the same name for a minute.
"""

from __future__ import annotations

import secrets
import threading
import time
from collections import deque
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.net import local_requests
from pipros.net.local_requests import LocalFailed, LocalServer
from pipros_server.policy.model import ActRefused

MINUTE_S: Final = 60.0
ONCE, FOR_A_MINUTE, REFUSE = VERDICTS = ("once", "minute", "refuse")
KEPT: Final = 100
"""Maximum number of refused acts, and of other past acts, that are kept for display."""
MOST_PROGRAMS: Final = 20
"""Maximum number of programs whose acts are shown."""
_FOLDER: Final = "approvals"
_ANSWER_BYTES: Final = 4 * 1024 * 1024
_SLICE_S: Final = 0.2
_STOPPED: Final = "nobody can approve this any more, because the program is ending"


@dataclass(frozen=True, slots=True)
class Question:
    """An act that needs approval, described for humans.

    Attributes:
        tool: the requested operation, such as `publish`.
        name: name of the topic, service, … that the act uses.
        values: the values that the act would send.
        rule: the policy's rules that allow the act, with their limits.
    """

    tool: str
    name: str
    values: str
    rule: str


@dataclass(slots=True)
class _WaitingAct:
    question: Question
    due_s: float
    token: str
    verdict: str = ""


class Approvals:
    """The acts of one program that await approval, and its past acts. Thread-safe."""

    def __init__(self, master: str, limit: int, clock_s: Callable[[], float] = time.monotonic) -> None:
        """Store the arguments. Other programs can connect after `start`.

        Args:
            master: URI of the master, for display.
            limit: maximum number of acts that await approval.
        """
        self._master = master
        self._limit = limit
        self._clock_s = clock_s
        self._waiting: dict[str, _WaitingAct] = {}
        self._granted: dict[tuple[Hashable, str, str], float] = {}
        self._acts: deque[Mapping[str, Any]] = deque(maxlen=KEPT)
        self._refused: deque[Mapping[str, Any]] = deque(maxlen=KEPT)
        self._changed = threading.Condition()
        self._server = LocalServer(_FOLDER, self.answer)

    def start(self) -> None:
        """Let other programs list the acts that await approval, and approve or refuse them.

        Raises:
            OSError: this system does not support Unix sockets, or the folder cannot be used.
        """
        self._server.start()

    def stop(self) -> None:
        """Refuse all acts that await approval, and stop serving other programs."""
        self._server.stop()
        with self._changed:
            self._limit = 0
            for each in self._waiting.values():
                each.verdict = REFUSE
            self._changed.notify_all()

    def wait(self, client: tuple[str, str], question: Question, wait_s: float, over: threading.Event) -> str:
        """Block until a human has approved an act. Return `once` or `minute`.

        If an earlier approval for a minute is still valid, return `minute` at once.

        Args:
            client: token and session of the client that acts, to which an approval for a minute is limited.
                The acts of one token may use at most half of the places that those of others leave.
            over: set when the client has disconnected or cancelled the call. This ends the wait.

        Raises:
            ActRefused: a human or `stop` has refused, no human has answered within `wait_s`, `over` was set,
                or too many acts are waiting.
        """
        key = (client, question.tool, question.name)
        identity = secrets.token_hex(8)
        with self._changed:
            now_s = self._clock_s()
            self._granted = {known: end_s for known, end_s in self._granted.items() if end_s > now_s}
            if key in self._granted:
                return FOR_A_MINUTE
            if not self._limit:
                raise ActRefused(_STOPPED)
            own = sum(each.token == client[0] for each in self._waiting.values())
            if 2 * own >= self._limit - (len(self._waiting) - own):
                raise ActRefused(f"{len(self._waiting)} acts already await approval; try again later")
            waiting = self._waiting[identity] = _WaitingAct(question, now_s + wait_s, client[0])
            try:
                while not (waiting.verdict or over.is_set() or self._clock_s() >= waiting.due_s):
                    self._changed.wait(min(max(waiting.due_s - self._clock_s(), 0.0), _SLICE_S))
            finally:
                del self._waiting[identity]
            if waiting.verdict == FOR_A_MINUTE:
                self._granted[key] = self._clock_s() + MINUTE_S
        if over.is_set():
            raise ActRefused("the client has disconnected, or has cancelled the call")
        if not waiting.verdict:
            raise ActRefused(f"no human has approved this within {wait_s:g} s")
        if waiting.verdict == REFUSE:
            raise ActRefused("a human has refused this" if self._limit else _STOPPED)
        return waiting.verdict

    def note(self, act: Mapping[str, object]) -> None:
        """Keep a past act for display. Refused acts do not displace other acts."""
        with self._changed:
            (self._refused if act.get("outcome") == "refused" else self._acts).appendleft(act)

    def answer(self, request: Any) -> Mapping[str, Any]:
        """Return the response to a request from another program.

        Raises:
            PiprosError: the act no longer awaits approval, or the operation or the verdict is unknown.
            LookupError, TypeError: the request is malformed.
        """
        wanted = request["do"]
        with self._changed:
            if wanted == "list":
                now_s = self._clock_s()
                waiting = [
                    {
                        "id": identity,
                        "tool": each.question.tool,
                        "name": each.question.name,
                        "values": each.question.values,
                        "rule": each.question.rule,
                        "left_s": round(max(each.due_s - now_s, 0.0), 1),
                    }
                    for identity, each in self._waiting.items()
                    if not each.verdict
                ]
                return {"master": self._master, "waiting": waiting, "acts": [*self._acts, *self._refused]}
            if wanted != "answer" or request["verdict"] not in VERDICTS:
                raise PiprosError(f"do must be list, or answer with one of {', '.join(VERDICTS)}")
            found = self._waiting.get(request["id"])
            if found is None or found.verdict or self._clock_s() >= found.due_s:
                raise PiprosError("this act no longer waits for an answer")
            found.verdict = request["verdict"]
            self._changed.notify_all()
        return {}


def waiting_acts() -> list[Mapping[str, Any]]:
    """Send `list` to up to `MOST_PROGRAMS` programs. Return the responses, each with its `process`.

    A program that does not answer has no acts, and a text in `silent`. May block for several seconds.

    Raises:
        OSError: the folder of the sockets cannot be read, or other users could write to it.
    """
    found: list[Mapping[str, Any]] = []
    for process in local_requests.running(_FOLDER)[:MOST_PROGRAMS]:
        try:
            found.append(
                {**local_requests.ask(_FOLDER, process, {"do": "list"}, _ANSWER_BYTES), "process": process}
            )
        except LocalFailed as error:
            if not error.has_ended:
                found.append(
                    {"process": process, "master": "", "waiting": [], "acts": [], "silent": str(error)}
                )
    return found


def answer_act(process: str, identity: str, verdict: str) -> None:
    """Send a human's verdict on an act: `once`, `minute` or `refuse`.

    Raises:
        LocalFailed: the act no longer awaits approval, or its program has ended.
    """
    request = {"do": "answer", "id": identity, "verdict": verdict}
    local_requests.ask(_FOLDER, process, request, _ANSWER_BYTES)
