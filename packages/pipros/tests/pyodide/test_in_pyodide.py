"""Programs and the guide about the tab in Pyodide, which is CPython for WebAssembly, under Node.js."""

import json
import re
import subprocess
from pathlib import Path
from typing import Any

import pytest

from tests.support import documents
from tests.support.browser_programs import BEGINNING, LIMITS, PROGRAMS
from tests.support.environments import REPOSITORY

pytestmark = pytest.mark.timeout(700)  # several workers may start Pyodide at the same time
BLOCKS = re.findall(r"^```python\n(.*?)^```$", documents.text_of("guides/tab.md"), re.M | re.S)


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory, pyodide_files: Path) -> dict[str, Any]:
    """The errors and the output of each program, all run by one interpreter."""
    folder = tmp_path_factory.mktemp("pyodide")
    programs = {name: BEGINNING + source for name, source in (PROGRAMS | LIMITS).items()}
    programs["page"] = "\n".join(BLOCKS)
    Path(folder, "programs.json").write_text(json.dumps(programs))
    runner = REPOSITORY / "packages/pipros/tests/pyodide/run.mjs"
    ended = subprocess.run(
        ["node", runner, pyodide_files, folder / "programs.json"],
        stdout=subprocess.PIPE,
        text=True,
        timeout=600,
        check=True,
    )
    return dict(json.loads(ended.stdout))


@pytest.mark.parametrize("name", [*PROGRAMS, *LIMITS])
def test_a_program_runs(name: str, results: dict[str, Any]) -> None:
    assert results[name]["error"] == ""


def test_the_page_prints_its_results(results: dict[str, Any]) -> None:
    page = results["page"]
    assert page["error"] == ""
    assert "9f195f881246fdfa2798d1d3eebca84a" in page["printed"]
    assert "example.bag 5 messages" in page["printed"]
    assert 'data: "hello 1"' in page["printed"]
