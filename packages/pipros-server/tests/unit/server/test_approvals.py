"""Approvals: who may answer, for how long, and what a terminal shows."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.errors import PiprosError
from pipros.net.local_requests import LocalFailed
from pipros_server import terminal_approvals
from pipros_server.approvals import MINUTE_S, Approvals, Question, answer_act, waiting_acts
from pipros_server.policy.model import ActRefused
from tests.support.waiting import wait_until

if sys.platform != "win32":
    import pty

QUESTION = Question("publish", "/cmd_vel", '{"linear": {"x": 0.2}}', "base.yaml:2: topics./cmd_vel")


class Clock:
    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def approvals(clock: Clock) -> Approvals:
    return Approvals("http://robot:11311", 4, clock)


def asked(
    approvals: Approvals, client: str = "a", question: Question = QUESTION, over: Any = None
) -> Future[str]:
    """Wait for approval in a thread."""
    future: Future[str] = Future()

    def wait() -> None:
        try:
            future.set_result(approvals.wait((client, ""), question, 30.0, over or threading.Event()))
        except ActRefused as error:
            future.set_exception(error)

    threading.Thread(target=wait, daemon=True).start()
    return future


def listed(approvals: Approvals, count: int = 1) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = []

    def has_all() -> bool:
        found[:] = approvals.answer({"do": "list"})["waiting"]
        return len(found) == count

    wait_until(has_all)
    return found


def answer(approvals: Approvals, identity: str, verdict: str) -> None:
    approvals.answer({"do": "answer", "id": identity, "verdict": verdict})


def test_a_human_sees_tool_values_rule_and_the_time_left(approvals: Approvals, clock: Clock) -> None:
    waiting = asked(approvals)
    [act] = listed(approvals)
    clock.now_s += 10
    [act] = listed(approvals)
    assert act == {
        "id": act["id"], "tool": "publish", "name": "/cmd_vel", "values": '{"linear": {"x": 0.2}}',
        "rule": "base.yaml:2: topics./cmd_vel", "left_s": 20.0,
    }  # fmt: skip
    answer(approvals, act["id"], "once")
    assert waiting.result(30) == "once"
    with pytest.raises(PiprosError, match="no longer waits"):
        answer(approvals, act["id"], "once")


def test_an_answered_act_is_not_listed_while_its_client_has_not_noticed(approvals: Approvals) -> None:
    waiting = asked(approvals)
    [act] = listed(approvals)
    with approvals._changed:  # the client cannot go on meanwhile
        answer(approvals, act["id"], "once")
        assert approvals.answer({"do": "list"})["waiting"] == []
    assert waiting.result(30) == "once"


def test_an_approval_for_a_minute_ends_and_is_for_one_client_tool_and_name(
    approvals: Approvals, clock: Clock
) -> None:
    first = asked(approvals)
    answer(approvals, listed(approvals)[0]["id"], "minute")
    assert first.result(30) == "minute"
    clock.now_s += MINUTE_S - 0.1
    assert asked(approvals).result(30) == "minute"
    others = [asked(approvals, "b"), asked(approvals, question=Question("call", "/cmd_vel", "", ""))]
    assert len(listed(approvals, 2)) == 2
    for each in listed(approvals, 2):
        answer(approvals, each["id"], "refuse")
    for future in others:
        with pytest.raises(ActRefused, match="a human has refused this"):
            future.result(30)
    other_name = asked(approvals, question=Question("publish", "/cmd_vel2", "", ""))
    listed(approvals)
    clock.now_s += 0.2
    again = asked(approvals)
    assert len(listed(approvals, 2)) == 2, "the minute has ended"
    clock.now_s += 31
    for future in (other_name, again):
        with pytest.raises(ActRefused, match="no human has approved this within 30 s"):
            future.result(30)


def test_too_many_acts_and_those_of_clients_that_have_gone_do_not_wait(approvals: Approvals) -> None:
    over = threading.Event()
    futures = [asked(approvals, over=over), asked(approvals)]
    listed(approvals, 2)
    with pytest.raises(ActRefused, match="2 acts already await approval"):
        asked(approvals).result(30)
    over.set()
    with pytest.raises(ActRefused, match="the client has disconnected"):
        futures[0].result(30)
    approvals.stop()
    with pytest.raises(ActRefused, match="the program is ending"):
        futures[1].result(30)
    with pytest.raises(ActRefused, match="the program is ending"):
        asked(approvals).result(30)


@pytest.mark.parametrize("request_", [
    {"do": "answer", "id": "x", "verdict": "once"}, {"do": "answer", "id": "x", "verdict": "always"},
    {"do": "x", "verdict": 1},
], ids=str)  # fmt: skip
def test_wrong_answers_are_refused(approvals: Approvals, request_: dict[str, Any]) -> None:
    with pytest.raises(PiprosError):
        approvals.answer(request_)


@pytest.fixture
def reachable(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Approvals]:
    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    approvals = Approvals("http://robot:11311", 4)
    approvals.start()
    yield approvals
    approvals.stop()


@pytest.mark.needs("Unix sockets")
def test_other_programs_of_this_user_list_and_answer(reachable: Approvals) -> None:
    waiting = asked(reachable)
    listed(reachable)
    [program] = waiting_acts()
    assert (program["master"], program["process"]) == ("http://robot:11311", str(os.getpid()))
    answer_act(program["process"], program["waiting"][0]["id"], "once")
    assert waiting.result(30) == "once"
    with pytest.raises(LocalFailed, match="no longer waits"):
        answer_act(program["process"], program["waiting"][0]["id"], "once")
    reachable.note({"tool": "publish"})
    assert waiting_acts()[0]["acts"] == [{"tool": "publish"}]


SUSPENDED = """
import os, signal, threading
from pipros_server.approvals import Approvals, Question
approvals, question = Approvals("m", 4), Question("publish", "/cmd_vel", "", "r")
approvals.start()
threading.Timer(0.5, lambda: (print("asks", flush=True), os.kill(os.getpid(), signal.SIGSTOP))).start()
approvals.wait(("a", ""), question, 600.0, threading.Event())
"""


@pytest.mark.needs("Unix sockets")
def test_an_answer_that_a_suspended_program_did_not_acknowledge_does_not_approve_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    words = [sys.executable, "-c", SUSPENDED]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as program:
        try:
            acts: list[Any] = []
            wait_until(lambda: acts.extend(act for each in waiting_acts() for act in each["waiting"]) or acts)
            assert program.stdout.readline() == "asks\n"
            wait_until(lambda: Path(f"/proc/{program.pid}/stat").read_text().split()[2] == "T")
            with pytest.raises(LocalFailed, match="does not answer"):
                answer_act(str(program.pid), acts[0]["id"], "once")
            [silent] = waiting_acts()
            assert silent["silent"] == f"process {program.pid} does not answer: timed out"
            program.send_signal(signal.SIGCONT)
            [resumed] = waiting_acts()  # requests are answered in their order
            assert [act["id"] for act in resumed["waiting"]] == [acts[0]["id"]]
        finally:
            program.kill()


@pytest.mark.needs("Unix sockets")
def test_the_socket_is_private(reachable: Approvals, tmp_path: Path) -> None:
    del reachable
    folder = tmp_path / "pipros" / "approvals"
    assert folder.stat().st_mode & 0o077 == 0
    assert (folder / str(os.getpid())).stat().st_mode & 0o077 == 0


HOSTILE = 'x"}\r\n  tool    read_topic\n\x1b[2Jy\u202e\U000e0041'


class Typing:
    """A terminal at which a human types, and what the program prints."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.master, slave = pty.openpty()
        self.stdin = os.fdopen(slave, "r")
        monkeypatch.setattr("sys.stdin", self.stdin)

    def types(self, text: str) -> None:
        os.write(self.master, text.encode())

    def close(self) -> None:
        self.stdin.close()
        os.close(self.master)


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Iterator[Typing]:
    found = Typing(monkeypatch)
    yield found
    found.close()


