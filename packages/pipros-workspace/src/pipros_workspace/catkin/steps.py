"""A package's custom commands and targets: their command lines and dependencies.

Commands run without a shell. A command that needs a shell is left to CMake itself.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from pipros_workspace.cmake.scope import Scope, Unsupported

_LISTS = ("OUTPUT", "DEPENDS", "BYPRODUCTS", "SOURCES", "ARGS", "IMPLICIT_DEPENDS")
_ONE_VALUE = ("WORKING_DIRECTORY", "COMMENT", "MAIN_DEPENDENCY", "DEPFILE", "JOB_POOL", "TARGET")
_SWITCHES = ("ALL", "VERBATIM", "USES_TERMINAL", "APPEND", "COMMAND_EXPAND_LISTS", "POST_BUILD", "PRE_BUILD",
             "PRE_LINK", "DEPENDS_EXPLICIT_ONLY")  # fmt: skip
_SHELL_WORDS = frozenset(("||", "|", ">", ">>", "<", "2>&1", "&", ";", "2>", "&>"))


@dataclass(frozen=True, slots=True)
class BuildStep:
    """Commands that run together.

    Attributes:
        name: the target, or the first output.
        file, line: the position in a CMake file.
        outputs: the files that the commands create. A target has no outputs; its commands always run.
        commands: command lines, each with its working directory.
        depends: files and targets that must be built first.
        is_wanted: whether the step belongs to the target `all`.
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
class BuildSteps:
    """All custom commands and targets of a package.

    Attributes:
        targets: the steps of each custom target, by name.
        rules: the step that creates each output, by path.
        dependencies: the names that `add_dependencies()` lists, by target.
    """

    targets: dict[str, list[BuildStep]] = field(default_factory=dict)
    rules: dict[str, BuildStep] = field(default_factory=dict)
    dependencies: dict[str, list[str]] = field(default_factory=dict)

    def add_target(self, words: Sequence[str], scope: Scope, file: str, line: int) -> None:
        """Add the target that `add_custom_target(words)` defines.

        Raises:
            ValueError: the arguments are invalid.
            Unsupported: the target needs a shell or a generator expression.
        """
        if not words:
            raise ValueError("called with incorrect number of arguments")
        name, *rest = words
        is_wanted = rest[:1] == ["ALL"]
        # Words before the first keyword form a command.
        if rest[is_wanted:] and rest[is_wanted] not in (*_LISTS, *_ONE_VALUE, *_SWITCHES, "COMMAND"):
            rest.insert(is_wanted, "COMMAND")
        step = _read(rest, scope, BuildStep(name, file, line, is_wanted=is_wanted))
        self.targets.setdefault(name, []).append(step)

    def add_command(self, words: Sequence[str], scope: Scope, file: str, line: int) -> None:
        """Add the step that `add_custom_command(words)` defines.

        Raises:
            ValueError: the arguments are invalid.
            Unsupported: the command needs a shell or a generator expression, or it belongs to
                a target that is not a custom target.
        """
        step = _read(words, scope, BuildStep("", file, line))
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
        """Add the dependencies that `add_dependencies(words)` declares."""
        if words:
            self.dependencies.setdefault(words[0], []).extend(words[1:])


def _read(words: Sequence[str], scope: Scope, step: BuildStep) -> BuildStep:
    """Return a copy of the step, extended by the given words."""
    sections: dict[str, list[str]] = {name: [] for name in (*_LISTS, *_ONE_VALUE)}
    commands: list[list[str]] = []
    current: list[str] = []
    for word in words:
        if word == "COMMAND":
            current = []
            commands.append(current)
        elif word in sections:
            # ARGS is an obsolete keyword between a command and its arguments.
            current = sections[word] if word != "ARGS" or not commands else commands[-1]
        elif word not in _SWITCHES:
            current.append(word)
    values = {name: (sections[name] or [""])[0] for name in _ONE_VALUE}
    folder = scope.in_binary(values["WORKING_DIRECTORY"])
    lines = [line for command in commands if command for line in _without_shell(command, folder)]
    outputs = tuple(scope.in_binary(path) for path in sections["OUTPUT"])
    depends = [*sections["DEPENDS"], *filter(None, [values["MAIN_DEPENDENCY"]])]
    return replace(
        step,
        name=step.name or (outputs[0] if outputs else ""),
        outputs=outputs,
        commands=tuple(lines),
        depends=tuple(_dependency(word, scope) for word in depends),
        comment=" ".join(sections["COMMENT"]),
    )


def _without_shell(words: Sequence[str], folder: str) -> Iterable[tuple[str, tuple[str, ...]]]:
    """Yield the commands in a command line, each with its working directory.

    Of the shell's syntax, only `cd` and `&&` are supported.
    """
    line: list[str] = []
    for word in (*words, "&&"):
        if "$<" in word:
            raise Unsupported(f"the generator expression {word}")
        if word in _SHELL_WORDS:
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
    """Resolve a dependency to an existing source file, or else to a file in the build tree or a target."""
    if os.path.exists(scope.in_source(word)):
        return scope.in_source(word)
    return word if os.path.isabs(word) or "/" not in word else scope.in_binary(word)
