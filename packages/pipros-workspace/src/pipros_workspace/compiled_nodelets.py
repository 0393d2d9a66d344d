"""C++ nodelets that the genuine `nodelet` program could load on this machine."""

from __future__ import annotations

from collections.abc import Mapping

from pipros.packages.nodelets import compiled_nodelets
from pipros.packages.system_packages import program
from pipros_workspace.index import PackageIndex


def loadable_nodelets() -> Mapping[str, str]:
    """Return the package of each nodelet, by plugin name; empty if the genuine `nodelet` is not installed."""
    if program("nodelet", "nodelet") is None:
        return {}
    return compiled_nodelets(str(package.path) for package in PackageIndex.from_environment())
