"""Modules of Noetic that pipros does not have."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import pipros.startup  # noqa: F401 # what pipros.pth imports

QT = ("python_qt_binding.QtWidgets", "qt_gui.plugin", "rqt_gui.main", "rqt_gui_py.plugin", "rqt_py_common")


IMPORT_EACH = """
import sys
from importlib import import_module
sys.path = [path for path in sys.path if not path.endswith('-packages')]  # hides em
for name in sys.argv[1:]:
    try:
        import_module(name)
        print("imported")
    except ImportError as error:
        print(f"{type(error).__name__}: {error}")
"""


def imports(folder: Path, *modules: str) -> list[str]:
    """Return the errors of a program in a folder that imports each module, or `imported`."""
    command = [sys.executable, "-c", IMPORT_EACH, *modules]
    ended = subprocess.run(command, cwd=folder, stdout=subprocess.PIPE, text=True, timeout=60, check=True)
    return ended.stdout.splitlines()


def test_imports_of_modules_that_are_absent_name_the_alternative(tmp_path: Path) -> None:
    *of_qt, of_em = imports(tmp_path, *QT, "em")
    assert of_em.endswith("pip install 'pipros[templates]'")
    advice = (
        "pipros shows no Qt plugins. Its rqt is a page in the browser: rqt_graph, rqt_plot, rqt_console, "
        "rqt_image_view, rqt_reconfigure, rqt_tf_tree and others"
    )
    names = [module.partition(".")[0] for module in QT]
    assert of_qt == [f"ModuleNotFoundError: {name} is not installed: {advice}" for name in names]


def test_a_module_that_is_installed_is_imported(tmp_path: Path) -> None:
    (tmp_path / "qt_gui").mkdir()
    for name in ("em.py", "qt_gui/__init__.py", "qt_gui/plugin.py"):
        (tmp_path / name).touch()
    assert imports(tmp_path, "em", "qt_gui.plugin") == ["imported"] * 2


def test_a_script_works_without_the_module() -> None:
    with pytest.raises(ModuleNotFoundError, match="python_qt_binding") as error:
        import python_qt_binding  # type: ignore[import-not-found] # noqa: F401
    assert error.value.name == "python_qt_binding"
