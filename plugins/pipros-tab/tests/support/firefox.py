"""The tab's case study in Debian's Firefox: `python -m tests.support.firefox`, run by `script/long firefox`.

Firefox is downloaded with apt into a new folder, and driven by its own Marionette.
"""

from __future__ import annotations

import functools
import json
import os
import re
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from http.server import ThreadingHTTPServer
from pathlib import Path
from typing import Any, Final

from tests.pyodide.test_tab_page import PACKAGE, Files
from tests.support.case_study import (
    create_message,
    make_workspace_and_package,
    write_nodes_test_and_launch_file,
)
from tests.support.environments import REPOSITORY
from tests.support.ports import ClaimedPort
from tests.tutorial.words import HEARD, LISTENER, ROSTEST, SAID, TALKER

LIMIT_S: Final = 240.0
STARTED_S: Final = 60.0
TERMINAL: Final = "document.querySelectorAll('.terminal')[arguments[0]]"
SCREEN: Final = f"""return [...{TERMINAL}.querySelector('.screen').children]
.map((line) => line.textContent).join('\\n')"""
TYPE: Final = f"""const input = {TERMINAL}.querySelector('.entry input');
if (arguments[1] !== null) input.value = arguments[1];
input.dispatchEvent(new KeyboardEvent('keydown', {{...arguments[2], bubbles: true}}));"""
WRITE: Final = """window.prompt = () => arguments[0];
document.getElementById('new-file').click();
const { view } = document.querySelector('.cm-content').cmTile.root;
view.dispatch({changes: {from: 0, to: view.state.doc.length, insert: arguments[1]}});
document.getElementById('save').click();
document.getElementById('close').click();"""
FRAME: Final = "return document.querySelector('iframe')?.contentDocument?.body?.innerText ?? ''"


class Firefox:
    """A client of Marionette."""

    def __init__(self, folder: Path) -> None:
        """Download Firefox to the folder, and start it."""
        run = functools.partial(subprocess.run, check=True, cwd=folder, stderr=subprocess.DEVNULL)
        run(["apt-get", "-q", "download", "firefox-esr"], stdout=subprocess.DEVNULL)
        (package,) = folder.glob("*.deb")
        run(["dpkg-deb", "-x", package, "root"])
        port = ClaimedPort().number
        profile = folder / "profile"
        profile.mkdir()
        settings = {"marionette.port": port, "datareporting.policy.dataSubmissionEnabled": False}
        lines = [f"user_pref({json.dumps(name)}, {json.dumps(value)});\n" for name, value in settings.items()]
        (profile / "user.js").write_text("".join(lines))
        program = folder / "root/usr/lib/firefox-esr/firefox-esr"
        command = [str(program), "--headless", "--no-remote", "--marionette", "--profile", str(profile)]
        with (folder / "log.txt").open("w") as log:
            variables = {**os.environ, "HOME": str(profile)}
            self._process = subprocess.Popen(command, stdout=log, stderr=log, env=variables)
        end_s = time.monotonic() + STARTED_S
        while True:
            try:
                self._stream = socket.create_connection(("127.0.0.1", port)).makefile("rwb")
                break
            except OSError:
                if time.monotonic() > end_s or self._process.poll() is not None:
                    raise
                time.sleep(0.3)
        self._number = 0
        self._receive()
        self.call("WebDriver:NewSession")

    def _receive(self) -> Any:
        size = b""
        while not size.endswith(b":"):
            size += self._stream.read(1)
        return json.loads(self._stream.read(int(size[:-1])))

    def call(self, name: str, **parameters: object) -> Any:
        """Send a command, and return its result.

        Raises:
            RuntimeError: it failed.
        """
        self._number += 1
        body = json.dumps([0, self._number, name, parameters]).encode()
        self._stream.write(b"%d:%s" % (len(body), body))
        self._stream.flush()
        *_, error, value = self._receive()
        if error:
            raise RuntimeError(f"{error['error']}: {error['message']}")
        return value

    def script(self, code: str, *arguments: object) -> Any:
        """Run JavaScript in the page, and return its value."""
        return self.call("WebDriver:ExecuteScript", script=code, args=arguments, sandbox=None)["value"]

    def close(self) -> None:
        self._stream.close()
        self._process.terminate()
        self._process.wait()


