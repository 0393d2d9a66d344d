"""The rules of Debian's packages migrate messages as in genuine rosbag, which runs them."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.time import Duration, Time
from pipros_tools.bag import BagReader, BagWriter
from pipros_tools.bag.migration_rules import MigrationRule, parse_rules
from tests.support.ros import RosSystem

FILE = Path("/usr/share/sensor_msgs/migration_rules/sensor_msgs.bmr")


@pytest.fixture
def sides(tmp_path: Path, bare_tools: Path) -> Any:
    system = RosSystem(1, tmp_path, bare_tools)  # no master is needed
    yield system
    system.close()


def fill(message: Any, count: list[int]) -> None:
    """Give each field a different value."""
    classes = message_classes_from_text(message._type, message._full_text)
    for name, kind in zip(message.__slots__, message._slot_types, strict=True):
        base, _, length = kind.partition("[")

        def value(base: str = base) -> Any:
            count[0] += 1
            if base in classes:
                inner = classes[base]()
                fill(inner, count)
                return inner
            known = {"string": f"text {count[0]}", "bool": True, "time": Time(count[0], 7)}
            known["duration"] = Duration(count[0], 8)
            return known.get(base, float(count[0] % 100) if base.startswith("float") else count[0] % 100)

        size = int(length.rstrip("]") or 2) if length else 0
        if length and base in ("uint8", "char"):
            setattr(message, name, bytes(range(size)))
        else:
            setattr(message, name, [value() for _ in range(size)] if length else value())


def old_message(rule: MigrationRule) -> Any:
    """Return a message of the old definition of a rule."""
    message: Any = message_classes_from_text(rule.old[0], rule.old_text)[rule.old[0]]()
    fill(message, [0])
    if "depth" in message.__slots__:
        dimension = type(message.uint8_data.layout.dim[0])
        message.encoding, message.depth = "rgb", "uint8"
        message.uint8_data.data = bytes(18)
        sizes = [("height", 2, 18), ("width", 3, 9), ("channel", 3, 3)]
        message.uint8_data.layout.dim = [dimension(*each) for each in sizes]
    return message


def topic_of(rule: MigrationRule) -> str:
    return "/" + rule.name


def old_bag(rules: Sequence[MigrationRule]) -> bytes:
    """A bag with one message for each rule, on its own topic."""
    file = io.BytesIO()
    writer = BagWriter(file)
    for number, rule in enumerate(rules):
        topic = topic_of(rule)
        header = {"topic": topic, "type": rule.old[0], "md5sum": rule.old[1]}
        header["message_definition"] = rule.old_text
        connection = writer.add_connection(topic, {name: text.encode() for name, text in header.items()})
        writer.write_message(connection, 5 + number, 6, old_message(rule))
    writer.finish()
    return file.getvalue()


RULES = parse_rules(FILE.read_text(), str(FILE)) if FILE.exists() else []


def test_rules_of_packages_have_the_effect_of_genuine_rosbag(sides: RosSystem) -> None:
    """All migrations use one bag, because starting genuine rosbag takes longer than all of them."""
    assert len(RULES) > 10
    (sides.home / "old.bag").write_bytes(old_bag(RULES))
    found: list[dict[str, Any]] = []
    for side, name in ((sides.genuine, "genuine.bag"), (sides.pipros, "pipros_tools.bag")):
        done = side.run("rosbag", "fix", "-n", "old.bag", name, FILE)
        assert (done.returncode, done.stdout) == (0, ["Bag migrated successfully."])
        with BagReader(sides.home / name) as bag:
            messages = list(bag.raw_messages())
        assert len(messages) == len(RULES)
        found.append({each[0].topic: (each[0].type, each[0].md5sum, *each[1:4]) for each in messages})

    genuine, ours = found
    in_place = sides.pipros.run("rosbag", "fix", "-n", "pipros_tools.bag", "pipros_tools.bag", FILE)
    assert (in_place.returncode, in_place.stdout) == (0, ["Bag migrated successfully."])
    with BagReader(sides.home / "pipros_tools.bag") as bag:
        assert {
            each[0].topic: (each[0].type, each[0].md5sum, *each[1:4]) for each in bag.raw_messages()
        } == ours
    assert genuine.keys() == {topic_of(rule) for rule in RULES}
    for rule in RULES:
        assert ours[topic_of(rule)] == genuine[topic_of(rule)], rule.name
