"""`rviz --png`: writes a picture of the scene, drawn by headless Chromium.

Chromium is controlled over a pair of pipes (`--remote-debugging-pipe`) with JSON requests and responses, each
terminated by a zero byte. This requires neither a port nor a library.
"""

from __future__ import annotations

import base64
import contextlib
import json
import math
import os
import select
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

from pipros.basics.posix import user_id
from pipros.basics.replaced_file import write_whole
from pipros.basics.windows import ON_WINDOWS
from pipros_tools.cli.runner import CommandError

PROGRAMS: Final = (
    "chromium-headless-shell",
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "microsoft-edge",
)
START_S: Final = 30.0
POLL_S: Final = 0.25
END_S: Final = 3.0
LARGEST_ANSWER: Final = 200_000_000
LARGEST_SIDE: Final = 8192
_SERVER: Final = "import sys; from pipros_page.commands.rviz import main; sys.exit(main())"
_DRAW: Final = """(([width, height]) => {
  const scene = document.querySelector(".tab-scene")?.scene;
  if (!scene?.view) return null;
  Object.assign(scene.canvas.style, { width: `${width}px`, height: `${height}px` });
  scene.draw();
  const shown = scene.all().filter((display) => display.isOn && !display.displays);
  const problems = shown.flatMap(({ name, statuses }) => [...statuses]
    .filter(([, { level }]) => level !== "ok").map(([key, { text }]) => `${name}: ${key}: ${text}`));
  const missing = scene.missing().slice(0, 100);
  return { problems: problems.slice(0, 100), missing, picture: scene.canvas.toDataURL("image/png") };
})"""


def save_picture(
    target: Path, arguments: Sequence[str], size: tuple[int, int], timeout_s: float
) -> tuple[list[str], list[str]]:
    """Write the scene that `rviz` shows with these arguments as a PNG.

    Return the displays' statuses other than OK, and the missing parts: meshes that are not loaded, and
    enabled displays without a message. Each list has at most 100 entries. The picture is taken as soon as
    nothing is missing, all displays are OK and two pictures in a row are equal, or `timeout_s` after the
    first picture.

    Raises:
        CommandError: none of the browsers in `PROGRAMS` is installed, the browser or the server fails, the
            file cannot be written, or the platform is Windows.
    """
    if ON_WINDOWS:
        raise CommandError("--png does not work on Windows")
    program = next(filter(None, map(shutil.which, PROGRAMS)), None)
    if program is None:
        raise CommandError(f"--png needs one of these browsers: {', '.join(PROGRAMS)}")
    with _server(arguments) as address, _Chromium(program, size) as browser:
        browser.ask("Page.navigate", {"url": address})
        show_by_s, data_by_s = time.monotonic() + START_S, math.inf
        last: Any = None
        while True:
            shown = browser.value(f"{_DRAW}({json.dumps(size)})")
            now_s = time.monotonic()
            if shown is not None:
                data_by_s = min(data_by_s, now_s + timeout_s)
                is_complete = not shown["problems"] and not shown["missing"]
                if now_s > data_by_s or (shown == last and is_complete):
                    break
            elif now_s > show_by_s:
                raise CommandError(f"the page did not show a scene within {START_S:g} s")
            last = shown
            time.sleep(POLL_S)
    try:
        write_whole(target, base64.b64decode(shown["picture"].partition(",")[2]))
    except OSError as error:
        raise CommandError(f"cannot write {target}: {error.strerror}") from None
    return list(map(str, shown["problems"])), list(map(str, shown["missing"]))


def picture_size(text: str) -> tuple[int, int]:
    """Parse `WIDTHxHEIGHT`."""
    width, _, height = text.partition("x")
    sides = [int(side) for side in (width, height) if side.isascii() and side.isdigit()]
    if len(sides) != 2 or not all(1 <= side <= LARGEST_SIDE for side in sides):
        raise CommandError(f"--size must be WIDTHxHEIGHT with sides from 1 to {LARGEST_SIDE}, got {text}")
    return sides[0], sides[1]