def until(look: Callable[[], Any], what: str) -> None:
    end_s = time.monotonic() + LIMIT_S
    while not look():
        if time.monotonic() > end_s:
            raise SystemExit(f"not within {LIMIT_S:.0f} s: {what}")
        time.sleep(0.2)


class Terminal:
    """A terminal of the page, as `tests.support.case_study` uses one."""

    def __init__(self, firefox: Firefox, number: int = 0) -> None:
        self._firefox, self._number = firefox, number

    def screen(self) -> str:
        return str(self._firefox.script(SCREEN, self._number))

    def has_prompt(self) -> bool:
        return "$" in str(
            self._firefox.script(f"return {TERMINAL}?.querySelector('.entry').innerText", self._number)
        )

    def begin(self, line: str) -> None:
        """Type a line once there is a prompt."""
        until(self.has_prompt, f"a prompt for {line}")
        self._firefox.script(TYPE, self._number, line, {"key": "Enter"})
        print(f"terminal {self._number + 1}$ {line}", flush=True)

    def interrupt(self) -> None:
        self._firefox.script(TYPE, self._number, None, {"key": "c", "ctrlKey": True})

    def shows(self, pattern: str) -> None:
        until(lambda: re.search(pattern, self.screen()), f"{pattern} in {self.screen()}")

    def run(self, line: str) -> tuple[int, str]:
        """Type a line. Return its exit code and what it printed."""
        self.begin(f"{line}; echo code=$?")
        until(self.has_prompt, f"the end of {line}")
        printed = self.screen().rpartition(f"$ {line}; echo code=$?\n")[2].rpartition("code=")
        return int(printed[2].split()[0]), printed[0]


class TypedFile:
    """A file or folder of the page, as `tests.support.case_study` uses a path."""

    def __init__(self, terminal: Terminal, firefox: Firefox, path: str) -> None:
        self._terminal, self._firefox, self._path = terminal, firefox, path

    def __truediv__(self, name: str) -> TypedFile:
        return TypedFile(self._terminal, self._firefox, f"{self._path}/{name}")

    def read_text(self) -> str:
        return self._terminal.run(f"cat ~/{self._path}")[1]

    def write_text(self, text: str) -> None:
        self._firefox.script(WRITE, self._path, text)


def run_case_study(firefox: Firefox) -> None:
    """Type the case study, then reload, talk, and draw the graph."""
    terminals: list[Any] = [Terminal(firefox, number) for number in range(3)]
    first, second, third = terminals
    package: Any = TypedFile(first, firefox, PACKAGE)
    make_workspace_and_package(first)
    create_message(first, package)
    write_nodes_test_and_launch_file(first, package)
    code, report = first.run(ROSTEST)
    assert code == 0, report
    first.run("echo source ~/" + PACKAGE.partition("/src/")[0] + "/devel/setup.bash > ~/.bashrc")
    time.sleep(2)  # the files are kept
    firefox.call("WebDriver:Refresh")
    first.begin("roscore")
    first.shows("started core service")
    second.begin(TALKER)
    second.shows(SAID)
    third.begin(LISTENER)
    third.shows(HEARD)
    before = time.monotonic()
    third.interrupt()
    until(third.has_prompt, "the end of the listener")
    print(f"the listener ended within {time.monotonic() - before:.1f} s of Ctrl-C")
    third.begin("rqt_graph &")
    frames = (
        "return [...document.querySelectorAll('iframe')].map((e) => e.contentDocument.body.innerText).join()"
    )
    until(lambda: "/talker_node" in firefox.script(frames), "the node in rqt_graph")


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        subprocess.run(
            [sys.executable, REPOSITORY / "plugins/pipros-tab/tests/support/pyodide_files.py",
                folder / "page", "--tab"],
            check=True,
        )  # fmt: skip
        handler = functools.partial(Files, directory=str(folder / "page"))
        server = ThreadingHTTPServer(("127.0.0.1", 0), handler)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        firefox = Firefox(folder)
        try:
            firefox.call("WebDriver:Navigate", url=f"http://localhost:{server.server_address[1]}/")
            print(firefox.script("return navigator.userAgent"))
            run_case_study(firefox)
            print("the case study passed")
        finally:
            firefox.close()
            server.shutdown()


if __name__ == "__main__":
    main()