def program(**changed: Any) -> dict[str, Any]:
    """A program with a waiting act."""
    act = {"id": "1", "tool": "publish", "name": "/x", "values": "", "rule": "r", "left_s": 60.0}
    return {"master": "http://robot:11311", "process": "7", "waiting": [act | changed]}


def answers_to(*rounds: list[Any], each_round: Callable[[], object] = lambda: None) -> list[Any]:
    """Return the answers of a human to programs that are found one after the other, before Ctrl-C."""
    left, answers = list(rounds), list[Any]()

    def find() -> list[Any]:
        if not left:
            raise KeyboardInterrupt
        each_round()
        return left.pop(0)

    with pytest.raises(KeyboardInterrupt):
        terminal_approvals.ask_humans(find, lambda *given: answers.append(given))
    return answers


@pytest.mark.needs("pseudo-terminals")
@pytest.mark.parametrize(
    ("typed", "verdict"), [("y\n", "once"), ("M\n", "minute"), ("n\n", "refuse"), ("what\nn\n", "refuse")]
)
def test_a_terminal_asks_and_answers(
    terminal: Typing,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    typed: str,
    verdict: str,
) -> None:
    shown, original = list[str](), print

    def printed(*texts: object, **options: Any) -> None:
        shown.append(" ".join(map(str, texts)))
        original(*texts, **options)

    def typing() -> None:
        wait_until(lambda: "20 s left" in "".join(shown))
        terminal.types(typed)

    monkeypatch.setattr(terminal_approvals, "print", printed, raising=False)
    threading.Thread(target=typing, daemon=True).start()
    asks = program(name="/cmd_vel", values=HOSTILE, left_s=20.0)
    answers: list[tuple[str, str, str]] = []

    def find() -> list[Any]:
        if answers:
            raise KeyboardInterrupt
        return [asks]

    with pytest.raises(KeyboardInterrupt):
        terminal_approvals.ask_humans(find, lambda *given: answers.append(given))
    assert answers == [("7", "1", verdict)]
    output = capsys.readouterr().out
    assert '  values  x"}\\r\\n  tool    read_topic\\n\\x1b[2Jy\\u202e\\U000e0041\n' in output
    assert output.count("\n  tool ") == 1
    assert "  master  http://robot:11311\n" in output


