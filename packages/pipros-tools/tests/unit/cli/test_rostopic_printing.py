from pathlib import Path

import pytest
from std_msgs.msg import Header, Int32

from pipros.msg import load_message_class
from pipros.msg.text import strify_message
from pipros.node.any_msg import AnyMsg
from pipros_tools.cli import rostopic
from pipros_tools.graph.elide import Elision
from pipros_tools.graph.errors import GraphError
from pipros_tools.graph.message_filter import MessageFilter
from pipros_tools.graph.message_path import Part
from pipros_tools.graph.message_rows import MessageRows, field_filter
from pipros_tools.graph.raw_decoder import RawDecoder
from tests.support.bags import bag_bytes

String = load_message_class("std_msgs/String")
Image = load_message_class("sensor_msgs/Image")
JointState = load_message_class("sensor_msgs/JointState")
LaserScan = load_message_class("sensor_msgs/LaserScan")
DiagnosticArray = load_message_class("diagnostic_msgs/DiagnosticArray")
DiagnosticStatus = load_message_class("diagnostic_msgs/DiagnosticStatus")


def test_arrays_become_a_note_of_their_length() -> None:
    image = Image(height=1, width=3, data=b"abc")
    text = strify_message(Elision(no_arrays=True, no_texts=False).of(Part(image, Image._type)))
    assert text.splitlines()[-1] == 'data: "<array type: uint8, length: 3>"'


def test_texts_become_a_note_of_their_length_but_not_inside_of_arrays() -> None:
    message = DiagnosticArray(status=[DiagnosticStatus(name="motor")])
    message.header.frame_id = "base"
    text = strify_message(Elision(no_arrays=False, no_texts=True).of(Part(message, message._type)))
    assert 'frame_id: "<string length: 4>"' in text
    assert 'name: "motor"' in text


def test_an_array_of_texts_becomes_a_note_of_its_length() -> None:
    state = JointState(name=["left", "right"], position=[0.5])
    text = strify_message(Elision(no_arrays=False, no_texts=True).of(Part(state, state._type)))
    assert 'name: "<array type: string, length: 2>"\nposition: [0.5]' in text
    assert Elision(no_arrays=False, no_texts=True).of(Part(["a"], "string[]")) == (
        "<array type: string, length: 1>"
    )


def test_the_original_is_not_changed() -> None:
    scan = LaserScan(ranges=(1.0,))
    Elision(no_arrays=True, no_texts=True).of(Part(scan, scan._type))
    assert scan.ranges == (1.0,)


def test_a_row_has_a_column_for_each_element() -> None:
    part = Part(LaserScan(ranges=(1.5, 2.5)), LaserScan._type)
    rows = MessageRows()
    assert rows.heading(part).endswith("field.range_max,field.ranges0,field.ranges1")
    assert rows.row(part, 17).startswith("17,0,0,,")
    assert rows.row(part, 17).endswith("0.0,1.5,2.5")


def test_octets_have_no_columns() -> None:
    assert "data" not in MessageRows().heading(Part(Image(data=b"abc"), Image._type))


@pytest.mark.parametrize(("no_arrays", "no_texts"), [(True, False), (False, True), (True, True)])
def test_arrays_and_texts_of_messages_can_be_left_out(no_arrays: bool, no_texts: bool) -> None:
    scan = LaserScan(ranges=(1.0,))
    rows = MessageRows(field_filter(no_arrays=no_arrays, no_texts=no_texts))
    heading = rows.heading(Part(scan, LaserScan._type))
    assert ("ranges0" in heading, "frame_id" in heading) == (not no_arrays, not no_texts)
    assert rows.row(Part(scan, LaserScan._type), 1).count(",") == heading.count(",")
    assert rows.row(Part([1.0], "float32[]"), 1) == "1,1.0"  # the requested field is shown


def test_an_offset_is_taken_off_points_in_time() -> None:
    stamp = load_message_class("std_msgs/Time")()
    stamp.data.secs = 10
    assert (
        MessageRows().row(Part(stamp, stamp._type), 10_000_000_000, 4_000_000_000) == "6000000000,6000000000"
    )


@pytest.mark.parametrize(("expression", "passes"), [
    ("m.data == 'hello'", True), ("topic == '/chatter' and len(m.data) > 3", True), ("m.data == 'x'", False),
    ("'ell' in m.data", True),
])  # fmt: skip
def test_a_filter_gets_the_message_and_its_topic(expression: str, passes: bool) -> None:
    assert MessageFilter(expression)(String("hello"), "/chatter") is passes


def test_a_filter_may_compare_times() -> None:
    scan = LaserScan()
    scan.header.stamp.secs = 5
    assert MessageFilter("to_sec(m.header.stamp) > 4.5 and m.header.stamp.secs == 5")(scan, "/scan")


