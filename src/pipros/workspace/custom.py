"""Custom commands and targets of a `CMakeLists.txt`: what they run, and the running of it, as make would.

No shell is used. What would need one is left to the real CMake.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from pipros.workspace.cmake.language import CMakeError
from pipros.workspace.cmake.scope import Scope, Unsupported

Say = Callable[[str], None]

_LISTS = ("OUTPUT", "DEPENDS", "BYPRODUCTS", "SOURCES", "ARGS", "IMPLICIT_DEPENDS")
_ONE_VALUE = ("WORKING_DIRECTORY", "COMMENT", "MAIN_DEPENDENCY", "DEPFILE", "JOB_POOL", "TARGET")
_SWITCHES = ("ALL", "VERBATIM", "USES_TERMINAL", "APPEND", "COMMAND_EXPAND_LISTS", "POST_BUILD", "PRE_BUILD",
             "PRE_LINK", "DEPENDS_EXPLICIT_ONLY")  # fmt: skip
_OF_A_SHELL = frozenset(("||", "|", ">", ">>", "<", "2>&1", "&", ";", "2>", "&>"))


@dataclass(frozen=True, slots=True)
class Step:
    """Commands that belong together.

    Attributes:
        name: the target, or the first file made.
        outputs: the files that the commands make; none for a target, whose commands run each time.
        commands: command lines, each with the folder that it runs in.
        depends: files and targets that are needed first.
        file, line: where the step is written.
        is_wanted: whether it belongs to what is always built.
    """

    name: str
    file: str
    line: int
    outputs: tuple[str, ...] = ()
    commands: tuple[tuple[str, tuple[str, ...]], ...] = ()
    depends: tuple[str, ...] = ()
    comment: str = ""
    is_wanted: bool = False


@dataclass(slots=True)
class Steps:
    """All custom commands and targets of a package."""

    targets: dict[str, list[Step]] = field(default_factory=dict)
    rules: dict[str, Step] = field(default_factory=dict)
    dependencies: dict[str, list[str]] = field(default_factory=dict)

    def add_target(self, words: Sequence[str], scope: Scope, file: str, line: int) -> None:
        """Notes `add_custom_target(words)`.

        Raises:
            ValueError: the words make no sense.
            Unsupported: it needs a shell, or what only the real CMake knows.
        """
        if not words:
            raise ValueError("called with incorrect number of arguments")
        name, *rest = words
        is_wanted = rest[:1] == ["ALL"]
        # Words before the first keyword are a command.
        if rest[is_wanted:] and rest[is_wanted] not in (*_LISTS, *_ONE_VALUE, *_SWITCHES, "COMMAND"):
            rest.insert(is_wanted, "COMMAND")
        step = _read(rest, scope, Step(name, file, line, is_wanted=is_wanted))
        self.targets.setdefault(name, []).append(step)

    def add_command(self, words: Sequence[str], scope: Scope, file: str, line: int) -> None:
        """Notes `add_custom_command(words)`.

        Raises:
            ValueError: the words make no sense.
            Unsupported: it needs a shell, or what only the real CMake knows.
        """
        step = _read(words, scope, Step("", file, line))
        if "TARGET" in words[:-1]:
            name = words[words.index("TARGET") + 1]
            if name not in self.targets:
                raise Unsupported(f"add_custom_command(TARGET {name})")
            self.targets[name].append(step)
            return
        if not step.outputs:
            raise ValueError("called with neither OUTPUT nor TARGET")
        for output in step.outputs:
            self.rules[output] = step

    def add_dependencies(self, words: Sequence[str]) -> None:
        """Notes `add_dependencies(words)`."""
        if words:
            self.dependencies.setdefault(words[0], []).extend(words[1:])


def _read(words: Sequence[str], scope: Scope, step: Step) -> Step:
    sections: dict[str, list[str]] = {name: [] for name in (*_LISTS, *_ONE_VALUE)}
    commands: list[list[str]] = []
    current: list[str] = []
    for word in words:
        if word == "COMMAND":
            current = []
            commands.append(current)
        elif word in sections:
            # ARGS is an old word between a command and its arguments.
            current = sections[word] if word != "ARGS" or not commands else commands[-1]
        elif word not in _SWITCHES:
            current.append(word)
    one = {name: (sections[name] or [""])[0] for name in _ONE_VALUE}
    folder = scope.in_binary(one["WORKING_DIRECTORY"])
    lines = [line for command in commands if command for line in _without_shell(command, folder)]
    outputs = tuple(scope.in_binary(path) for path in sections["OUTPUT"])
    depends = [*sections["DEPENDS"], *filter(None, [one["MAIN_DEPENDENCY"]])]
    return Step(
        step.name or (outputs[0] if outputs else ""),
        step.file,
        step.line,
        outputs,
        tuple(lines),
        tuple(_dependency(word, scope) for word in depends),
        " ".join(sections["COMMENT"]),
        step.is_wanted,
    )


def _without_shell(words: Sequence[str], folder: str) -> Iterable[tuple[str, tuple[str, ...]]]:
    """The commands of a line, with the folder that each runs in; `cd` and `&&` are understood."""
    line: list[str] = []
    for word in (*words, "&&"):
        if "$<" in word:
            raise Unsupported(f"the generator expression {word}")
        if word in _OF_A_SHELL:
            raise Unsupported(f"the shell that [{' '.join(words)}] needs")
        if word != "&&":
            line.append(word)
        elif line[:1] == ["cd"] and len(line) == 2:
            folder = os.path.join(folder, line[1])
            line = []
        elif line:
            yield folder, tuple(line)
            line = []


def _dependency(word: str, scope: Scope) -> str:
    """A file by its absolute path; what is none where files are read may be made, or is a target."""
    if os.path.exists(scope.in_source(word)):
        return scope.in_source(word)
    return word if os.path.isabs(word) or "/" not in word else scope.in_binary(word)


class StepRunner:
    """Runs what is out of date, each step once.

    Attributes:
        has_run: whether any command was run.
    """

    def __init__(self, steps: Steps, binary: str, variables: Mapping[str, str], say: Say) -> None:
        """Nothing is run yet.

        Args:
            binary: the folder in which files are made whose paths are not absolute.
            variables: the environment of commands.
        """
        self._steps = steps
        self._binary = binary
        self._variables = variables
        self._say = say
        self._done: set[str] = set()
        self.has_run = False

    def run_wanted(self, files: Iterable[str]) -> None:
        """Runs the targets that are always built, and what makes the files given.

        Raises:
            CMakeError: a command failed, or a file is missing that nothing makes.
        """
        for name, steps in self._steps.targets.items():
            if any(step.is_wanted for step in steps):
                self.run(name)
        for file in files:
            if file in self._steps.rules:
                self.run(file)

    def run(self, name: str) -> bool:
        """Runs a target, or makes a file; False when it is neither of this package's.

        Raises:
            CMakeError: a command failed, or a file is missing that nothing makes.
        """
        path = os.path.join(self._binary, name)
        if name not in self._steps.targets and name not in self._steps.rules and path in self._steps.rules:
            name = path
        if name in self._done:
            return True
        self._done.add(name)
        for needed in self._steps.dependencies.get(name, ()):
            self.run(needed)
        if name in self._steps.rules:
            self._make(self._steps.rules[name])
            return True
        for step in self._steps.targets.get(name, ()):
            self._need(step)
            self._carry_out(step)
        return name in self._steps.targets

    def _need(self, step: Step) -> None:
        for needed in step.depends:
            if not self.run(needed) and os.path.isabs(needed) and not os.path.exists(needed):
                raise CMakeError(
                    step.file, step.line, "", f"No rule to make target '{needed}', needed by '{step.name}'."
                )

    def _make(self, rule: Step) -> None:
        self._done.update(rule.outputs)
        self._need(rule)
        if self._is_outdated(rule):
            for output in rule.outputs:
                os.makedirs(os.path.dirname(output), exist_ok=True)
            self._carry_out(rule)

    def _is_outdated(self, rule: Step) -> bool:
        try:
            made = min(os.stat(output).st_mtime_ns for output in rule.outputs)
        except OSError:
            return True
        sources = [path for path in (*rule.depends, rule.file) if os.path.isabs(path)]
        return any(os.path.exists(path) and os.stat(path).st_mtime_ns > made for path in sources)

    def _carry_out(self, step: Step) -> None:
        if step.commands and (step.comment or step.outputs):
            self._say(step.comment or f"Generating {', '.join(step.outputs)}")
        for folder, command in step.commands:
            os.makedirs(folder, exist_ok=True)
            sys.stdout.flush()
            self.has_run = True
            try:
                code = subprocess.run(command, cwd=folder, env=dict(self._variables), check=False).returncode  # noqa: S603
            except OSError as error:
                raise self._failed(step, command, f"cannot be run: {error.strerror}") from None
            if code != 0:
                raise self._failed(step, command, f"failed with exit code {code}")

    def _failed(self, step: Step, command: Sequence[str], how: str) -> CMakeError:
        reason = f"the command [{' '.join(command)}] of [{step.name}] {how}"
        return CMakeError(step.file, step.line, "", reason)
