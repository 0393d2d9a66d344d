"""Every example of the pages about Python's client runs, and prints the output shown below it."""

from __future__ import annotations

import re

import pytest

from pipros.master.master import Master
from tests.support.environments import REPOSITORY, VENV_BIN
from tests.support.processes import Processes

TEXT = "".join(
    (REPOSITORY / "docs" / name).read_text() for name in ("internals/client.md", "reference/python.md")
)
EXAMPLES = re.findall(r"```python\n(.*?)```\n\n```text\n(.*?)```", TEXT, re.DOTALL)


def test_every_example_shows_its_output() -> None:
    assert len(EXAMPLES) == TEXT.count("```python") >= 6


@pytest.mark.parametrize(("code", "printed"), EXAMPLES)
def test_the_example_prints_the_output_below_it(processes: Processes, code: str, printed: str) -> None:
    with Master(port=0) as master:
        ended = processes.run(VENV_BIN / "python", "-c", code, environment={"ROS_MASTER_URI": master.uri})
    assert (ended.returncode, ended.stdout) == (0, printed.splitlines()), ended.output
