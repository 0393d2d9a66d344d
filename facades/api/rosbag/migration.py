"""`rosbag.migration` for Python code: bags of older definitions, checked and fixed by rules.

Facade of `pipros.bag.migration`. Rules are parsed, not run, so rules cannot be classes made in Python.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path

from pipros.bag.migration import Change, Migrator
from pipros.bag.migration_plugins import installed_rules, rules_of_files
from pipros.bag.opening import open_bag, writer_for
from pipros.bag.rewrite import replaced_file
from pipros.basics.errors import PiprosError
from pipros.basics.lazy_names import star_names as _star_names
from pipros.workspace.index import PackageIndex

__all__ = ["BagMigrationException", "MessageMigrator", "checkbag", "fixbag", "fixbag2"]

_star_names(
    __name__,
    "collections copy genmsg genpy inspect itertools os rosbag rospkg string StringIO=io:BytesIO sys "
    "traceback",
)


class BagMigrationException(Exception):
    """A rule file or a bag is broken."""


class MessageMigrator:
    """The rules of some files.

    Args:
        input_rule_files: their paths.
        plugins: also the rules that installed packages export.

    Raises:
        BagMigrationException: a file cannot be read, or is not a rule file.
    """

    def __init__(self, input_rule_files: Iterable[str] = (), plugins: bool = True) -> None:
        try:
            installed = installed_rules(PackageIndex.from_environment(), _warn) if plugins else []
            rules = [*installed, *rules_of_files(input_rule_files)]
        except (PiprosError, OSError) as error:
            raise BagMigrationException(str(error)) from error
        self._migrator = Migrator(rules)


def _warn(text: str) -> None:
    print(text, file=sys.stderr)


def checkbag(migrator: MessageMigrator, inbag: str) -> list[Change]:
    """The types of a bag that need a migration.

    Raises:
        BagMigrationException: the bag cannot be read.
    """
    try:
        with open_bag(inbag) as bag:
            return migrator._migrator.changes(bag)
    except (PiprosError, OSError) as error:
        raise BagMigrationException(str(error)) from error


def fixbag(migrator: MessageMigrator, inbag: str, outbag: str) -> bool:
    """Writes the migrated bag; False, and no file, if rules are missing. Raises as `checkbag`."""
    return not fixbag2(migrator, inbag, outbag)


def fixbag2(migrator: MessageMigrator, inbag: str, outbag: str, force: bool = False) -> list[Change]:
    """Writes the migrated bag; gives the changes that lack rules, and writes nothing, if there are some.

    With `force` those messages stay as they are. Raises as `checkbag`.
    """
    try:
        with open_bag(inbag) as bag:
            missing = [change for change in migrator._migrator.changes(bag) if change.missing]
            if missing and not force:
                return missing
            with replaced_file(Path(outbag)) as file:
                return migrator._migrator.fix(bag, writer_for(outbag, file), force=force)
    except (PiprosError, OSError) as error:
        raise BagMigrationException(str(error)) from error
