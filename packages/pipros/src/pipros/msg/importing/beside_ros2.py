"""Imports in an environment that also contains ROS 2, whose packages have the same names: `std_msgs.msg`.

`Ros2Finder` gives the public names of ROS 2's packages to ROS 1 if `PIPROS_MESSAGES` is `ros1`. Facades such
as `tf2_ros` always get ROS 1's messages: their modules are compiled as if they imported
`pipros.ros1.std_msgs.msg`. The finder is only installed beside ROS 2.
"""

from __future__ import annotations

import os
import re
import sys
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader

from pipros.basics.syntax_trees import SYNTAX_TREES
from pipros.msg.importing.modules import is_ros2_folder, ros1_has_public_names
from pipros.packages import SHARES

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from types import CodeType, ModuleType

_ROS1_NAME = re.compile(r"(?<![\w./])(\w+\.(?:msg|srv|point_cloud2))(?=:[A-Z]|\Z)")


class Ros2Finder:
    """Finder for facades, and for ROS 1's packages instead of ROS 2's.

    Args:
        find_ros1: `find_spec` of the finder for ROS 1's packages.
    """

    def __init__(self, find_ros1: Callable[[str], ModuleSpec | None]) -> None:
        self._find_ros1 = find_ros1
        self._shipped = frozenset(
            (*(name for share in SHARES for name in os.listdir(share)), "camera_info_manager")
        )

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, _target: ModuleType | None = None
    ) -> ModuleSpec | None:
        top, _, rest = name.partition(".")
        may_be_hidden = not rest and ros1_has_public_names()
        if top not in self._shipped and not may_be_hidden:
            return None
        spec = PathFinder.find_spec(name, path)
        if spec is None or spec.origin is None:
            return None
        folder = os.path.dirname(spec.origin)
        if may_be_hidden and is_ros2_folder(folder):
            return self._find_ros1(name)
        if not spec.origin.endswith(".py") or not _is_facade(top, folder):
            return None
        spec.loader = Ros1Loader(name, spec.origin)
        return spec


def _is_facade(top: str, folder: str) -> bool:
    module = sys.modules.get(top)
    top_folder = folder if module is None else os.path.dirname(module.__file__ or "")
    return os.path.isfile(os.path.join(top_folder, "py.typed")) and not is_ros2_folder(top_folder)


class Ros1Loader(SourceFileLoader):
    """Loader of a module that imports ROS 1's messages below `pipros.ros1`, whatever its source says."""

    def get_data(self, path: str) -> bytes:
        """Return the content of a file. Bytecode is kept apart from that of other environments."""
        return super().get_data(_bytecode_path(path))

    def set_data(self, path: str, data: object, **options: int) -> None:
        """Write bytecode."""
        super().set_data(_bytecode_path(path), data, **options)  # type: ignore[arg-type]

    def source_to_code(self, data: object, path: object, **options: int) -> CodeType:  # type: ignore[override]
        """Compile a module with the names of ROS 1's messages."""
        import ast

        with SYNTAX_TREES:
            tree = ast.parse(data)  # type: ignore[call-overload]
            for node in ast.walk(tree):
                if isinstance(node, ast.ImportFrom) and node.module and not node.level:
                    node.module = _ros1_names(node.module)
                elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                    node.value = _ros1_names(node.value)
            return compile(tree, path, "exec", dont_inherit=True, **options)  # type: ignore[call-overload,no-any-return]


def _ros1_names(text: str) -> str:
    return _ROS1_NAME.sub(r"pipros.ros1.\1", text)


def _bytecode_path(path: str) -> str:
    stem, extension = os.path.splitext(path)
    return f"{stem}.ros1{extension}" if extension == ".pyc" else path