@contextlib.contextmanager
def _server(arguments: Sequence[str]) -> Iterator[str]:
    """Serve the page in another process until the context ends. Yield the page's address."""
    argv = [sys.executable, "-c", _SERVER, "--no-browser", "--read-only", *arguments]
    with subprocess.Popen(argv, stderr=subprocess.PIPE) as server:  # noqa: S603 - this interpreter
        try:
            output: Any = server.stderr
            ready, _, _ = select.select([output], [], [], START_S)
            line = output.readline().decode() if ready else ""
            if ": http" not in line:
                raise CommandError(f"the page's server did not start: {line.strip() or 'no output'}")
            yield line.partition(": ")[2].strip()
        finally:
            _stop(server)


class _Chromium:
    """A headless browser with one empty page."""

    def __init__(self, program: str, size: tuple[int, int]) -> None:
        self._folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        self._number = 0
        self._session: str | None = None
        self._rest = b""
        to_browser, self._requests = os.pipe()
        self._answers, from_browser = os.pipe()
        argv = [program, "--headless", "--remote-debugging-pipe", "--no-first-run", "--hide-scrollbars"]
        argv += [f"--user-data-dir={self._folder.name}", f"--window-size={size[0] + 100},{size[1] + 200}"]
        if user_id() == 0:
            argv.append("--no-sandbox")  # as root, Chromium refuses to start with its sandbox

        # Chromium reads from descriptor 3 and writes to descriptor 4.
        words = ["sh", "-c", f'exec "$@" 3<&{to_browser} 4>&{from_browser}', "sh", *argv, "about:blank"]
        self._process = subprocess.Popen(  # noqa: S603 - a browser in PATH
            words, pass_fds=(to_browser, from_browser), stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL
        )
        os.close(to_browser)
        os.close(from_browser)

    def __enter__(self) -> _Chromium:
        targets = self.ask("Target.getTargets")["targetInfos"]
        page = next((each["targetId"] for each in targets if each["type"] == "page"), None)
        if page is None:
            page = self.ask("Target.createTarget", {"url": "about:blank"})["targetId"]
        self._session = self.ask("Target.attachToTarget", {"targetId": page, "flatten": True})["sessionId"]
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._requests)
        _stop(self._process)
        os.close(self._answers)
        self._folder.cleanup()

    def value(self, expression: str) -> Any:
        """Evaluate a JavaScript expression in the page, and return its value."""
        answer = self.ask("Runtime.evaluate", {"expression": expression, "returnByValue": True})
        return answer.get("result", {}).get("value")

    def ask(self, method: str, arguments: object = None) -> Any:
        self._number += 1
        request: dict[str, Any] = {"id": self._number, "method": method, "params": arguments or {}}
        if self._session is not None:
            request["sessionId"] = self._session
        try:
            os.write(self._requests, json.dumps(request).encode() + b"\0")
            while True:
                answer = json.loads(self._next())
                if answer.get("id") == self._number:
                    break
        except OSError:
            raise CommandError("the browser exited unexpectedly") from None
        if "error" in answer:
            raise CommandError(f"the browser refused {method}: {answer['error'].get('message')}")
        return answer["result"]

    def _next(self) -> bytes:
        end_s = time.monotonic() + START_S
        while b"\0" not in self._rest:
            ready, _, _ = select.select([self._answers], [], [], max(0.0, end_s - time.monotonic()))
            if not ready:
                raise CommandError(f"the browser did not respond within {START_S:g} s")
            more = os.read(self._answers, 1_000_000)
            if not more:
                raise CommandError("the browser exited unexpectedly")
            if len(self._rest) > LARGEST_ANSWER:
                raise CommandError(f"the browser's answer is larger than {LARGEST_ANSWER} bytes")
            self._rest += more
        answer, _, self._rest = self._rest.partition(b"\0")
        return answer


def _stop(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    try:
        process.wait(END_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