@pytest.mark.parametrize("expression", [
    "m.__class__", "m._connection_header", "m.data.__class__", "m.serialize", "().__class__",
    "__import__('os')", "open('/etc/passwd')", "[x.__class__ for x in (1,)]", "(", "m.nope",
])  # fmt: skip
def test_a_filter_can_only_read_fields(expression: str, capsys: pytest.CaptureFixture[str]) -> None:
    passes = MessageFilter(expression)
    assert not passes(String("hello"), "/chatter")
    assert not passes(String("hello"), "/chatter")
    assert capsys.readouterr().err.count("ERROR: in the expression") == 1  # once, not for each message


def raw(**header: str) -> AnyMsg:
    message = AnyMsg(b"\x02\x00\x00\x00hi")
    message._connection_header = header
    return message


def test_an_installed_class_is_used_when_the_md5_agrees() -> None:
    assert type(RawDecoder().decode(raw(type="std_msgs/String", md5sum=String._md5sum))) is String


def test_the_publishers_definition_wins_over_another_one_that_is_installed() -> None:
    message = RawDecoder().decode(
        raw(type="std_msgs/String", md5sum="another", message_definition="string word\n")
    )
    assert message.word == "hi"


@pytest.mark.parametrize("kind", ["nowhere_msgs/X", "std_msgs/String"])
def test_a_missing_definition_is_a_plain_error(kind: str) -> None:
    with pytest.raises(GraphError, match=rf"Cannot load message class for \[{kind}\]"):
        RawDecoder().decode(raw(type=kind, md5sum="x"))


@pytest.mark.parametrize(("text", "cell"), [
    ('grüß "dich"', 'grüß "dich"'),  # like genuine rostopic
    ("", ""), ("a,b", '"a,b"'), ('a,"b"', '"a,""b"""'), ('"a"', '"""a"""'), ("a\n0,b\x1b", '"a\\n0,b\\x1b"'),
])  # fmt: skip
def test_a_text_is_one_cell_of_its_row(text: str, cell: str) -> None:
    assert MessageRows().row(Part(text, "string"), 1) == f"1,{cell}"


@pytest.fixture
def bag(tmp_path: Path) -> str:
    path = tmp_path / "run.bag"
    rows = [("/a", Int32(n), n, 5) for n in range(4)]
    path.write_bytes(bag_bytes([*rows, ("/deep/h", Header(frame_id="map"), 4, 0)]))
    return str(path)


@pytest.mark.parametrize(("arguments", "out"), [
    (["/a", "-n", "2"], "data: 0\n---\ndata: 1\n---\n"), (["a/data", "-n", "1"], "0\n---\n"),
    (["/deep/h/frame_id"], '"map"\n---\n'),
    (["-p", "/a", "-n", "2"], "%time,field.data\n5,0\n1000000005,1\n"),
    (["-p", "/deep/h"], "%time,field.seq,field.stamp,field.frame_id\n4000000000,0,0,map\n"),
    (["-p", "/deep/h", "--nostr"], "%time,field.seq,field.stamp\n4000000000,0,0\n"),
    (["-p", "/deep/h/frame_id", "--nostr"], "%time,field\n4000000000,map\n"),
    (["--filter", "m.data == 3", "/a"], "data: 3\n---\n"), (["-a", "-n", "1"], "data: 0\n---\n"),
    (["/none"], ""),
])  # fmt: skip
def test_echo_shows_the_messages_of_a_bag(arguments: list[str], out: str, bag: str, capsys) -> None:
    assert (rostopic.main(["echo", "-b", bag, *arguments]), capsys.readouterr().out) == (0, out)


def test_list_shows_the_topics_of_a_bag(bag: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert (rostopic.main(["list", "-b", bag]), capsys.readouterr().out) == (0, "/a\n/deep/h\n")
    assert rostopic.main(["list", "-b", bag, "/a"]) == 0
    assert capsys.readouterr().out.startswith(
        ("4 message(s) from 01 Jan 1970 ", "4 message(s) from 31 Dec 1969 ")  # depends on the time zone
    )


@pytest.mark.parametrize(
    ("content", "words"),
    [(None, "does not exist"), (b"x", "unable to use bag file: "), (b"#ROSBAG V2.0\n", "Unindexed bag")],
)
def test_a_file_that_is_not_a_bag_is_refused(content: bytes | None, words: str, tmp_path, capsys) -> None:
    path = tmp_path / "x.bag"
    if content is not None:
        path.write_bytes(content)
    for command in (["echo", "-b", str(path), "/a"], ["list", "-b", str(path)]):
        assert rostopic.main(command) == 1
        assert words in capsys.readouterr().err


def test_offsets_from_now_are_not_applied_to_a_bag(bag: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        rostopic.main(["echo", "-b", bag, "--offset", "/a"])
    assert "offset time option is not valid with bag files" in capsys.readouterr().err
