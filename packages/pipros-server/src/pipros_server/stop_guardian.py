"""The server's side of `guardian_process.py`: starts it, and reports acts with a time limit to it."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Mapping
from typing import IO, Any, Final

from pipros.basics.posix import NEW_GROUP
from pipros.node import Node
from pipros_server.guardian_process import CALL, POLICY_STOPS
from pipros_server.policy.model import ActKind, ActRefused, ActRule

SILENT_S: Final = 1.0
"""Acts with a time limit are refused if the process has not written for this time (s)."""
LOST_S: Final = 3.0
"""The process is killed, and replaced, if it is suspended and has not written for this time (s)."""
STARVED_S: Final = 20.0
"""The same for a process that is not suspended: on a busy machine, a new one would need longer."""
READY_S: Final = 20.0
"""Maximum time (s) until the process has started and has advertised a topic."""


def key_of(rule: ActRule) -> str:
    """Return the guardian process's key for a rule's stop: the topic, or `CALL` and the service."""
    return f"{CALL}{rule.name}" if rule.kind is ActKind.SERVICE else rule.stop_topic


class StopGuardian:
    """Starts the process when the first stop is watched. Thread-safe.

    If the process ends or is suspended while it is needed, a new process publishes all pending stops.
    """

    def __init__(self, node: Node) -> None:
        """Create a guardian without a process. Its process will use the master of `node`."""
        self._node = node
        self._process: subprocess.Popen[str] | None = None
        self._watched: dict[str, dict[str, Any]] = {}
        self._ready: set[str] = set()
        self._pending: dict[tuple[str, str], object] = {}
        self._lost: list[tuple[str, str]] = []  # pending stops of a process that has ended
        self._is_closed = False
        self._heard_s = 0.0
        self._changed = threading.Condition()

    def watch(self, rule: ActRule) -> None:
        """Report a rule's stop to the process. The first time, block until the process can publish it.

        Raises:
            ActRefused: the process does not start, or does not answer.
        """
        key = key_of(rule)
        line: dict[str, Any] = {
            "op": "watch",
            "key": key,
            "type": rule.type if rule.kind is ActKind.SERVICE else rule.stop_message._type,
            "limit_s": rule.time_limit_s,
            "body": b"".join(rule.stop_message._to_buffers()).hex(),
        }
        if rule.halt is not None:
            topic, stop, result = rule.halt
            halt = {
                "topic": topic,
                "type": stop._type,
                "body": b"".join(stop._to_buffers()).hex(),
                "result": result,
            }
            line["halt"] = halt
        with self._changed:
            is_new = key not in self._watched
            self._watched[key] = line
            if self._process is None and not self._is_closed:
                try:
                    self._start()
                except OSError as error:
                    what = "the guardian, which stops acts with a time limit, does not start"
                    raise ActRefused(f"{what}: {error}", rule.place) from error
            elif is_new:
                self._send(line)
            if not self._changed.wait_for(lambda: key in self._ready, READY_S):
                raise ActRefused("the guardian, which stops acts with a time limit, is not ready", rule.place)

    def arm(self, key: str, identity: str, client: object, stop: bytes | None = None) -> None:
        """Start the time limit of an act. `client` is the acting client.

        `stop` replaces the message that stops the topic, for example because it must contain the current
        position. It must not exceed the size limit of a policy's stop. If too many stops are pending, the
        oldest becomes due now.

        Raises:
            ActRefused: the process is not ready, does not answer, or cannot be reached.
        """
        with self._changed:
            if key not in self._ready:
                raise ActRefused("the guardian, which stops acts with a time limit, is not running")
            if (silent_s := time.monotonic() - self._heard_s) > SILENT_S:
                what = "the guardian, which stops acts with a time limit, has not answered"
                raise ActRefused(f"{what} for {silent_s:.1f} s, so it could not stop this")
            if (key, identity) not in self._pending and len(self._pending) >= POLICY_STOPS:
                oldest = next(iter(self._pending))
                self._stop(*oldest)
            self._pending[key, identity] = client
            line = {"op": "arm", "key": key, "id": identity}
            if stop is not None:
                line["body"] = self._watched[key]["body"] = stop.hex()
            if not self._send(line):
                raise ActRefused("the guardian, which stops acts with a time limit, cannot be reached")

    def renew(self, key: str) -> None:
        """Restart the time limit of a topic or service whose act may have taken effect late."""
        with self._changed:
            if key in self._ready:
                self._pending.setdefault((key, ""), None)
                self._send({"op": "arm", "key": key, "id": ""})

    def disarm(self, key: str) -> None:
        """Cancel the time limit of a topic or service, because a client has stopped it."""
        with self._changed:
            if self._pending.pop((key, ""), self) is not self:
                self._send({"op": "disarm", "key": key, "id": ""})

    def left(self, key: str, client: object) -> bool:
        """Stop what a departing client has started on a topic. Return whether there was anything to stop."""
        with self._changed:
            started = [each for each, who in self._pending.items() if who is client and each[0] == key]
            for found, identity in started:
                self._stop(found, identity)
        return bool(started)

    def close(self) -> None:
        """End the input of the process, which then publishes all pending stops and exits."""
        with self._changed:
            self._is_closed = True
            if self._process is not None and self._process.stdin is not None:
                with contextlib.suppress(OSError):
                    self._process.stdin.close()

    def _stop(self, key: str, identity: str) -> None:
        del self._pending[key, identity]
        self._send({"op": "stop", "key": key, "id": identity})

    def _send(self, line: Mapping[str, object]) -> bool:
        """Write a line, which is too short to be written in part. Return whether it was written."""
        process = self._process
        if process is None or process.stdin is None or self._is_closed:
            return False
        try:
            os.write(process.stdin.fileno(), (json.dumps(line) + "\n").encode())
        except (OSError, ValueError):
            return False
        return True

    def _start(self) -> None:
        """Start a process, and report all watched stops to it."""
        # In a new session, so that Ctrl-C in the server's terminal does not reach the process.
        process = self._process = subprocess.Popen(
            [sys.executable, "-I", "-m", "pipros_server.guardian_process"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=self._node.environment.applied_to(os.environ),
            start_new_session=True,
            creationflags=NEW_GROUP,
            text=True,
        )
        if process.stdin is not None and sys.platform != "win32":
            os.set_blocking(process.stdin.fileno(), False)
        for run in (self._read, self._replace_if_silent):
            threading.Thread(target=run, args=(process, process.stdout), daemon=True).start()
        for line in self._watched.values():
            self._send(line)

    def _replace_if_silent(self, process: subprocess.Popen[str], _: object) -> None:
        """Kill the process if it has written before, and falls silent; `_read` then starts another one."""
        heard_s, silences = 0.0, 0
        while process.poll() is None and not self._is_closed:
            time.sleep(SILENT_S / 2)
            # Counts own intervals, because this process may have been suspended, too.
            silences = silences + 1 if heard_s == self._heard_s else 0
            heard_s = self._heard_s
            limit_s = LOST_S if _is_suspended(process.pid) else STARVED_S
            if self._ready and silences * SILENT_S / 2 >= limit_s:
                process.kill()
                return

    def _read(self, process: subprocess.Popen[str], output: IO[str]) -> None:
        """Record which stops are ready. If the process ends, start another process for the pending stops."""
        with contextlib.suppress(OSError, ValueError), output:
            for line in output:
                with self._changed:
                    self._heard_s = time.monotonic()
                    if not line.strip():
                        continue
                    if line.startswith("{"):
                        over = json.loads(line)
                        self._pending.pop((over["key"], over["id"]), None)
                        continue
                    self._ready.add(line.strip())
                    for key, identity in [each for each in self._lost if each[0] == line.strip()]:
                        self._lost.remove((key, identity))
                        for op in ("arm", "stop"):
                            self._send({"op": op, "key": key, "id": identity})
                    self._changed.notify_all()
        process.wait()
        with self._changed:
            was_ready = bool(self._ready)
            self._lost += self._pending
            self._pending.clear()
            self._ready.clear()
            self._process = None
            if was_ready and not self._is_closed:  # a process that was never ready would fail again
                self._start()


def _is_suspended(pid: int) -> bool:
    """Return whether a process is stopped or traced, or whether that is unknown."""
    try:
        with open(f"/proc/{pid}/stat", encoding="utf-8", errors="replace") as file:
            return file.read().rpartition(")")[2].split()[0] in "tT"
    except (OSError, IndexError):
        return True
