"""Replace OpenCV's window functions in a node, if OpenCV was built without them.

Every node calls `show_windows_on_page` when it starts, so this module imports little.
"""

from __future__ import annotations

import os
import re
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from importlib.machinery import ModuleSpec
    from types import ModuleType
    from typing import Any

    from pipros.node import Node

VARIABLE = "PIPROS_WINDOWS"
_NO_GUI = r"(?m)^\s*GUI:\s*NONE\s*$"


def show_windows_on_page(node: Node) -> None:
    """Show OpenCV's windows on a page of the node, unless OpenCV has a GUI or `PIPROS_WINDOWS` is `off`.

    If `cv2` is not imported yet, its functions are replaced when it is imported.
    """
    if os.environ.get(VARIABLE, "").lower() == "off":
        return
    module = sys.modules.get("cv2")
    if module is not None:
        _replace(module, node)
        return
    for finder in [finder for finder in sys.meta_path if isinstance(finder, _Finder)]:
        sys.meta_path.remove(finder)  # left by the previous node in this process
    sys.meta_path.insert(0, _Finder(node))


class _Finder:
    """Import hook for the first import of `cv2`, whose window functions it replaces after the import."""

    def __init__(self, node: Node) -> None:
        self._node = node

    def find_spec(
        self, name: str, _path: Sequence[str] | None = None, _target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if name != "cv2":
            return None
        sys.meta_path.remove(self)
        from importlib.util import find_spec

        spec = find_spec(name)
        loader: Any = spec and spec.loader
        if loader is not None:
            execute = loader.exec_module

            def execute_and_replace(module: ModuleType) -> None:
                execute(module)
                _replace(module, self._node)

            loader.exec_module = execute_and_replace
        return spec


def _replace(cv2: Any, node: Node) -> None:
    shown_by = getattr(getattr(cv2, "imshow", None), "__self__", None)
    if getattr(shown_by, "node", None) is node:
        return  # init_node was called again
    if not hasattr(cv2, "getBuildInformation") or not re.search(_NO_GUI, cv2.getBuildInformation()):
        return
    from pipros.server.windows.functions import WindowFunctions

    for name, function in WindowFunctions(cv2, node).by_name().items():
        setattr(cv2, name, function)
