"""Make the messages of ROS packages importable, and make rospkg and pkg_resources find pipros's packages.

`pipros.pth` imports this module whenever a Python interpreter of the environment starts, unless
`PIPROS_NO_IMPORT_HOOK` is set. The module only adds finders to `sys.meta_path`. The code that searches for
packages is imported when an import first needs it.
"""

from __future__ import annotations

import sys

from pipros.msg.importing.hook import give_way as give_way
from pipros.msg.importing.hook import install

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from importlib.machinery import ModuleSpec
    from importlib.metadata import Distribution, DistributionFinder
    from types import ModuleType


class _DistributionFinder:
    """Provides `importlib.metadata` with the packages shipped with pipros. Finds no modules."""

    def find_spec(
        self, _name: str, _path: Sequence[str] | None = None, _target: ModuleType | None = None
    ) -> ModuleSpec | None:
        return None

    def find_distributions(self, context: DistributionFinder.Context) -> Iterable[Distribution]:
        # Lists of all distributions contain only the distributions that pip installed.
        if context.name is None or "path" in vars(context):
            return ()
        from pipros.packages.distributions import shipped_distribution

        found = shipped_distribution(context.name)
        return () if found is None else (found,)


class _CompletingFinder:
    """Adapts modules of rospkg and setuptools on import, so that they find pipros's packages."""

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, _target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if name not in ("rospkg.environment", "pkg_resources"):
            return None
        from pipros.packages.completed_modules import spec

        return spec(name, path)


install()
if not any(isinstance(finder, _CompletingFinder) for finder in sys.meta_path):
    sys.meta_path.insert(0, _CompletingFinder())
    sys.meta_path.append(_DistributionFinder())
