"""Detect which of pipros's import packages have changed since pip installed them."""

from __future__ import annotations

import base64
import csv
import hashlib
from importlib.metadata import Distribution, PackageNotFoundError, distribution, distributions
from pathlib import Path

NAME = "pipros"


def changed_packages(name: str = NAME) -> dict[str, str]:
    """Map changed import packages to the distribution that replaced their files.

    The value of `rospy` may be `py3rosmsgs`; it is empty if the distribution is unknown. Modules are compared
    with the checksums that pip recorded. In a checkout, for which pip records no modules, the result is
    empty. Blocks while reading the modules and, if a module has changed, the records of all distributions.
    """
    try:
        installed = distribution(name)
    except PackageNotFoundError:
        return {}
    sums = _recorded_sums(installed)
    changed = {module for module, recorded in sums.items() if _differs(installed, module, recorded)}
    if not changed:
        return {}
    packages = dict.fromkeys(sorted({module.split("/")[0] for module in changed}), "")
    for other in distributions():
        if other.metadata["Name"] != name:
            shared = changed & _recorded_sums(other).keys()
            packages.update((module.split("/")[0], other.metadata["Name"]) for module in shared)
    return packages


def _recorded_sums(installed: Distribution) -> dict[str, str]:
    """Map modules to `algorithm=sum`, as in a distribution's `RECORD` file (PEP 376)."""
    rows = csv.reader((installed.read_text("RECORD") or "").splitlines())
    return {
        row[0]: row[1]
        for row in rows
        if len(row) > 1 and row[0].endswith(".py") and not row[0].startswith("..")
    }


def _differs(installed: Distribution, module: str, recorded: str) -> bool:
    algorithm, _, value = recorded.partition("=")
    if not value:
        return False
    try:
        content = Path(str(installed.locate_file(module))).read_bytes()
    except OSError:
        return True
    found = base64.urlsafe_b64encode(hashlib.new(algorithm, content).digest())
    return found.rstrip(b"=").decode() != value
