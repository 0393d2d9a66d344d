"""Look up nodelets by name: Python nodelets, and C++ plugins installed on this machine.

Plugins of pipros (`pipros.basics.plugins`) declare their nodelets. Other distributions add nodelets in the
same way, or through entry points in the group `pipros.nodelets`, whose names are those of the nodelets
(`my_package/MyNodelet`) and whose values name classes.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from importlib.metadata import entry_points
from typing import Final

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_text
from pipros.basics.plugins import named_plugins, plugins
from pipros.packages.system_packages import manifest_folders
from pipros.safe import xml
from pipros.safe.tolerant_xml import strict_text

_KIND = "nodelets"
ENTRY_POINTS: Final = f"pipros.{_KIND}"

CHOICE_VARIABLE: Final = "PIPROS_NODELETS"
"""Environment variable that selects the implementation of a manager's nodelets."""

OURS: Final = "ours"
GENUINE: Final = "genuine"

_PACKAGE_OF_PREFIX = {"jsk_pcl": "jsk_pcl_ros", "jsk_pcl_utils": "jsk_pcl_ros_utils", "pcl": "pcl_ros"}
"""Packages by prefix of plugin names, for prefixes that are not package names."""


class InvalidChoice(PiprosError, ValueError):
    """`PIPROS_NODELETS` has an unknown value."""


def chosen(variables: Mapping[str, str] = os.environ) -> str:
    """Return the implementation that `PIPROS_NODELETS` selects; empty if it is unset.

    Raises:
        InvalidChoice: the value is neither `ours` nor `genuine`.
    """
    value = variables.get(CHOICE_VARIABLE, "")
    if value not in ("", OURS, GENUINE):
        raise InvalidChoice(f"{CHOICE_VARIABLE} must be {OURS} or {GENUINE}, got [{value}]")
    return value


@cache
def shipped_nodelets() -> Mapping[str, str]:
    """Return the classes of pipros's nodelets as `module:name`, by plugin name."""
    return {name: target for plugin in named_plugins() for name, target in plugin.nodelets.items()}


def python_nodelet(plugin: str) -> str | None:
    """Return the class of a Python nodelet as `module:name`, or None if no Python nodelet has this name."""
    return shipped_nodelets().get(plugin) or _of_others().get(plugin)


@cache
def _of_others() -> Mapping[str, str]:
    found = {name: target for plugin in plugins() for name, target in plugin.nodelets.items()}
    return found | {point.name: point.value for point in entry_points(group=ENTRY_POINTS)}


def package_of(plugin: str) -> str:
    """Return the package that the prefix of a plugin's name denotes: `pcl_ros` for `pcl/VoxelGrid`."""
    prefix = plugin.partition("/")[0]
    return _PACKAGE_OF_PREFIX.get(prefix, prefix)


def compiled_nodelets(folders: Iterable[str] = ()) -> dict[str, str]:
    """Map the plugin names of the C++ nodelets described on this machine to their packages.

    Unreadable descriptions are skipped.

    Args:
        folders: package folders to search before those of the system.
    """
    found: dict[str, str] = {}
    for folder in (*folders, *manifest_folders()):
        for description in _descriptions(folder):
            for name in _names(description):
                found.setdefault(name, os.path.basename(folder))
    return found


def _root(path: str) -> xml.Element | None:
    try:
        # A description may have several roots.
        return xml.parse(f"<all>{strict_text(read_text(path))}</all>", path)
    except (PiprosError, OSError):
        return None


def _descriptions(folder: str) -> Iterator[str]:
    manifest = _root(os.path.join(folder, "package.xml"))
    package = manifest.first("package") if manifest else None
    for export in package.all("export") if package else ():
        for each in export.all("nodelet"):
            if plugin := each.attributes.get("plugin"):
                yield plugin.replace("${prefix}", folder)


def _names(description: str) -> Iterator[str]:
    root = _root(description)
    libraries = [] if root is None else [*root.all("library")]
    for group in root.all("class_libraries") if root else ():
        libraries += group.all("library")
    for library in libraries:
        for each in library.all("class"):
            yield each.attributes.get("name") or each.attributes.get("type", "")
