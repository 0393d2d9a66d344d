"""Migrate messages to the definitions in the installed packages, by rules or field by field."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

from pipros.msg.base import Message
from pipros.msg.class_finder import installed_class
from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.errors import MessageException
from pipros.safe.expr_walk import ExpressionError
from pipros_tools.bag.connection import Connection
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.migration_rules import MigrationRule
from pipros_tools.bag.migration_update import Update
from pipros_tools.bag.reader import BagReader
from pipros_tools.bag.sinks import MessageWriter, copying
from pipros_tools.bag.times import received_at

_LONGEST_CHAIN = 50

Kind = tuple[str, str]
"""A type and its md5sum."""


@dataclass(frozen=True, slots=True)
class TypeChange:
    """A type in a bag that the installed packages define differently.

    Attributes:
        old, new: type and md5sum in the bag and in the installed package, respectively.
        missing: pairs of an old and a new type for which there is no valid rule.
    """

    old: Kind
    new: Kind
    missing: tuple[tuple[Kind, Kind], ...]


class Migrator:
    """Converter that applies rules to messages. A type whose fields have not changed does not need a rule."""

    def __init__(self, rules: Sequence[MigrationRule] = ()) -> None:
        self._rules = {rule.old: rule for rule in rules if rule.is_valid}
        self._classes: dict[Kind, type[Message]] = {}
        self._updates: dict[Kind, Update] = {}
        self._parts: dict[tuple[type[Message], str], type[Message] | None] = {}

    def changes(self, bag: BagReader) -> list[TypeChange]:
        """Return the types in a bag that need migration.

        Connections whose definition is malformed are added to `bag.skipped`, and `fix` leaves them out.
        """
        found: dict[Kind, TypeChange] = {}
        seen: set[tuple[str, str, str]] = set()
        for connection in bag.connections:
            old = connection.type, connection.md5sum
            if old in found or (*old, connection.definition) in seen:
                continue
            seen.add((*old, connection.definition))
            target = self.target(connection)
            if target is not None:
                try:
                    made = bag.class_of(connection)
                except BagError as error:
                    bag.skipped.setdefault(connection.topic, str(error))
                    continue
                missing = dict.fromkeys(self._missing(made, target))
                found[old] = TypeChange(old, (target._type, target._md5sum), tuple(missing))
        return list(found.values())

    def target(self, connection: Connection) -> type[Message] | None:
        """Return the class to which a connection's messages are migrated, or None if they stay unchanged.

        A rule may rename the type. Types that are not installed are not migrated.
        """
        name = connection.type
        rule = self._rules.get((name, connection.md5sum))
        for _ in range(_LONGEST_CHAIN):
            if rule is None:
                break
            name = rule.new[0]
            rule = self._rules.get(rule.new)
        installed = installed_class(name)
        if installed is None or (installed._type, installed._md5sum) == (connection.type, connection.md5sum):
            return None
        return installed

    def _missing(self, old: type[Message], new: type[Message]) -> list[tuple[Kind, Kind]]:
        if old._md5sum == new._md5sum:
            return []
        rule = self._rules.get((old._type, old._md5sum))
        if rule is not None:
            made = self._class_of(rule, new)
            return self._missing(made, new) if made is not old else []
        fields = dict(zip(old.__slots__, old._slot_types, strict=True))
        if list(fields) != list(new.__slots__):
            return [((old._type, old._md5sum), (new._type, new._md5sum))]
        found: list[tuple[Kind, Kind]] = []
        for name, kind, other in zip(fields, fields.values(), new._slot_types, strict=True):
            inner, other_inner = self._part_class(old, name), self._part_class(new, name)
            if kind.partition("[")[1:] != other.partition("[")[1:] or (inner is None) != (
                other_inner is None
            ):
                return [((old._type, old._md5sum), (new._type, new._md5sum))]
            if inner is None or other_inner is None:
                if kind != other:
                    return [((old._type, old._md5sum), (new._type, new._md5sum))]
            else:
                found += self._missing(inner, other_inner)
        return found

    def _class_of(self, rule: MigrationRule, last: type[Message]) -> type[Message]:
        if rule.new == (last._type, last._md5sum):
            return last
        if rule.new not in self._classes:
            self._classes[rule.new] = message_classes_from_text(rule.new[0], rule.new_text)[rule.new[0]]
        return self._classes[rule.new]

    def _part_class(self, cls: type[Message], field: str) -> type[Message] | None:
        """Return the class of the messages in a field, or None for built-in types."""
        key = cls, field
        if key not in self._parts:
            self._parts[key] = _class_of_part(cls, field)
        return self._parts[key]

    def migrate(self, message: Message, new: type[Message]) -> Message:
        """Return a message of the class `new` with the content of `message`.

        Raises:
            BagError: a rule is missing or fails.
            ExpressionError: an expression in a rule fails.
        """
        if message._md5sum == new._md5sum:
            return message if isinstance(message, new) else _as_class(message, new)
        rule = self._rules.get((message._type, message._md5sum))
        for _ in range(_LONGEST_CHAIN):
            if rule is None:
                break
            message = self._updated(message, rule, self._class_of(rule, new))
            if message._md5sum == new._md5sum:
                return message
            rule = self._rules.get((message._type, message._md5sum))
        made: Any = new()
        if list(message.__slots__) != list(new.__slots__):
            raise BagError(f"no rule migrates {message._type} [{message._md5sum}] to [{new._md5sum}]")
        for name in message.__slots__:
            self._set(made, name, getattr(message, name))
        return made  # type: ignore[no-any-return]

    def _updated(self, old: Message, rule: MigrationRule, cls: type[Message]) -> Message:
        update = self._updates.get(rule.old)
        if update is None:
            find = partial(_class_of_text, rule)
            update = Update(rule.name, rule.methods, self.migrate, find, self._set)
            self._updates[rule.old] = update
        made = cls()
        update.run(old, made)
        return made

    def _set(self, owner: Any, name: str, value: Any) -> None:
        """Set a field. Messages in the value are migrated to the class of the field."""
        inner = self._part_class(type(owner), name)
        if inner is not None and isinstance(value, Message):
            value = self.migrate(value, inner)
        elif inner is not None and isinstance(value, list | tuple):
            value = [self.migrate(each, inner) if isinstance(each, Message) else each for each in value]
        setattr(owner, name, value)

    def fix(self, bag: BagReader, writer: MessageWriter, *, force: bool = False) -> list[TypeChange]:
        """Migrate a bag's messages, write them, and finish the writer. Return an empty list.

        If rules are missing, write nothing, and return the changes that need them. With `force`, copy the
        affected messages unchanged instead.
        """
        incomplete = [change for change in self.changes(bag) if change.missing]
        if incomplete and not force:
            return incomplete
        stays = {change.old for change in incomplete}
        made: dict[int, tuple[Connection, type[Message] | None]] = {}
        write = copying(writer)
        for stored in bag.stored_messages():
            connection, time_ns, data, *origin = stored
            if connection.id not in made:
                is_kept = (connection.type, connection.md5sum) in stays
                made[connection.id] = self._connect(
                    writer, connection, None if is_kept else self.target(connection)
                )
            written, target = made[connection.id]
            if target is not None:
                try:
                    buffer = io.BytesIO()
                    self.migrate(bag.decode(stored), target).serialize(buffer)
                except (BagError, ExpressionError, MessageException) as error:
                    if bag.on_bad_message is None:
                        raise
                    bag.on_bad_message(connection.topic, f"{received_at(time_ns)}: {error}")
                    continue
                data = buffer.getvalue()
            write(written, time_ns, data, *origin)
        writer.finish()
        return []

    @staticmethod
    def _connect(
        writer: MessageWriter, connection: Connection, target: type[Message] | None
    ) -> tuple[Connection, type[Message] | None]:
        header = dict(connection.header)
        if target is not None:
            header["type"] = target._type.encode()
            header["md5sum"] = target._md5sum.encode()
            header["message_definition"] = target._full_text.encode()
        return writer.add_connection(connection.topic, header), target


@lru_cache(maxsize=1000)
def _class_of_text(rule: MigrationRule, side: str, name: str) -> type[Message] | None:
    """Return the class for a type in a rule's old or new definition. The package name is optional."""
    top, text = (rule.new[0], rule.new_text) if side == "new" else (rule.old[0], rule.old_text)
    classes = message_classes_from_text(top, text)
    names = name, f"std_msgs/{name}", f"{top.partition('/')[0]}/{name}"
    return next((classes[each] for each in names if each in classes), None)


