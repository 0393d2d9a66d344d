import io
import os
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Point32, Polygon
from std_msgs.msg import String

from pipros.basics.errors import PiprosError
from pipros.msg.dynamic import message_classes_from_text
from pipros_tools.bag import BagError, BagReader, BagWriter
from pipros_tools.bag.migration import Migrator
from pipros_tools.bag.migration_rules import parse_rules
from pipros_tools.cli.rosbag import main
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


def test_check_lists_missing_types_and_writes_rules(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
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


def test_force_keeps_messages_without_a_rule(bag: Path) -> None:
    assert main(["fix", "--force", "old.bag", "new.bag"]) == 0
    with BagReader("new.bag") as reader, BagReader("old.bag") as before:
        assert [message[3] for message in reader.raw_messages()] == [
            message[3] for message in before.raw_messages()
        ]


def test_rules_apply_to_embedded_messages(bag: Path) -> None:
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


@pytest.mark.parametrize("line", [
    "import os", "class R(MessageUpdateRule):\n\tx = open('/etc/passwd')",
    "class R(MessageUpdateRule):\n\tdef update(self, old_msg, new_msg):\n\t\t__import__('os')",
    "class R(MessageUpdateRule):\n\tdef update(self, old_msg, new_msg):\n\t\tself.x = 1",
    "class R(MessageUpdateRule):\n\tdef update(self, old_msg, new_msg):\n\t\tnew_msg.__class__ = 1",
    "class R(",
])  # fmt: skip
def test_invalid_rules_are_refused_with_their_line(line: str) -> None:
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
    Path("latin.bmr").write_bytes(b"# \xe9\n")
    with pytest.raises(migration.BagMigrationException, match=r"^latin\.bmr: a rule file must be UTF-8: "):
        migration.MessageMigrator(["latin.bmr"])


RULE = '''
class renamed_and_more(MessageUpdateRule):
    old_type = "std_msgs/String"
    old_full_text = """string data
int32 more
"""
    new_type = "geometry_msgs/Polygon"
    new_full_text = """geometry_msgs/Point32[] points
================================================================================
MSG: geometry_msgs/Point32
float32 x
float32 y
float32 z
"""
    order = 0
    migrated_types = []
    valid = True

    def one(self, old_msg, new_msg):
        new_msg.points.append(self.get_new_class("geometry_msgs/Point32")(1, y=2.5))

    def many(self, old_msg, new_msg):
        total = 0
        for x in range(old_msg.more):
            total += x
            if x % 2:
                made = self.get_new_class("Point32")(total, x, old_msg.more)
                new_msg.points.append(made)
            else:
                pass

    def update(self, old_msg, new_msg):
        """Chooses by the text."""
        ways = {"one": self.one, "hello": self.many}
        assert old_msg.data in ways, "no way for %s" % old_msg.data
        ways[old_msg.data](old_msg, new_msg)
'''


def rules(text: str) -> Migrator:
    return Migrator(parse_rules(text, "x.bmr"))


def migrated(text: str, data: str = "hello", more: int = 6) -> Any:
    old = message_classes_from_text("std_msgs/String", OLD.partition("#")[0])["std_msgs/String"]
    return rules(text).migrate(old(data, more), Polygon)


def test_rules_have_methods_conditions_loops_and_make_messages() -> None:
    points = migrated(RULE).points

    assert [(point.x, point.y, point.z) for point in points] == [(1, 1, 6), (6, 3, 6), (15, 5, 6)]
    assert all(type(point) is Point32 for point in points)


@pytest.mark.parametrize(("old", "new", "complaint"), [
    ("hello", "bye", "line 35: assertion failed: no way for hello"),
    ('"hello": self.many', '"hello": self.one', "has 3 fields, got 1"),
    ("assert old_msg.data", "assert old_msg.nothing", "has no field .nothing"),
    ("assert old_msg.data in ways,", "new_msg.nothing =", "does not have a field .nothing"),
    ("ways[old_msg.data](", '["no method"][0](', "only methods of the rule can be called"),
    ("ways[old_msg.data](", '["update"][0](', "calls are nested more than 20 deep"),
    ('assert old_msg.data in ways, "no way for %s" %', "new_msg.points = 3 +", "unsupported|cannot|int"),
])  # fmt: skip
def test_an_error_in_a_rule_names_its_place(old: str, new: str, complaint: str) -> None:
    with pytest.raises(PiprosError, match=complaint):
        migrated(RULE.replace(old, new))


@pytest.mark.parametrize("line", [
    *("old_msg.data = 1", "new_msg.points[0] = 1", "a = b = 1", "print(1)", "self.missing(old_msg)"),
    *("while True: pass", "for a, b in old_msg.x: pass", "with open('x'): pass", "del new_msg.points"),
    *("new_msg.points.extend([1])", "import os", "return 1", "self.migrate(old_msg)", "x.__class__ = 1"),
])  # fmt: skip
def test_statements_that_are_not_understood_are_refused(line: str) -> None:
    with pytest.raises(BagError, match=r"^x\.bmr:37: "):
        parse_rules(RULE + f"        {line}\n", "x.bmr")


def test_an_infinite_loop_is_stopped() -> None:
    loops = "".join(f"{' ' * (8 + n)}for a{n} in range(1000):\n" for n in range(3)) + " " * 12 + "b = 1\n"
    with pytest.raises(BagError, match="a rule may execute at most 100000 statements per message"):
        migrated(RULE.partition("        ways =")[0] + loops)


def test_rules_of_installed_packages_are_found(tmp_path: Path, bag: Path, monkeypatch, capsys) -> None:
    main(["check", "-n", "-g", "rules.bmr", "old.bag"])
    text = Path("rules.bmr").read_text().replace("valid = False", "valid = True")
    package = tmp_path / "src" / "my_rules"
    package.mkdir(parents=True)
    (package / "package.xml").write_text(
        "<package><name>my_rules</name><version>1.0.0</version><description>x</description>"
        "<maintainer email='a@b.c'>a</maintainer><license>x</license>"
        "<run_depend>rosbag_migration_rule</run_depend><export>"
        "<rosbag_migration_rule rule_file='a.bmr'/><rosbag_migration_rule rule_file='none.bmr'/>"
        "<rosbag migration_rule_file='not_depended_on.bmr'/></export></package>"
    )
    (package / "a.bmr").write_text(text + "\nclass Wrong(MessageUpdateRule):\n\tx = open('x')\n")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))
    capsys.readouterr()

    assert (main(["fix", "-n", "old.bag", "new.bag"]), main(["fix", "old.bag", "new.bag"])) == (1, 0)
    told = capsys.readouterr().err
    assert "a value must be a literal" in told
    assert "none.bmr] in package [my_rules]" in told
    assert "not_depended_on" not in told
    assert migration.fixbag(migration.MessageMigrator(), "old.bag", "newer.bag") is True
    with BagReader("newer.bag") as reader:
        assert [row[1] for row in rows_of(reader)] == ["hello", "new"]


@pytest.mark.parametrize("count", [150, 900, 2500, 100_000])
@pytest.mark.parametrize("statement", [
    "new_msg.data = {plus}1", "new_msg.data = {minus}1", "new_msg.data = old_msg{attributes}", "f{calls}",
    "if 1:\n            pass\n        {branches}",
], ids=["sum", "signs", "attributes", "calls", "branches"])  # fmt: skip
def test_rules_that_are_nested_too_deep_are_refused_with_their_line(statement: str, count: int) -> None:
    line = statement.format(
        plus="1 + " * count, minus="-" * count, attributes=".a" * count, calls="()" * count,
        branches="elif 1:\n            pass\n        " * count,
    )  # fmt: skip

    with pytest.raises(
        BagError, match=r"x.bmr:\d+: (a rule is nested more than 100 deep|the rule file is malf)"
    ):
        parse_rules(RULE + f"        {line}\n", "x.bmr")