@pytest.mark.needs("pseudo-terminals")
def test_what_was_typed_before_an_act_appeared_does_not_approve_it(
    terminal: Typing, capsys: pytest.CaptureFixture[str]
) -> None:
    terminal.types("y\n")
    assert answers_to([program(left_s=0.5)], [], []) == []


@pytest.mark.needs("pseudo-terminals")
def test_a_line_that_was_begun_for_one_act_does_not_approve_the_next_one(
    terminal: Typing, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The assistant cancels an act and requests another one, after the human typed `y`, before Enter."""
    shown: list[Any] = []
    describe = terminal_approvals.shown

    def show(asking: Any, described: Any) -> str:
        shown.append(described["id"])
        return describe(asking, described)

    def prints(text: str, **_: Any) -> None:
        if "n: refuse" in text:
            terminal.types("\n" if shown[-1] == "2" else "y")

    monkeypatch.setattr(terminal_approvals, "shown", show)
    monkeypatch.setattr(terminal_approvals, "print", prints, raising=False)
    assert answers_to(*[[program(id=identity, left_s=1.0)] for identity in "1222"], []) == []
    assert "2" in shown


@pytest.mark.needs("pseudo-terminals")
def test_a_terminal_names_a_silent_program_and_accepts_no_answer_meanwhile(
    terminal: Typing, capsys: pytest.CaptureFixture[str]
) -> None:
    silent = {"master": "", "process": "7", "waiting": [], "silent": "process 7 does not answer: timed out"}
    typed = iter(["", "y\n", "y\n", ""])
    answers = answers_to([program()], [silent], [silent], [], each_round=lambda: terminal.types(next(typed)))
    assert answers == []
    assert "process 7 does not answer: timed out: an answer is not accepted." in capsys.readouterr().out


@pytest.mark.parametrize("columns", [20, 40, 80, 200])
def test_no_value_imitates_a_line_where_the_terminal_breaks_lines(
    monkeypatch: pytest.MonkeyPatch, columns: int
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    padding = " " * (columns - 10)
    values = f"{padding}  rule    all is allowed{padding}  tool    read_topic \u30c6\u30ec"
    act = {"tool": "publish", "name": "/x", "values": values, "rule": "r"}
    text = terminal_approvals.shown({"master": "m", "process": "7"}, act)
    seen = [line[at : at + columns] for line in text.splitlines() for at in range(0, len(line), columns)]
    begins = [line[:10].strip() for line in seen]
    if columns > 31:
        assert [each for each in begins if each] == ["tool", "name", "values", "rule", "master", "process"]
    assert text.isascii()
    assert "".join(line[10:] for line in text.splitlines()[2:-3]).startswith(values[:-2])


def test_refused_acts_do_not_displace_others(approvals: Approvals) -> None:
    approvals.note({"outcome": "done", "tool": "publish"})
    for _ in range(1000):
        approvals.note({"outcome": "refused"})
    acts = approvals.answer({"do": "list"})["acts"]
    assert (acts[0]["tool"], len(acts)) == ("publish", 101)
