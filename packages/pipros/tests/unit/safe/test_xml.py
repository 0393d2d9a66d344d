import time
from pathlib import Path

import pytest

from pipros.packages.nodelets import compiled_nodelets
from pipros.safe.tolerant_xml import parse_tolerantly, strict_text
from pipros.safe.xml import XML_DEPTH, XmlError, parse
from pipros_libraries.robot_model.urdf import UrdfError, read_robot
from tests.support.memory import memory_of


def test_elements_have_their_position() -> None:
    root = parse('<launch>\n  <node\n   name="a"/><arg name="b"/>\n</launch>')
    assert [(child.tag, child.line, child.column) for child in root.children] == [
        ("node", 2, 3),
        ("arg", 3, 14),
    ]
    assert dict(root.children[0].attributes) == {"name": "a"}


def test_text_is_joined_around_comments_and_children() -> None:
    assert parse("<a>one<!-- no --> two<b>inner</b> three</a>").text == "one two three"


def test_cdata_and_character_references_are_text() -> None:
    assert parse("<a><![CDATA[<x>]]>&lt;&#65;</a>").text == "<x><A"


def test_the_declared_encoding_counts_for_bytes_and_not_for_text() -> None:
    document = '<?xml version="1.0" encoding="iso-8859-1"?><a>ä</a>'
    assert (parse(document.encode("latin-1")).text, parse(document).text) == ("ä", "ä")


@pytest.mark.parametrize(("text", "place", "reason"), [
    ("<launch>\n <node>\n</launch>", "f.launch:3:3", "mismatched tag"),
    ("", "f.launch:1:1", "no element found"), ("hello", "f.launch:1:1", "syntax error"),
    ("<a b='1' b='2'/>", "f.launch:1:10", "duplicate attribute"),
    ("<a>&nope;</a>", "f.launch:1:4", "undefined entity"),
    (b"<a>\xff</a>", "f.launch:1:4", "not well-formed"),
    (b'<?xml version="1.0" encoding="nope"?><a/>', "f.launch:1:", "unknown encoding"),
])  # fmt: skip
def test_malformed_xml_is_refused_with_its_place(text: str | bytes, place: str, reason: str) -> None:
    with pytest.raises(XmlError) as error:
        parse(text, "f.launch")
    assert str(error.value).startswith(place)
    assert reason in str(error.value)


@pytest.mark.parametrize("text", [
    "<!DOCTYPE launch><launch/>", '<!DOCTYPE a [<!ENTITY x "y">]><a>&x;</a>',
    '<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]><a>&x;</a>',
    '<!DOCTYPE a SYSTEM "http://localhost/x.dtd"><a/>',
])  # fmt: skip
def test_document_types_and_entities_are_refused(text: str) -> None:
    with pytest.raises(XmlError, match="document type"):
        parse(text)


def test_nesting_is_limited() -> None:
    parse("<a>" * XML_DEPTH + "</a>" * XML_DEPTH)
    with pytest.raises(XmlError, match="nested more than"):
        parse("<a>" * (XML_DEPTH + 1))


# XML files that TinyXML reads, with the answers of urdfdom 3.0.1, which is built on TinyXML.


DECLARATION = '<?xml version="1.0"?>'


ROBOT = '<robot name="r"><link name="l"/></robot>'


ACCEPTED = {
    "plain": ROBOT, "byte order mark": "\ufeff" + DECLARATION + ROBOT,
    "newline before": "\n" + DECLARATION + ROBOT, "spaces before": "  \t\n" + DECLARATION + ROBOT,
    "mark and newline": "\ufeff\n" + DECLARATION + ROBOT,
    "comment before": "<!-- c -->" + DECLARATION + ROBOT, "two declarations": DECLARATION * 2 + ROBOT,
    "no version": "<?xml?>" + ROBOT, "unknown encoding": '\n<?xml version="1.0" encoding="klingon"?>' + ROBOT,
    "ampersand in an attribute": ROBOT.replace('"r"', '"r" x="a&b"'),
    "ampersand in a text": ROBOT.replace("<link", "x & y<link"),
    "undefined entity": ROBOT.replace("<link", "&nbsp;<link"),
    "dashes in a comment": "<!-- a -- b -->" + ROBOT, "dashes at its end": "<!-- a --->" + ROBOT,
    "text after": ROBOT + "junk", "two roots": ROBOT + '<robot name="s"/>',
    "undeclared prefix": ROBOT.replace("<link", "<gazebo:x/><link"),
    "text at the end of CDATA": ROBOT.replace("<link", "]]><link"),
    "comment with dashes beside CDATA": "<!-- a -- b -->" + ROBOT.replace("<link", "<![CDATA[a & b]]><link"),
    "no quotation marks": ROBOT.replace('"l"', "l"),
    "no space between attributes": ROBOT.replace('"r"', '"r"x="1"'),
    "smaller sign in a value": ROBOT.replace('"r"', '"r" x="a<b"'),
    "control character": ROBOT.replace('"r"', '"r" x="\x01"'),
    "number of no character": ROBOT.replace('"r"', '"r" x="&#0;&#99999999;&#xD800;"'),
    "declaration in capitals": "<?XML version='1.0'?>" + ROBOT,
    "document type": DECLARATION + "<!DOCTYPE robot>" + ROBOT, "NUL at the end": ROBOT + "\0",
    "comment at the end that is not closed": ROBOT + "<!-- x",
    "CDATA": ROBOT.replace("<link", "<![CDATA[x & y]]><link"),
}  # fmt: skip


