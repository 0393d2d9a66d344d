"""What a node says if the import of one of its libraries fails."""

from __future__ import annotations

import subprocess
import sys

import pytest

from pipros.navigation.programs import missing_extra

NUMPY = ImportError("numpy.core.multiarray failed to import")


def test_a_missing_library_is_named_with_the_command_that_installs_it() -> None:
    error = missing_extra(ModuleNotFoundError("No module named 'scipy'", name="scipy"))

    assert str(error).startswith("this node needs scipy, which is not installed. Try: ")
    assert "[navigation]" in str(error)


def test_ctrl_c_during_the_import_of_numpy_stays_ctrl_c(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "last_type", KeyboardInterrupt, raising=False)

    with pytest.raises(KeyboardInterrupt):
        missing_extra(NUMPY)


def test_a_numpy_that_cannot_be_imported_is_not_taken_for_ctrl_c(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(sys, "last_type", raising=False)

    assert "needs a library that cannot be imported: numpy.core.multiarray failed to import" in str(
        missing_extra(NUMPY)
    )


@pytest.mark.parametrize("program", ["costmap.costmap", "navfn.navfn_node", "move_base.move_base_node"])
def test_a_program_without_numpy_says_so_in_one_line(program: str) -> None:
    code = (
        "import sys; sys.modules['numpy'] = sys.modules['cv2'] = None; "
        f"from pipros.navigation.programs import run_program; sys.exit(run_program({program!r}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)

    assert done.returncode == 1
    assert done.stderr.startswith("ERROR: this node needs ")
    assert done.stderr.count("\n") == 1