def _class_of_part(cls: type[Message], field: str) -> type[Message] | None:
    kind = cls._slot_types[list(cls.__slots__).index(field)].partition("[")[0]
    if "/" not in kind:
        return None
    installed = installed_class(cls._type)
    if installed is cls:
        return installed_class(kind)
    return message_classes_from_text(cls._type, cls._full_text).get(kind)


def _as_class(message: Message, cls: type[Message]) -> Message:
    """Convert a message to another class with the same definition, without changing its bytes."""
    buffer = io.BytesIO()
    message.serialize(buffer)
    return cls().deserialize(buffer.getvalue())


def rule_text(change: tuple[Kind, Kind], old: type[Message], new: type[Message]) -> str:
    """Return a rule template to be completed by hand. Fields with equal names are already assigned."""
    lines = [
        f"class update_{change[0][0].replace('/', '_')}_{change[0][1]}(MessageUpdateRule):",
        f'\told_type = "{change[0][0]}"',
        f'\told_full_text = """\n{_quoted(old._full_text)}\n"""',
        "",
        f'\tnew_type = "{change[1][0]}"',
        f'\tnew_full_text = """\n{_quoted(new._full_text)}\n"""',
        "",
        "\torder = 0",
        "\tmigrated_types = []",
        "",
        "\tvalid = False",
        "",
        "\tdef update(self, old_msg, new_msg):",
    ]
    for name in new.__slots__:
        if name in old.__slots__:
            lines.append(f"\t\tnew_msg.{name} = old_msg.{name}")
        else:
            lines.append("\t\t#No matching field name in old message")
            lines.append(f"\t\t#new_msg.{name} = ")
    gone = [name for name in old.__slots__ if name not in new.__slots__]
    lines += [f"\t\t#No field to match field {name} from old message" for name in gone]
    if not set(new.__slots__) & set(old.__slots__):
        lines.append("\t\tpass")
    return "\n".join(lines) + "\n"


def _quoted(text: str) -> str:
    """Escape an untrusted definition for use in triple quotes."""
    return text.strip().replace("\\", "\\\\").replace('"', '\\"')
