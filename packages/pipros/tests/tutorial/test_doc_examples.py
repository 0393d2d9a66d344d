"""Examples of the pages about the client and about tests run, with the output that the pages show."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
import yaml

from pipros.master.master import Master
from tests.support import documents
from tests.support.environments import EXAMPLES as EXAMPLE_PACKAGES
from tests.support.environments import REPOSITORY, VENV_BIN
from tests.support.processes import Processes

# Every example of the pages about Python's client runs, and prints the output shown below it.


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


# The commands of docs/guides/testing.md, run with the packages of `examples`, and the coverage of a node.
# The packages keep their names and files: a copy under other names would hide what the names cause.


CI_TEXT = documents.text_of("guides/testing.md")
GITHUB, GITLAB = (yaml.safe_load(block) for block in re.findall(r"```yaml\n(.*?)```", CI_TEXT, re.DOTALL))
VERSIONS = ["3.10", "3.11", "3.12", "3.13", "3.14"]


def steps_of_github() -> list[str]:
    return [step["run"] for step in GITHUB["jobs"]["test"]["steps"] if "run" in step]


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """Return a repository with the example packages in `src`, and the settings of coverage in the page."""
    shutil.copytree(EXAMPLE_PACKAGES, tmp_path / "src")
    settings = re.findall(r"```ini\n(.*?)```", CI_TEXT, re.DOTALL)[0]
    (tmp_path / ".coveragerc").write_text(settings)
    return tmp_path


@pytest.mark.timeout(300)
def test_the_steps_of_the_jobs_run(repository: Path) -> None:
    environment = {
        **{name: value for name, value in os.environ.items() if not name.startswith(("COV", "PYTEST"))},
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "PIPROS": "",  # it is installed already
        "ROS_HOME": str(repository / ".ros"),
    }
    steps = steps_of_github()
    assert steps == GITLAB["test"]["script"]
    for step in steps:
        done = subprocess.run(
            ["bash", "-e", "-c", step], cwd=repository, env=environment, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, text=True,
        )  # fmt: skip
        assert done.returncode == 0, f"{step}\n{done.stdout}"
    results = ElementTree.parse(repository / "results.xml").getroot()  # noqa: S314
    names = [case.get("name") for case in results.iter("testcase")]
    assert names.count("test_talker_publishing") == 1
    assert len(names) == len(set(names)) > 20
    covered = ElementTree.parse(repository / "coverage.xml").getroot()  # noqa: S314
    rates = {file.get("filename"): file.get("line-rate") for file in covered.iter("class")}
    assert rates["composiv_tryouts/scripts/composiv_talker.py"] == "1"


@pytest.mark.parametrize("versions", [
    GITHUB["jobs"]["test"]["strategy"]["matrix"]["python"], GITLAB["test"]["parallel"]["matrix"][0]["PYTHON"],
], ids=["GitHub", "GitLab"])  # fmt: skip
def test_the_jobs_use_all_supported_versions_of_python(versions: Any) -> None:
    classifiers = re.findall(
        r'"Programming Language :: Python :: (3\.\d+)"', (REPOSITORY / "pyproject.toml").read_text()
    )
    assert versions == classifiers == VERSIONS
