"""Suggest replacements for modules that Noetic's scripts import but that are not installed."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.abc import Loader
from importlib.machinery import ModuleSpec
from types import ModuleType

_EM = "{} is not installed. Noetic's scripts and templates need empy 3: "
_QT = "{} is not installed: pipros shows no Qt plugins."

_REASONS: Mapping[str, str] = {
    "em": _EM,
    **dict.fromkeys(("python_qt_binding", "qt_gui", "rqt_gui", "rqt_gui_py", "rqt_py_common"), _QT),
}


_PACKAGES = frozenset(("moveit_commander", "smach", "smach_ros", "smach_viewer"))
"""Modules of ROS packages. `well_known.py` has the advice on these packages."""


class _AbsentLoader(Loader):
    """Loader that raises ImportError for a module."""

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        if spec.name in _PACKAGES:
            from pipros.packages.well_known import why_not_here

            raise ModuleNotFoundError(
                f"No module named '{spec.name}': {why_not_here(spec.name)}", name=spec.name
            )
        reason = _REASONS[spec.name].format(spec.name)
        if spec.name == "em":
            from pipros.basics.extras import install_command

            reason += install_command("templates")
        else:
            from pipros.basics.rooms import offered

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
    """Return a spec whose import fails and suggests the replacement, or None for other modules."""
    return ModuleSpec(name, _AbsentLoader()) if name in _REASONS or name in _PACKAGES else None
