"""Ask a human at a terminal about the acts that await approval; see `approvals.py`."""

from __future__ import annotations

import os
import select
import shutil
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.basics.terminals import discard_input
from pipros_server.approvals import FOR_A_MINUTE, ONCE, REFUSE, answer_act, waiting_acts

KEYS: Final = {"y": ONCE, "m": FOR_A_MINUTE, "n": REFUSE}
POLL_S: Final = 0.5
UNSEEN_S: Final = 0.5
"""Time in which an act cannot be read yet. Input during this time is discarded."""
LINE_BYTES: Final = 1000
"""Maximum length of a typed line; the rest counts as another line."""


def ask_humans(
    find: Callable[[], list[Mapping[str, Any]]] = waiting_acts,
    answer: Callable[[str, str, str], None] = answer_act,
) -> None:
    """Show one act after the other and read the answers, until Ctrl-C or the end of the input.

    Raises:
        OSError: see `waiting_acts`.
    """
    print("Waiting for acts that need approval. Ctrl-C ends this.", flush=True)
    reported = ""  # the programs that do not answer
    while True:
        found = find()
        program, act = next(_acts(found), (None, None))
        if program is None or act is None:
            silent = "; ".join(each["silent"] for each in found if "silent" in each)
            if silent != reported:
                print(silent or "All programs answer again.", flush=True)
            reported = silent
            time.sleep(POLL_S)
            continue
        print(f"\n{shown(program, act)}", flush=True)
        verdict = _read_verdict(program, act, find)
        if verdict is None:
            return
        if not verdict:
            print("\nIt no longer waits.", flush=True)
            continue
        try:
            answer(program["process"], act["id"], verdict)
            what = ascii(f"{act['tool']} {act['name']}")[1:-1]
            print(f"Answered: {verdict}. This concerns {what}, act {ascii(act['id'])[1:-1]}.", flush=True)
        except PiprosError as error:
            print(error, flush=True)


def shown(program: Mapping[str, object], act: Mapping[str, object]) -> str:
    """Return an act as lines whose texts cannot imitate other lines, even if the terminal wraps them.

    Letters outside ASCII are shown as escapes, because some letters look alike, and their widths vary.
    """
    rows = {
        "tool": act["tool"],
        "name": act["name"],
        "values": act["values"],
        "rule": act["rule"],
        "master": program["master"],
        "process": program["process"],
    }
    width = max(shutil.get_terminal_size().columns - 11, 20)
    lines: list[str] = []
    for name, value in rows.items():
        text = ascii(str(value))[1:-1].replace("\\'", "'").replace("\\\\", "\\")
        parts = [text[at : at + width] for at in range(0, len(text), width)] or [""]
        lines += [f"  {name if not at else '':8}{part}" for at, part in enumerate(parts)]
    return "\n".join(lines)


def _acts(found: list[Mapping[str, Any]]) -> Iterator[tuple[Mapping[str, Any], Mapping[str, Any]]]:
    """Yield the acts that await approval with their programs, sorted by the remaining time."""
    acts = [(program, act) for program in found for act in program["waiting"]]
    yield from sorted(acts, key=lambda each: float(each[1]["left_s"]))


def _read_verdict(
    program: Mapping[str, Any], act: Mapping[str, Any], find: Callable[[], list[Mapping[str, Any]]]
) -> str | None:
    """Return the answer; empty if the act no longer awaits approval, and None at the end of the input."""
    left_s = float(act["left_s"])
    time.sleep(UNSEEN_S)
    _discard_typed()
    begin_s = time.monotonic()
    while True:
        remaining_s = left_s - (time.monotonic() - begin_s)
        prompt = f"{remaining_s:3.0f} s left. y: once, m: for a minute, n: refuse > "
        print(f"\r{prompt}", end="", flush=True)
        if select.select([sys.stdin], [], [], 1.0)[0]:
            line = os.read(sys.stdin.fileno(), LINE_BYTES)  # a buffer could already hold another line
            if not line:
                return None
            if verdict := KEYS.get(line.decode("utf-8", "replace").strip().lower()):
                return verdict
        asking: Mapping[str, Any] = next(
            (each for each in find() if each["process"] == program["process"]), {}
        )
        if "silent" in asking and remaining_s > 0:
            print(f"\n{asking['silent']}: an answer is not accepted.", flush=True)
            _discard_typed()
        elif remaining_s <= 0 or act["id"] not in {each["id"] for each in asking.get("waiting", ())}:
            return ""


def _discard_typed() -> None:
    """Discard what was typed before the act could be read, so that it cannot approve the act.

    A begun line is discarded, too: it was meant for another act, and assistants choose when acts change.
    """
    discard_input(sys.stdin.fileno())
    while select.select([sys.stdin], [], [], 0.0)[0] and os.read(sys.stdin.fileno(), LINE_BYTES):
        pass
