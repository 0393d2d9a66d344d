"""`rosbag check` and `rosbag fix`: find and migrate messages whose types have changed."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from pipros.basics.input_file import read_file
from pipros.basics.printable import listed
from pipros.basics.replaced_file import overwritten_file
from pipros.msg.class_finder import installed_class
from pipros_tools.bag.left_out import LeftOut
from pipros_tools.bag.migration import Kind, Migrator, TypeChange, rule_text
from pipros_tools.bag.migration_plugins import installed_rules, rules_of_files
from pipros_tools.bag.opening import writer_for
from pipros_tools.bag.reader import BagReader
from pipros_tools.cli.rosbag.other_bags import add_reading_options, keep_beside, name_beside, opened, warned
from pipros_tools.cli.runner import add_flag, option_parser
from pipros_workspace.index import PackageIndex


def check(argv: Sequence[str]) -> int:
    parser = option_parser(
        "rosbag",
        "",
        "Determine whether a bag is playable in the current system, or if it can be migrated.",
    )
    parser.usage = "rosbag check BAG [-g RULEFILE] [EXTRARULES1 EXTRARULES2 ...]"
    parser.add_option("-g", "--genrules", dest="rulefile", help="generate a rulefile named RULEFILE")
    add_flag(parser, "-a", "--append", help="append to the end of an existing rulefile after loading it")
    add_flag(parser, "-n", "--noplugins", help="do not load rulefiles via plugins")
    add_reading_options(parser)
    options, arguments = parser.parse_args(list(argv))
    if not arguments:
        parser.error("You must specify a bag file to check.")
    if options.append and not options.rulefile:
        parser.error("Cannot specify -a without also specifying -g.")
    rule_files = arguments[1:]
    if options.rulefile and Path(options.rulefile).exists():
        if not options.append:
            parser.error(f"The file {options.rulefile} already exists.  Include -a if you intend to append.")
        rule_files.append(options.rulefile)
    migrator = _migrator(rule_files, has_plugins=not options.noplugins)
    left_out = warned()
    with opened(arguments[0], options, left_out) as bag:
        changes = _changes(migrator, bag, left_out)
        name_beside([bag])
        if not changes:
            print("Bag file does not need any migrations.")
            return 1 if left_out else 0
        print("The following migrations need to occur:")
        _show(changes)
        if not any(change.missing for change in changes):
            print("\nAll rules defined.  Bag is ready to be migrated")
        elif options.rulefile:
            _write_rules(Path(options.rulefile), changes, bag)
            print(f"\nThe necessary rule files have been written to: {options.rulefile}")
        else:
            print("\nTo generate rules, please run with -g <rulefile>")
    return 1 if left_out else 0


def fix(argv: Sequence[str]) -> int:
    parser = option_parser(
        "rosbag", "", "Repair the messages in a bag file so that it can be played in the current system."
    )
    parser.usage = "rosbag fix INBAG OUTBAG [EXTRARULES1 EXTRARULES2 ...]"
    add_flag(parser, "-n", "--noplugins", help="do not load rulefiles via plugins")
    add_flag(parser, "--force", help="proceed with migrations, even if not all rules defined")
    add_reading_options(parser)
    options, arguments = parser.parse_args(list(argv))
    if not arguments:
        parser.error("You must pass input and output bag files.")
    if len(arguments) < 2:
        parser.error("You must pass an output bag file.")
    source, target = Path(arguments[0]), Path(arguments[1])
    if target.suffix == ".bmr":
        parser.error("Input file should be a bag file, not a rule file.")
    if target.suffix not in (".bag", ".mcap"):
        parser.error("Output file must be a bag file.")
    migrator = _migrator(arguments[2:], has_plugins=not options.noplugins)
    left_out = warned()
    with opened(source, options, left_out) as bag:
        missing = (
            []
            if options.force
            else [change for change in _changes(migrator, bag, left_out) if change.missing]
        )
        if not missing:
            with overwritten_file(target) as file:
                writer = writer_for(target, file)
                with keep_beside(bag, writer):
                    migrator.fix(bag, writer, force=bool(options.force))
            print("Bag migrated successfully.")
            return 1 if left_out else 0
    print("Bag could not be migrated.  The following migrations could not be performed:")
    _show(missing)
    print(
        "Try running 'rosbag check' to create the necessary rule files or run 'rosbag fix' with the "
        "'--force' option."
    )
    return 1


def _changes(migrator: Migrator, bag: BagReader, left_out: LeftOut) -> list[TypeChange]:
    """Return the types that need migration, and report the topics whose definitions are malformed."""
    found = migrator.changes(bag)
    for topic, reason in bag.skipped.items():
        left_out.whole(topic, reason)
    return found


def _migrator(files: Iterable[str], *, has_plugins: bool) -> Migrator:
    installed = installed_rules(PackageIndex.from_environment(), _warn) if has_plugins else []
    return Migrator([*installed, *rules_of_files(files)])


def _warn(text: str) -> None:
    print(text, file=sys.stderr)


def _show(changes: Iterable[TypeChange]) -> None:
    for change in changes:
        _show_pair("", change.old, change.new)
        if change.missing:
            print(f"    {len(change.missing)} rules missing:")
            for old, new in change.missing:
                _show_pair("    ", old, new)


def _show_pair(indent: str, old: Kind, new: Kind) -> None:
    before, after = (f"{listed(name)} [{listed(md5sum)}]" for name, md5sum in (old, new))
    print(f"{indent} * From: {before}\n{indent}   To:   {after}")


def _write_rules(path: Path, changes: Iterable[TypeChange], bag: BagReader) -> None:
    from pipros.msg.dynamic import message_classes_from_text

    classes = {}
    olds = {change.old for change in changes}
    for connection in bag.connections:
        if (connection.type, connection.md5sum) in olds:
            olds.discard((connection.type, connection.md5sum))
            text = bag.class_of(connection)._full_text
            for made in message_classes_from_text(connection.type, text).values():
                classes[made._type, made._md5sum] = made
    missing = dict.fromkeys(pair for change in changes for pair in change.missing)
    before = read_file(path) if path.is_file() else b""
    with overwritten_file(path) as file:
        file.write(before)
        for pair in missing:
            new = installed_class(pair[1][0])
            if pair[0] in classes and new is not None:
                file.write((rule_text(pair, classes[pair[0]], new) + "\n").encode())
            else:
                kind = f"{listed(pair[0][0])} [{listed(pair[0][1])}]"
                print(f"cannot write a rule for {kind}", file=sys.stderr)
