"""Every command behaves as its genuine counterpart did when the transcripts were recorded."""

import contextlib
import importlib
import io
import logging
import os
import shutil
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from difflib import unified_diff
from pathlib import Path

import pytest

from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.node import Node
from tests.golden.cli.scenes import MASKS, graph_for, needs_sources
from tests.golden.cli.sources import messages, services
from tests.golden.cli.transcript import Command, Outcome, mask_outcome, render, split

HERE = Path(__file__).parent


def run(command: Command, folder: Path) -> Outcome:
    """Run a command of pipros inside this process."""
    program, *arguments = command.argv
    if program == "cat":
        return Outcome((folder / arguments[0]).read_text())
    main = importlib.import_module(f"pipros_tools.cli.{program.replace('-', '_')}").main
    stdout, stderr = io.StringIO(), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(stdout), redirect_stderr(stderr):
        patch.chdir(folder)
        for name, value in command.environment.items():
            patch.setenv(name, value)
        text = (folder / command.stdin_file).read_text() if command.stdin_file else ""
        patch.setattr("sys.stdin", io.StringIO(text))
        try:
            code = main(arguments)
        except SystemExit as end:
            code = end.code
    return Outcome(stdout.getvalue(), stderr.getvalue(), code)


@contextlib.contextmanager
def sources_for(transcript: str, master_uri: str) -> Iterator[None]:
    """Start a node of pipros that publishes the messages of a transcript about messages."""
    if not needs_sources(transcript):
        yield
        return
    quiet = logging.Logger("source", logging.CRITICAL)  # some services fail on purpose
    with Node("source", environment=Environment(master_uri=master_uri), log=quiet) as node:
        for topic, message in messages().items():
            node.advertise(topic, type(message), latch=True).publish(message)
        for service, (service_class, handler) in services().items():
            node.serve(service, service_class, handler)
        yield


@pytest.mark.parametrize("name", sorted(path.stem for path in (HERE / "transcripts").glob("*.txt")))
def test_commands_behave_like_the_recorded_genuine_ones(name: str, tmp_path, monkeypatch) -> None:
    folder = shutil.copytree(HERE / "files", tmp_path / "work")
    transcript = (HERE / "transcripts" / f"{name}.txt").read_text()
    masks = {str(folder): "FOLDER", os.uname().nodename: "HOST", **MASKS}
    with Master(port=0) as master, graph_for(transcript, master.uri), sources_for(transcript, master.uri):
        monkeypatch.setenv("ROS_MASTER_URI", master.uri)
        monkeypatch.setenv("ROS_IP", "127.0.0.1")
        monkeypatch.setenv("COLUMNS", "80")
        blocks = []
        for block, line in split(transcript):
            if line is None:
                blocks.append(block)
                continue
            command = Command.parse(line)
            outcome = mask_outcome(run(command, folder), masks)
            blocks.append(_as_recorded(block, command, outcome))
    assert difference(transcript, "".join(blocks)) == ""


def difference(recorded: str, now: str) -> str:
    """Return the lines that differ, with context; pytest truncates long texts too early."""
    return "\n".join(unified_diff(recorded.splitlines(), now.splitlines(), "genuine", "pipros", lineterm=""))


def _as_recorded(block: str, command: Command, outcome: Outcome) -> str:
    """Return the block for the outcome. In place of a traceback, one line with the reason is accepted."""
    breakdown = [line for line in block.splitlines() if line.startswith("!! ")]
    says_why = outcome.stderr.count("\n") == 1 and outcome.stderr.endswith("\n")
    return render(command, outcome, breakdown[0] if breakdown and says_why else None)
