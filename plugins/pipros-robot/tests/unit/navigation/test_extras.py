"""What a node says if the import of one of its libraries fails."""

from __future__ import annotations

import subprocess
import sys

import pytest


@pytest.mark.parametrize("program", ["costmap.costmap", "navfn.navfn_node", "move_base.move_base_node"])
def test_a_program_without_numpy_says_so_in_one_line(program: str) -> None:
    code = (
        "import sys; sys.modules['numpy'] = sys.modules['cv2'] = None; "
        f"from pipros_robot.navigation.programs import run_program; sys.exit(run_program({program!r}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)

    assert done.returncode == 1
    assert done.stderr.startswith("ERROR: this node needs ")
    assert done.stderr.count("\n") == 1
