"""Find the migration rules that installed packages export, as Noetic's `rosbag check` and `fix` do.

A package exports rules with `<NAME ATTRIBUTE="file.bmr"/>` in its manifest, where NAME and ATTRIBUTE are a
pair in `_EXPORTS`. It must also depend on the package NAME.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from pipros.basics.errors import PiprosError
from pipros.basics.input_file import read_text
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.migration_rules import MigrationRule, parse_rules
from pipros_workspace.index import PackageIndex
from pipros_workspace.manifest import read_manifest

if TYPE_CHECKING:
    from pipros.basics.printable import Say

_EXPORTS = {
    "rosbagmigration": "rule_file",
    "rosbag": "migration_rule_file",
    "rosbag_migration_rule": "rule_file",
}
"""The attribute that names the rule file, by package."""


def installed_rules(index: PackageIndex, warn: Say) -> list[MigrationRule]:
    """Return the rules from all packages. Invalid rules and unreadable files are reported with `warn`."""
    found: list[MigrationRule] = []
    for package, file in _files(index, warn):
        try:
            found += parse_rules(_text(file), str(file), warn)
        except (PiprosError, OSError) as error:
            warn(f"Cannot load rule file [{file}] in package [{package}]: {error}")
    return found


def _files(index: PackageIndex, warn: Say) -> Iterator[tuple[str, Path]]:
    for package in index:
        try:
            manifest = read_manifest(package.path)
        except (PiprosError, OSError) as error:
            warn(f"Cannot read the manifest of package [{package.name}]: {error}")
            continue
        for export in manifest.exports:
            value = export.attributes.get(_EXPORTS.get(export.tag, ""))
            if value is not None and export.tag in manifest.depends():
                yield package.name, package.path / value


def rules_of_files(files: Iterable[str]) -> list[MigrationRule]:
    """Return the rules in the given files.

    Raise `BagError` or `OSError` if a file is malformed or unreadable.
    """
    return [rule for file in files for rule in parse_rules(_text(file), file)]


def _text(file: str | Path) -> str:
    try:
        return read_text(file)
    except UnicodeDecodeError as error:
        raise BagError(f"{file}: a rule file must be UTF-8: {error}") from error
