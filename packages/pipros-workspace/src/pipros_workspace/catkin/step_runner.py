"""Run a package's outdated custom commands and targets, as make would."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from pipros.basics.env import DISTRIBUTION
from pipros_workspace.catkin.steps import BuildStep, BuildSteps
from pipros_workspace.cmake.language import CMakeError

if TYPE_CHECKING:
    from pipros.basics.printable import Say


class StepRunner:
    """Runner of targets, and of steps whose outputs are outdated. Each runs at most once.

    Attributes:
        has_run: whether any command was run.
    """

    def __init__(self, steps: BuildSteps, binary: str, variables: Mapping[str, str], say: Say) -> None:
        """Store the arguments. No step is run.

        Args:
            binary: the base folder for relative output paths.
            variables: the environment of the commands. `ROS_DISTRO` and similar variables default to Noetic's
                values.
            say: called with a line for each step that runs commands and has a comment or outputs.
        """
        self._steps = steps
        self._binary = binary
        self._variables = {**DISTRIBUTION, **variables}
        self._say = say
        self._done: set[str] = set()
        self.has_run = False

    def run_wanted(self, files: Iterable[str]) -> None:
        """Run the targets that belong to `all`, and the steps that make the given files.

        Raises:
            CMakeError: a command failed, or no step creates a missing file.
        """
        for name, steps in self._steps.targets.items():
            if any(step.is_wanted for step in steps):
                self.run(name)
        for file in files:
            if file in self._steps.rules:
                self.run(file)

    def run(self, name: str) -> bool:
        """Run a target or make a file, after its dependencies.

        Return False if the package has neither a target nor a step for an output with that name.

        Raises:
            CMakeError: a command failed, or no step creates a missing file.
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

    def _need(self, step: BuildStep) -> None:
        for needed in step.depends:
            if not self.run(needed) and os.path.isabs(needed) and not os.path.exists(needed):
                raise CMakeError(
                    step.file, step.line, "", f"No rule to make target '{needed}', needed by '{step.name}'."
                )

    def _make(self, rule: BuildStep) -> None:
        self._done.update(rule.outputs)
        self._need(rule)
        if self._is_outdated(rule):
            for output in rule.outputs:
                os.makedirs(os.path.dirname(output), exist_ok=True)
            self._carry_out(rule)

    def _is_outdated(self, rule: BuildStep) -> bool:
        try:
            made = min(os.stat(output).st_mtime_ns for output in rule.outputs)
        except OSError:
            return True
        sources = [path for path in (*rule.depends, rule.file) if os.path.isabs(path)]
        return any(os.path.exists(path) and os.stat(path).st_mtime_ns > made for path in sources)

    def _carry_out(self, step: BuildStep) -> None:
        if step.commands and (step.comment or step.outputs):
            self._say(step.comment or f"Generating {', '.join(step.outputs)}")
        for folder, command in step.commands:
            os.makedirs(folder, exist_ok=True)
            sys.stdout.flush()
            self.has_run = True
            try:
                code = subprocess.run(command, cwd=folder, env=self._variables, check=False).returncode  # noqa: S603
            except OSError as error:
                raise self._failed(step, command, f"cannot be run: {error.strerror}") from None
            if code != 0:
                raise self._failed(step, command, f"failed with exit code {code}")

    def _failed(self, step: BuildStep, command: Sequence[str], how: str) -> CMakeError:
        reason = f"the command [{' '.join(command)}] of [{step.name}] {how}"
        return CMakeError(step.file, step.line, "", reason)
