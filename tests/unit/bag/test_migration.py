from __future__ import annotations

import io
import os
from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import String

from pipros.bag import BagError, BagReader, BagWriter
from pipros.bag.migration_rules import parse_rules
from pipros.cli.rosbag import main
from pipros.msg.dynamic import message_classes_from_text
from rosbag import migration
from tests.support.bags import header_of, rows_of

OLD = 'string data\nint32 more # """ import os\n'
NESTED = (
    "Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n"
    "================================================================================\nMSG: std_msgs/Header\n"
    "uint32 seq\ntime stamp\nstring frame_id\nint32 extra\n"
)


def write(path: Path, type_name: str, text: str, fill: Any) -> None:
    cls = message_classes_from_text(type_name, text)[type_name]
    message = cls()
    fill(message)
    file = io.BytesIO()
    writer = BagWriter(file)
    old = writer.add_connection("/old", {**header_of(message, "/old"), "message_definition": text.encode()})
    writer.write_message(old, 1, 0, message)
    writer.write_message(writer.add_connection("/new", header_of(String(), "/new")), 2, 0, String("new"))
    writer.finish()
    path.write_bytes(file.getvalue())


@pytest.fixture
def bag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A bag whose String has one field too many."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "old.bag"

    def fill(message: Any) -> None:
        message.data, message.more = "hello", 7

    write(path, "std_msgs/String", OLD, fill)
    return path


def test_check_tells_what_is_missing_and_writes_rules(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "old.bag"]) == 0
    out = capsys.readouterr().out
    assert out.startswith("The following migrations need to occur:\n * From: std_msgs/String [")
    assert f"    1 rules missing:\n     * From: std_msgs/String [" in out  # noqa: F541
    assert out.endswith("\n\nTo generate rules, please run with -g <rulefile>\n")

    assert main(["check", "-g", "rules.bmr", "old.bag"]) == 0
    (rule,) = parse_rules(Path("rules.bmr").read_text(), "rules.bmr")
    assert (rule.is_valid, rule.new) == (False, ("std_msgs/String", String._md5sum))
    with pytest.raises(SystemExit):
        main(["check", "-g", "rules.bmr", "old.bag"])


def test_fix_follows_the_rules(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fix", "old.bag", "new.bag"]) == 1
    assert "Bag could not be migrated." in capsys.readouterr().out
    assert os.listdir() == ["old.bag"]
    main(["check", "-g", "rules.bmr", "old.bag"])
    rules = Path("rules.bmr").read_text().replace("valid = False", "valid = True")
    Path("rules.bmr").write_text(rules.replace("= old_msg.data", '= old_msg.data + " %d" % old_msg.more'))

    assert main(["check", "old.bag", "rules.bmr"]) == 0
    assert capsys.readouterr().out.endswith("All rules defined.  Bag is ready to be migrated\n")
    assert main(["fix", "old.bag", "new.bag", "rules.bmr"]) == 0
    with BagReader("new.bag") as reader:
        assert rows_of(reader) == [("/old", "hello 7", 1, 0), ("/new", "new", 2, 0)]
        assert {type(message.message) for message in reader} == {String}
    capsys.readouterr()
    assert main(["check", "new.bag"]) == 0
    assert capsys.readouterr().out == "Bag file does not need any migrations.\n"


def test_force_leaves_what_has_no_rule(bag: Path) -> None:
    assert main(["fix", "--force", "old.bag", "new.bag"]) == 0
    with BagReader("new.bag") as reader, BagReader("old.bag") as before:
        assert [message[3] for message in reader.raw_messages()] == [
            message[3] for message in before.raw_messages()
        ]


def test_rules_reach_the_messages_within_messages(bag: Path) -> None:
    def fill(message: Any) -> None:
        message.header.frame_id, message.name = "map", ["a"]

    write(bag, "sensor_msgs/JointState", NESTED, fill)
    main(["check", "-g", "rules.bmr", "old.bag"])
    text = Path("rules.bmr").read_text()
    assert "class update_std_msgs_Header_" in text
    Path("rules.bmr").write_text(text.replace("valid = False", "valid = True"))

    assert main(["fix", "old.bag", "new.bag", "rules.bmr"]) == 0
    with BagReader("new.bag") as reader:
        message = next(iter(reader)).message
    assert (message.header.frame_id, message.name, message._type) == ("map", ["a"], "sensor_msgs/JointState")


@pytest.mark.parametrize(
    "line",
    [
        "import os",
        "class R(MessageUpdateRule):\n\tx = open('/etc/passwd')",
        "class R(MessageUpdateRule):\n\tdef update(self, old_msg, new_msg):\n\t\t__import__('os')",
        "class R(MessageUpdateRule):\n\tdef update(self, old_msg, new_msg):\n\t\tself.x = 1",
        "class R(MessageUpdateRule):\n\tdef update(self, old_msg, new_msg):\n\t\tnew_msg.__class__ = 1",
        "class R(",
    ],
)
def test_what_rules_may_not_do_is_refused_with_its_place(line: str) -> None:
    with pytest.raises(BagError, match=r"^x\.bmr:\d+: "):
        parse_rules(line, "x.bmr")


def test_the_module_has_the_functions_of_noetic(bag: Path) -> None:
    migrator = migration.MessageMigrator()

    assert [change.old[0] for change in migration.checkbag(migrator, "old.bag")] == ["std_msgs/String"]
    assert migration.fixbag(migrator, "old.bag", "new.bag") is False
    assert not Path("new.bag").exists()
    assert migration.fixbag2(migrator, "old.bag", "new.bag", force=True) == []
    assert Path("new.bag").exists()
    with pytest.raises(migration.BagMigrationException):
        migration.MessageMigrator(["none.bmr"])