REFUSED = {
    "document type with a declaration": DECLARATION + '<!DOCTYPE robot [<!ENTITY a "b">]>' + ROBOT,
    "attribute without a value": ROBOT.replace('"r"', '"r" x'),
    "duplicate attribute": ROBOT.replace('name="l"', 'name="l" name="m"'),
    "mismatch": '<robot name="r"><link name="l"></joint></robot>',
    "not closed": '<robot name="r"><link name="l"/>',
    "comment that is not closed": '<robot name="r"><!-- <link name="l"/></robot>',
    "invalid character": ROBOT.replace('"l"', '"a&#xZZ;"').replace("<link", "< link"),
    "empty": "",
}


@pytest.mark.parametrize("text", ACCEPTED.values(), ids=list(ACCEPTED))
def test_a_robot_that_genuine_ros_reads_is_read(text: str) -> None:
    robot = read_robot(text)
    assert (robot.name, list(robot.links)) == ("r", ["l"])


@pytest.mark.parametrize("text", REFUSED.values(), ids=list(REFUSED))
def test_a_robot_that_genuine_ros_refuses_is_refused(text: str) -> None:
    with pytest.raises(UrdfError):
        read_robot(text)


def test_document_types_with_declarations_stay_refused() -> None:
    with pytest.raises(XmlError, match="document type"):
        parse_tolerantly("\n" + DECLARATION + '<!DOCTYPE robot [<!ENTITY a "b">]>' + ROBOT)


def test_errors_name_the_place_in_the_original_text() -> None:
    text = "\n<!-- a -- b\n -->\n" + DECLARATION + "\n<robot>\n  <link name/>\n</robot>"
    with pytest.raises(XmlError, match=r"^<string>:6:13: "):
        parse_tolerantly(text)


def test_entities_and_comments_keep_their_meaning() -> None:
    assert parse_tolerantly('<a b="&amp;&lt;&#65;&x;"/>').attributes["b"] == "&<A&x;"
    assert parse_tolerantly("<a><!-- <b/> --><![CDATA[<!-- & -->]]></a>").text == "<!-- & -->"


def test_many_comments_that_are_not_closed_take_linear_time() -> None:
    text = "<!--" * 500_000
    assert strict_text(text).strip() == ""


@pytest.mark.parametrize(
    "part", ['<a "', "<a b=", "<a b='", '"b="c"', "&#", "<![CDATA[", "<!", "<!DOCTYPE ", "<?"]
)
def test_much_damaged_markup_takes_linear_time(part: str) -> None:
    assert len(strict_text("<a " + part * 50_000)) >= 3 + len(part) * 50_000


@pytest.mark.parametrize("part", ["a", " ", "''", "a='' ", "a "])
def test_one_damaged_tag_takes_little_memory(part: str) -> None:
    with memory_of(20_000_000):
        strict_text("<a " + part * (1_000_000 // len(part)))


def test_much_text_between_elements_takes_linear_time() -> None:
    begin_s = time.process_time()
    assert len(parse("<a>" + "x<b/>" * 800_000 + "</a>").text) == 800_000
    assert time.process_time() - begin_s < 5.0


@pytest.mark.parametrize("count", [1, 20_000])
def test_many_declarations_take_linear_time(count: int) -> None:
    assert strict_text("<?xml?> \n" * count + "<robot/>").split() == ["<robot/>"]
    open_ones = "<?xml " * count
    assert (strict_text(open_ones).strip(), strict_text("<?xml?>" + open_ones).strip()) == ("", "")


def test_a_description_of_plugins_may_begin_with_a_comment(tmp_path: Path) -> None:
    package = tmp_path / "my_nodelets"
    package.mkdir()
    (package / "package.xml").write_text(
        "<!-- a -- b -->\n<?xml version='1.0'?>\n<package><export>"
        '<nodelet plugin="${prefix}/plugins.xml"/></export></package>'
    )
    (package / "plugins.xml").write_text(
        '\n<?xml version="1.0"?>\n<library path="lib/x"><!-- ---- -->'
        '<class name="my_nodelets/One" type="One" base_class_type="nodelet::Nodelet">'
        "<description>This & that</description></class></library>"
    )
    assert compiled_nodelets([str(package)])["my_nodelets/One"] == "my_nodelets"
