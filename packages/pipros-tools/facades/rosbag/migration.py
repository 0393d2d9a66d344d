"""Drop-in replacement for `rosbag.migration`: check and fix bags with older definitions.

Facade of `pipros_tools.bag.migration`. Rules are parsed, not executed, so rules cannot be Python classes.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path

from pipros.basics.errors import PiprosError
from pipros.basics.lazy_names import star_names as _star_names
from pipros.basics.replaced_file import overwritten_file
from pipros_tools.bag.migration import Migrator, TypeChange
from pipros_tools.bag.migration_plugins import installed_rules, rules_of_files
from pipros_tools.bag.opening import open_bag, writer_for
from pipros_workspace.index import PackageIndex

__all__ = ["BagMigrationException", "MessageMigrator", "checkbag", "fixbag", "fixbag2"]

_star_names(
    __name__,
    "collections copy genmsg genpy inspect itertools os rosbag rospkg string StringIO=io:BytesIO sys "
    "traceback",
)


class BagMigrationException(Exception):
    """A rule file or a bag is invalid."""


class MessageMigrator:
    """Migration rules from files.

    Args:
        input_rule_files: paths of the rule files.
        plugins: whether to also load the rules that installed packages export.

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


def checkbag(migrator: MessageMigrator, inbag: str) -> list[TypeChange]:
    """Return the message types in a bag that need migration.

    Raises:
        BagMigrationException: the bag cannot be read.
    """
    try:
        with open_bag(inbag) as bag:
            return migrator._migrator.changes(bag)
    except (PiprosError, OSError) as error:
        raise BagMigrationException(str(error)) from error


def fixbag(migrator: MessageMigrator, inbag: str, outbag: str) -> bool:
    """Write the migrated bag.

    If rules are missing, write nothing and return False. Raises the same errors as `checkbag`.
    """
    return not fixbag2(migrator, inbag, outbag)


def fixbag2(migrator: MessageMigrator, inbag: str, outbag: str, force: bool = False) -> list[TypeChange]:
    """Write the migrated bag. If rules are missing, write nothing and return the changes that lack a rule.

    If `force` is true, write the bag anyway, and copy messages that lack a rule unchanged. Raises the
    same errors as `checkbag`.
    """
    try:
        with open_bag(inbag) as bag:
            missing = [change for change in migrator._migrator.changes(bag) if change.missing]
            if missing and not force:
                return missing
            with overwritten_file(Path(outbag)) as file:
                return migrator._migrator.fix(bag, writer_for(outbag, file), force=force)
    except (PiprosError, OSError) as error:
        raise BagMigrationException(str(error)) from error
