"""Modules of Noetic that pipros does not have."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import pipros.startup  # noqa: F401 # what pipros.pth imports

QT = ("python_qt_binding.QtWidgets", "qt_gui.plugin", "rqt_gui.main", "rqt_gui_py.plugin", "rqt_py_common")


def failed_import(module: str, folder: Path) -> str:
    """Return the last line of the output of a program that imports a module found only in `folder`."""
    hide_em = "import sys; sys.path = [p for p in sys.path if not p.endswith('-packages')]; "
    ended = subprocess.run(
        [sys.executable, "-c", f"{hide_em}import {module}"],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert ended.returncode == (1 if ended.stderr else 0)
    return ended.stderr.strip().rpartition("\n")[2]


@pytest.mark.parametrize("module", QT)
def test_importing_a_qt_plugin_names_the_alternative(module: str, tmp_path: Path) -> None:
    name = module.partition(".")[0]
    assert failed_import(module, tmp_path) == (
        f"ModuleNotFoundError: {name} is not installed: pipros shows no Qt plugins. Its rqt is a page in the "
        "browser: rqt_graph, rqt_plot, rqt_console, rqt_image_view, rqt_reconfigure, rqt_tf_tree and others"
    )


def test_importing_em_names_the_extra(tmp_path: Path) -> None:
    assert failed_import("em", tmp_path).endswith("pip install 'pipros[templates]'")


def test_a_module_that_is_installed_is_imported(tmp_path: Path) -> None:
    (tmp_path / "em.py").touch()
    (tmp_path / "qt_gui").mkdir()
    (tmp_path / "qt_gui/__init__.py").touch()
    (tmp_path / "qt_gui/plugin.py").touch()
    assert failed_import("em, qt_gui.plugin", tmp_path) == ""


def test_a_script_works_without_the_module() -> None:
    with pytest.raises(ModuleNotFoundError, match="python_qt_binding") as error:
        import python_qt_binding  # type: ignore[import-not-found] # noqa: F401
    assert error.value.name == "python_qt_binding"
