"""Our rosbag has every option of the genuine one, with the same letters and the same values."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.ports import ClaimedPort
from tests.support.ros import RosSystem, Side

COMMANDS = (
    *("check", "compress", "decompress", "decrypt", "encrypt", "filter", "fix", "info", "play", "record"),
    "reindex",
)
OURS = {**{name: {"--msgs"} for name in ("check", "filter", "fix", "info", "play")}, "record": {"--snapshot"}}
"""What pipros has besides."""


@pytest.fixture
def sides(claimed_port: ClaimedPort, tmp_path: Path, bare_tools: Path) -> Iterator[RosSystem]:
    system = RosSystem(claimed_port.number, tmp_path, bare_tools)
    yield system
    system.close()


def options(side: Side, *argv: str) -> dict[str, tuple[frozenset[str], bool]]:
    """Return the options of a help text by each name: all their names, and whether a value follows."""
    done = side.run(*argv, "--help")
    assert done.returncode == 0, done.output
    found = {}
    for line in done.stdout:
        match = re.match(r" {2,4}(-\S.*?)(?: {2}|$)", line)
        if match is None:
            continue
        text = match[1].replace("[ ", ", ").replace(" ]", "")  # boost writes -h [ --help ]
        text = text.replace("[=arg", "")  # --split once took a size, and still accepts one
        names = frozenset(re.findall(r"(?<![\w-])--?[A-Za-z][\w-]*", text))
        takes_value = bool(re.search(r"=[A-Z]| [A-Z]| arg", text))
        found.update(dict.fromkeys(names, (names, takes_value)))
    return found


@pytest.mark.parametrize("command", COMMANDS)
def test_the_options_of_the_command_are_those_of_genuine_rosbag(command: str, sides: RosSystem) -> None:
    genuine, ours = options(sides.genuine, "rosbag", command), options(sides.pipros, "rosbag", command)

    assert genuine
    assert {name: ours.get(name) for name in genuine} == genuine
    added = {"-L", "--min-space", "--topic"} if command == "record" else set()  # of the program record
    assert set(ours) - set(genuine) - added == OURS.get(command, set())


@pytest.mark.parametrize("program", ["play", "record"])
def test_the_options_of_the_programs_are_those_of_genuine_ones(program: str, sides: RosSystem) -> None:
    genuine, ours = (
        options(sides.genuine, f"/usr/lib/rosbag/{program}"),
        options(sides.pipros, "rosbag", program),
    )

    for several in ("--topics", "--pause-topics"):  # take words up to the next option, like genuine ones
        assert genuine.pop(several, None) or program == "record"
    assert len(genuine) > 20
    assert {name: ours.get(name) for name in genuine} == genuine
