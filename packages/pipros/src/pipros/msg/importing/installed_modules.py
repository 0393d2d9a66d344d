"""Which modules of Python's own folders give way to a workspace's package of the same name.

`hook.py` imports this module when a name is both in the workspace and elsewhere.
"""

from __future__ import annotations

import os
import site
from importlib.machinery import ModuleSpec, PathFinder

from pipros.packages import shipped_folder
from pipros.packages.installed_packages import share_folders


def may_be_replaced(name: str) -> bool:
    """Return whether Python finds a module that a workspace's package of the same name comes before.

    Such a module was installed by pip or apt, or is pipros's package of messages. Those have an
    `__init__.pyi`; pipros's other modules, such as `tf2_ros`, stay.
    """
    spec = PathFinder.find_spec(name)
    if spec is None or not spec.origin:
        return False
    if _has_file(spec, spec.origin, "py.typed") and shipped_folder(spec.name):
        return _has_file(spec, spec.origin, "__init__.pyi")
    return _is_in_site_folder(spec.origin)


def is_outside_site_folders(name: str) -> bool:
    """Return whether Python finds a module that neither pip nor apt has installed."""
    spec = PathFinder.find_spec(name)
    return spec is not None and bool(spec.origin) and not _is_in_site_folder(spec.origin or "")


def _has_file(spec: ModuleSpec, file: str, name: str) -> bool:
    """Return whether a file is beside a module's file, which may be in a zip file."""
    try:
        spec.loader.get_data(os.path.join(os.path.dirname(file), name))  # type: ignore[union-attr]
    except (OSError, AttributeError):
        return False
    return True


def _is_in_site_folder(file: str) -> bool:
    """Return whether a module's file is in a folder to which pip or apt installs modules."""
    folder = os.path.dirname(file)
    root = os.path.dirname(folder) if os.path.basename(file).startswith("__init__.") else folder
    return root in (*site.getsitepackages(), site.getusersitepackages()) or (
        os.path.join(root, "share") in share_folders()
    )
