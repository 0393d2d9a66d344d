"""Every program, subcommand and long option that the documentation writes in a command exists."""

import re
import subprocess
from collections import defaultdict
from collections.abc import Iterator
from itertools import takewhile

from pipros_tools.cli.complete.options import words_after
from tests.support import documents
from tests.support.environments import REPOSITORY, VENV_BIN

PAGES = {"README.md": REPOSITORY / "README.md", **documents.pages()}
PROGRAMS = re.compile(r"(?:pipros|catkin|ros(?!2)|rqt|rviz)[\w-]*")
OPTION = re.compile(r"(?<![\w-])--[a-z][\w-]*")
# Programs that pass their arguments on.
PASSING = {"rosrun", "roslaunch-complete"}
# The number of words that name a subcommand, if more than one.
DEPTHS = {"fleet": 3}
# Options that no help lists, with the reason.
UNLISTED = {
    ("roslaunch", "--child"): "for the launcher on another machine",
    ("rosparam", "--ros2"): "the help is that of the genuine program",
    ("pipros", "--once"): "an option of pipros ros2 echo",
}


def commands(text: str) -> Iterator[list[str]]:
    """Yield the words of each command in blocks and in code within sentences."""
    spans = re.findall(r"(?<!`)`([^`\n]+)`", re.sub(r"```.*?```", "", text, flags=re.DOTALL))
    blocks = re.findall(r"^```(?:sh|bash|console|text)\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    lines = [line.removeprefix("$ ") for block in blocks for line in block.splitlines()]
    for line in (*spans, *lines):
        for part in re.split(r"&&|\|\||[|;]|\$\(|#", line):
            words = [word.strip("\"'()[]") for word in part.split()]
            while words and re.fullmatch(r"[A-Z_]+=\S*", words[0]):
                words.pop(0)
            if words and PROGRAMS.fullmatch(words[0]) and (VENV_BIN / words[0]).exists():
                yield words


def written() -> dict[tuple[str, ...], dict[str, str]]:
    """Return the pages of each option, by program and subcommands."""
    found: dict[tuple[str, ...], dict[str, str]] = defaultdict(dict)
    for page, file in PAGES.items():
        for program, *words in commands(file.read_text()):
            if program in PASSING:
                continue
            depth = DEPTHS.get(words[0], 1) if words and words_after(program) else 0
            subcommands = takewhile(re.compile(r"[a-z][a-z0-9-]*").fullmatch, words[:depth])
            options = found[(program, *subcommands)]
            for word in words:
                if match := OPTION.match(word):
                    options.setdefault(match[0], page)
    return found


def test_the_commands_of_the_documentation_exist_with_their_options() -> None:
    missing = []
    for (program, *subcommands), options in written().items():
        known = words_after(program)
        if subcommands and subcommands[0] not in known:
            missing.append(f"{program} {' '.join(subcommands)}: {sorted(set(options.values()))}")
            continue
        if not options:
            continue
        helped = subprocess.run(
            [VENV_BIN / program, *subcommands, "--help"], capture_output=True, text=True, timeout=60,
            check=False,
        )  # fmt: skip
        listed = set(OPTION.findall(helped.stdout + helped.stderr)) | {"--help"}
        missing += [
            f"{program} {' '.join(subcommands)} {option}: {page}"
            for option, page in options.items()
            if option not in listed and (program, option) not in UNLISTED
        ]
    assert missing == []
