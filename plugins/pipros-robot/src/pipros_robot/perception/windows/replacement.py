"""Replace OpenCV's window functions in a node, if OpenCV was built without them."""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typing import Any

    from pipros.node import Node

VARIABLE = "PIPROS_WINDOWS"
_NO_GUI = r"(?m)^[ \t]*GUI:\s*NONE\s*$"


def show_windows_on_page(cv2: Any, node: Node) -> None:
    """Show OpenCV's windows on a page of the node, unless OpenCV has a GUI or `PIPROS_WINDOWS` is `off`."""
    shown_by = getattr(getattr(cv2, "imshow", None), "__self__", None)
    if os.environ.get(VARIABLE, "").lower() == "off" or getattr(shown_by, "node", None) is node:
        return
    if not hasattr(cv2, "getBuildInformation") or not re.search(_NO_GUI, cv2.getBuildInformation()):
        return
    from pipros_robot.perception.windows.functions import WindowFunctions

    for name, function in WindowFunctions(cv2, node).by_name().items():
        setattr(cv2, name, function)
