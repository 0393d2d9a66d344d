"""Suggest replacements for modules that Noetic's scripts import but that are not installed."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from importlib.abc import Loader
from importlib.machinery import ModuleSpec
from types import FrameType, ModuleType

_EM = "{} is not installed. Noetic's scripts and templates need empy 3: "
_QT = "{} is not installed: pipros shows no Qt plugins."

_REASONS: Mapping[str, str] = {
    "em": _EM,
    **dict.fromkeys(("python_qt_binding", "qt_gui", "rqt_gui", "rqt_gui_py", "rqt_py_common"), _QT),
}


_DEFINITIONS = ("_msgs", "_srvs")
"""Endings of the names of packages that contain definitions only."""


class _AbsentLoader(Loader):
    """Loader that raises ImportError for a module."""

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        if advice := _advice(spec.name):
            raise ModuleNotFoundError(f"No module named '{spec.name}': {advice}", name=spec.name)
        reason = _REASONS[spec.name].format(spec.name)
        if spec.name == "em":
            from pipros.basics.extras import install_command

            reason += install_command("templates")
        else:
            from pipros.basics.plugins import offered

            reason += offered("rqt_modules") or ""
        raise ModuleNotFoundError(reason, name=spec.name)

    def exec_module(self, module: ModuleType) -> None:
        """Required by `Loader`, but never called, because `create_module` always raises."""


class _HiddenLoader(_AbsentLoader):
    """Loader that raises ImportError for a module in an installed package that a workspace hides."""

    def __init__(self, package: str, folder: str) -> None:
        self._package = package
        self._folder = folder

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        raise ModuleNotFoundError(
            f"No module named '{spec.name}': {self._folder} hides the installed package {self._package}, and "
            "has no such module",
            name=spec.name,
        )


def hidden_spec(name: str, package: str, folder: str) -> ModuleSpec:
    """Return a spec whose import fails, because `folder` hides the package that contains the module."""
    return ModuleSpec(name, _HiddenLoader(package, folder))


def absent_spec(name: str) -> ModuleSpec | None:
    """Return a spec whose import fails with advice, or None for other modules.

    It is also None for programs that only ask whether the module is there (`importlib.util.find_spec`).
    """
    if (name in _REASONS or _advice(name)) and _is_import():
        return ModuleSpec(name, _AbsentLoader())
    return None


def _advice(name: str) -> str | None:
    """Return the advice on a ROS package, or None if the module is not known to belong to one."""
    if name in _REASONS:
        return None
    from pipros.basics.plugin_folders import PREFIX
    from pipros.packages.well_known import advice_on, why_not_here

    if name.startswith(PREFIX):
        from pipros.basics.plugin_table import why_no_module

        return why_no_module(name)
    return advice_on(name) if name.endswith(_DEFINITIONS) or _asks_for_types(name) else why_not_here(name)


def _asks_for_types(package: str) -> bool:
    """Return whether messages or services of the package are imported, as in `import robot.msg`."""
    frame: FrameType | None = sys._getframe()
    while frame is not None:
        if frame.f_code.co_name == "_find_and_load_unlocked":
            asked = frame.f_locals.get("name")
            if asked != package:
                return asked in (f"{package}.msg", f"{package}.srv")
        frame = frame.f_back
    return False


def _is_import() -> bool:
    """Return whether an import statement, and not `find_spec`, looks for the module."""
    frame: FrameType | None = sys._getframe()
    while frame is not None and frame.f_code.co_name != "_find_and_load_unlocked":
        if frame.f_globals.get("__name__") == "importlib.util":
            return False
        frame = frame.f_back
    return frame is not None
