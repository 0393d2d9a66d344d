"""Makes the messages of ROS packages importable, and tells rospkg about the packages that come with pipros.

`pipros.pth` imports this module whenever a Python interpreter of the environment starts, unless
`PIPROS_NO_IMPORT_HOOK` is set. It adds finders to `sys.meta_path` and imports nothing else: the search for
packages is imported when an import needs it.
"""

from __future__ import annotations

import sys

from pipros.msg.importing.hook import install

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from importlib.machinery import ModuleSpec
    from types import ModuleType


class _RospkgFinder:
    """Finds the module that gives rospkg the package path."""

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, _target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if name != "rospkg.environment":
            return None
        from pipros.packages import SHARE
        from pipros.packages.rospkg_paths import spec

        return spec(path, SHARE)


install()
if not any(isinstance(finder, _RospkgFinder) for finder in sys.meta_path):
    sys.meta_path.insert(0, _RospkgFinder())
