"""Record the transcripts again on genuine ROS 1: python3 packages/pipros/tests/golden/cli/record.py [NAME…]

Needs genuine ROS 1 in /usr (CONTRIBUTING.md says which packages). Every transcript gets its own
master, folder and graph.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from xmlrpc.client import ServerProxy

HERE = Path(__file__).resolve().parent
DEADLINE_S = 8
sys.path.insert(0, str(HERE.parents[2]))

from tests.golden.cli.scenes import MASKS, graph_for, needs_sources  # noqa: E402
from tests.golden.cli.transcript import Command, Outcome, mask_outcome, render, split  # noqa: E402


@contextlib.contextmanager
def genuine_master(home: Path) -> Iterator[dict[str, str]]:
    """Run a rosmaster of genuine ROS on a free port; yield the environment of its tools."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    environment = {
        "PATH": "/usr/bin:/bin", "HOME": str(home), "ROS_HOME": str(home / ".ros"), "ROS_IP": "127.0.0.1",
        "ROS_MASTER_URI": f"http://127.0.0.1:{port}", "PYTHONWARNINGS": "ignore", "COLUMNS": "80",
    }  # fmt: skip
    master = subprocess.Popen(
        ["/usr/bin/rosmaster", "--core", "-p", str(port)],
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        while True:
            with contextlib.suppress(OSError):
                ServerProxy(environment["ROS_MASTER_URI"]).getPid("/record")
                break
            time.sleep(0.05)
        yield environment
    finally:
        master.terminate()
        master.wait()


@contextlib.contextmanager
def genuine_sources(environment: dict[str, str]) -> Iterator[None]:
    """Run the publishing node, and wait until all its topics exist."""
    node = subprocess.Popen(
        ["/usr/bin/python3", HERE / "sources.py"], env=environment, stdout=subprocess.DEVNULL
    )
    try:
        with ServerProxy(environment["ROS_MASTER_URI"]) as master:
            while "/diagnostics" not in str(master.getPublishedTopics("/record", "")):
                time.sleep(0.05)
        yield
    finally:
        node.terminate()
        node.wait()


def run(command: Command, environment: dict[str, str], folder: Path) -> Outcome:
    stdin = (folder / command.stdin_file).read_bytes() if command.stdin_file else b""
    done = subprocess.run(
        command.argv,
        env={**environment, **command.environment},
        cwd=folder,
        input=stdin,
        capture_output=True,
        timeout=DEADLINE_S,
    )
    return Outcome(done.stdout.decode(), done.stderr.decode(), done.returncode)


def record(path: Path) -> None:
    """Run each command of the transcript on genuine ROS, and record its outcome."""
    with tempfile.TemporaryDirectory() as temporary:
        home, folder = Path(temporary) / "home", Path(temporary) / "work"
        home.mkdir()
        shutil.copytree(HERE / "files", folder)
        with genuine_master(home) as environment, contextlib.ExitStack() as stack:
            text = path.read_text()
            stack.enter_context(graph_for(text, environment["ROS_MASTER_URI"]))
            if needs_sources(text):
                stack.enter_context(genuine_sources(environment))
            masks = {str(folder): "FOLDER", os.uname().nodename: "HOST", **MASKS}
            blocks = []
            for block, line in split(text):
                if line is None:
                    blocks.append(block)
                    continue
                command = Command.parse(line)
                try:
                    outcome = run(command, environment, folder)
                except subprocess.TimeoutExpired as expired:
                    print(f"{path.stem}: does not end: {line}")
                    outcome = Outcome((expired.stdout or b"")[:500].decode(), code=999)
                blocks.append(render(command, mask_outcome(outcome, masks)))
    path.write_text("".join(blocks))


if __name__ == "__main__":
    wanted = sys.argv[1:]
    for transcript in sorted((HERE / "transcripts").glob("*.txt")):
        if not wanted or transcript.stem in wanted:
            print(transcript.stem)
            record(transcript)
