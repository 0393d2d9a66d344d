"""Store layouts of panels by name, read them from files, and derive them from rqt perspectives.

A file is JSON: `{"pipros_layout": 1, "panels": "row(plot//imu/x~console)"}`. The page's address contains the
same text for `panels`, which only the page interprets.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from pipros.basics.cache_files import CacheFolder
from pipros.basics.errors import PiprosError
from pipros.basics.file_names import is_device
from pipros.basics.input_file import open_file
from pipros.packages import cache_folder

PAGE_LAYOUT_BYTES = 65_536
"""Limit: a panel layout, stored by a browser or in a file. Beyond it, the layout is neither stored nor
opened; there can be at most 100 layouts.
"""

MAX_LAYOUTS: Final = 100
_VERSION: Final = 1
_ENDING: Final = ".json"
_NAME: Final = re.compile(r"[\w+-][\w .+-]{0,59}")
_PLUGIN: Final = re.compile(r"'(rqt_\w+)/\w+': \[([^\[\]]*)\]")
_SETTINGS: Final = re.compile(r'"plugin__(rqt_[a-z0-9_]+?)__\w')
_LARGEST_PERSPECTIVE: Final = 4_000_000
_ONE_ROW: Final = 3

PLUGIN_TABS: Final[Mapping[str, str]] = {
    "rqt_bag": "bags",
    "rqt_console": "console",
    "rqt_graph": "graph",
    "rqt_image_view": "images",
    "rqt_logger_level": "console",
    "rqt_plot": "plot",
    "rqt_publisher": "publish",
    "rqt_reconfigure": "reconfigure",
    "rqt_robot_monitor": "diagnostics",
    "rqt_robot_steering": "teleop",
    "rqt_runtime_monitor": "diagnostics",
    "rqt_service_caller": "services",
    "rqt_tf_tree": "tf",
    "rqt_top": "nodes",
    "rqt_topic": "topics",
}
"""The page's tabs, keyed by the rqt plugin that each replaces."""


class BadLayout(PiprosError, ValueError):
    """A layout or its name is malformed, or there are too many layouts."""


@dataclass(frozen=True, slots=True)
class OpenedLayout:
    """A layout read from a file.

    Attributes:
        panels: the layout, as in the page's address.
        skipped: a perspective's plugins that have no corresponding tab.
    """

    panels: str
    skipped: Sequence[str] = ()


class StoredLayouts:
    """The layouts stored in `$ROS_HOME/pipros/layouts`.

    Files that other users could have written are ignored. All methods block. They raise `OSError` if the
    folder cannot be used.
    """

    def __init__(self) -> None:
        self._folder = CacheFolder(cache_folder("layouts"))

    def names(self) -> list[str]:
        """Return the names of all layouts."""
        try:
            found = self._folder.names()
        except FileNotFoundError:
            return []
        return sorted(name.removesuffix(_ENDING) for name in found if name.endswith(_ENDING))[:MAX_LAYOUTS]

    def load(self, name: object) -> str:
        """Return a layout's panels. Raise `BadLayout` if the layout does not exist or is malformed."""
        file = _file_of(name)
        try:
            content = self._folder.load(file)
        except FileNotFoundError:
            raise BadLayout(f"there is no layout [{name}]") from None
        return _panels_in(content, str(name))

    def save(self, name: object, panels: object) -> None:
        """Create or replace a layout. Raise `BadLayout` if it is malformed or there are too many."""
        file = _file_of(name)
        if not isinstance(panels, str) or not panels:
            raise BadLayout("a layout needs at least one panel")
        content = json.dumps({"pipros_layout": _VERSION, "panels": panels}).encode()
        _check_size(content)
        others = [other for other in self.names() if other != name]
        if len(others) >= MAX_LAYOUTS:
            raise BadLayout(f"there are already {MAX_LAYOUTS} layouts; delete one")
        self._folder.store(file, content)

    def delete(self, name: object) -> None:
        """Delete a layout. Raise `BadLayout` if there is no layout of that name."""
        try:
            self._folder.remove(_file_of(name))
        except FileNotFoundError:
            raise BadLayout(f"there is no layout [{name}]") from None


def open_layout(path: str) -> OpenedLayout:
    """Read a layout file, or derive a layout from an rqt perspective.

    Raises:
        BadLayout: the file is neither a layout nor a perspective, or no plugin has a corresponding tab.
        OSError: the file cannot be read.
    """
    with open_file(path) as file:
        content = file.read(_LARGEST_PERSPECTIVE + 1)
    values = _json(content, path)
    if "pipros_layout" in values:
        return OpenedLayout(_panels_in(content, path))
    groups = values.get("groups")
    if not isinstance(groups, dict) or not groups.keys() & {"mainwindow", "pluginmanager"}:
        raise BadLayout(f"{path} is neither a pipros layout nor an rqt perspective")
    return _from_perspective(groups.get("pluginmanager"), path)


def _from_perspective(settings: Any, path: str) -> OpenedLayout:
    """Return a layout with a panel for each running plugin.

    If no plugin is running, the layout has a panel for each plugin that has settings.
    """
    try:
        running = str(settings["keys"]["running-plugins"]["repr"])
    except (KeyError, TypeError):
        running = ""
    plugins = [
        name for name, numbers in _PLUGIN.findall(running) for number in numbers.split(",") if number.strip()
    ]
    if not plugins:
        plugins = _SETTINGS.findall(json.dumps(settings))
    tabs = [PLUGIN_TABS[name] for name in plugins if name in PLUGIN_TABS]
    skipped = sorted({name for name in plugins if name not in PLUGIN_TABS})
    if not tabs:
        what = f"only {', '.join(skipped)}, for which the page has no tab" if skipped else "no plugin"
        raise BadLayout(f"{path} has {what}")
    return OpenedLayout(_arranged(tabs), skipped)


def _arranged(tabs: Sequence[str]) -> str:
    """Return a layout with one row of panels, or with two rows if there are more than three."""
    if len(tabs) > _ONE_ROW:
        middle = (len(tabs) + 1) // 2
        return f"column({_arranged_row(tabs[:middle])}~{_arranged_row(tabs[middle:])})"
    return _arranged_row(tabs)


def _arranged_row(tabs: Sequence[str]) -> str:
    return f"row({'~'.join(tabs)})" if len(tabs) > 1 else tabs[0]


def _panels_in(content: bytes, name: str) -> str:
    _check_size(content)
    values = _json(content, name)
    panels = values.get("panels")
    if values.get("pipros_layout") != _VERSION or not isinstance(panels, str):
        raise BadLayout(f"{name} is not a layout file: pipros_layout must be {_VERSION}, and panels a string")
    return panels


def _json(content: bytes, name: str) -> dict[str, Any]:
    try:
        values = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise BadLayout(f"{name} is not JSON: {error}") from None
    if not isinstance(values, dict):
        raise BadLayout(f"{name} is not a layout file: it must contain an object")
    return values


def _check_size(content: bytes) -> None:
    limit = PAGE_LAYOUT_BYTES
    if len(content) > limit:
        raise BadLayout(f"the layout has {len(content)} bytes; the limit is {limit} bytes")


def _file_of(name: object) -> str:
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise BadLayout(
            "a layout name must consist of at most 60 letters, digits, spaces or . _ + -, and not begin with "
            f"a space or a dot, got {name!r}"
        )
    if is_device(name):
        raise BadLayout(f"a layout cannot be named {name!r}, which Windows treats as a device")
    return name + _ENDING
