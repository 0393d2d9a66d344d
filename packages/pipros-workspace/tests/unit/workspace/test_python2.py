"""Scripts for Python 2 are recognised, with advice that converts them; scripts for Python 3 never are."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipros_workspace.python2 import python2_advice
from tests.support.environments import SOURCES, files_below

TABS = "def f():\n    if True:\n\treturn 1\n        return 2\n"


@pytest.mark.parametrize("text", [
    "print 'hello'\n", 'import rospy\nprint "x = %d" % 3\n',
    "import sys\nprint >>sys.stderr, 1\nprint 1\n",
    "try:\n    f()\nexcept ValueError, error:\n    pass\n", "raise ValueError, 'x'\n",
    "if 1 <> 2: pass\n", "x = `1`\n", "import os\nos.chmod('x', 0755)\n",
])  # fmt: skip
def test_python_2_is_recognised(tmp_path: Path, text: str) -> None:
    script = tmp_path / "script.py"
    script.write_text(text)
    advice = python2_advice(script)
    assert advice is not None
    assert "is Python 2" in advice
    assert f"python -m fissix -w {script}" in advice
    assert "expand" not in advice


def test_a_script_of_a_devel_space_stands_for_the_one_that_it_runs(tmp_path: Path) -> None:
    script, relay = tmp_path / "src" / "script.py", tmp_path / "devel" / "script.py"
    for file, text in ((script, "print 'x'\n"), (relay, f"script = {str(script)!r}\n")):
        file.parent.mkdir()
        file.write_text(text)
    assert f"{script}:1 is Python 2" in (python2_advice(relay) or "")


def test_tabs_are_converted_first(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(TABS)
    assert "mixes tabs and spaces" in (python2_advice(script) or "")
    script.write_text(TABS + "print 'x'\n")
    advice = python2_advice(script) or ""
    assert advice.index("expand -t 8") < advice.index("fissix")


@pytest.mark.parametrize("text", ["print('x')\n", "print ('x')\n", "def f(:\n", "x = '<>'\n", "\tprint(1)\n"])
def test_python_3_gets_no_advice(tmp_path: Path, text: str) -> None:
    script = tmp_path / "script.py"
    script.write_text(text)
    assert python2_advice(script) is None


def test_no_script_of_this_tree_gets_advice() -> None:
    scripts = [file for folder in SOURCES for file in files_below(folder, "*.py")]
    assert len(scripts) > 500
    assert [file for file in scripts if python2_advice(file)] == []
