"""XML files that TinyXML reads, with the answers of urdfdom 3.0.1, which is built on TinyXML."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipros.libraries.robot_model.urdf import UrdfError, read_robot
from pipros.packages.nodelets import compiled_nodelets
from pipros.safe.tolerant_xml import parse_tolerantly, strict_text
from pipros.safe.xml import XmlError

DECLARATION = '<?xml version="1.0"?>'
ROBOT = '<robot name="r"><link name="l"/></robot>'

ACCEPTED = {
    "plain": ROBOT,
    "byte order mark": "\ufeff" + DECLARATION + ROBOT,
    "newline before": "\n" + DECLARATION + ROBOT,
    "spaces before": "  \t\n" + DECLARATION + ROBOT,
    "mark and newline": "\ufeff\n" + DECLARATION + ROBOT,
    "comment before": "<!-- c -->" + DECLARATION + ROBOT,
    "two declarations": DECLARATION * 2 + ROBOT,
    "no version": "<?xml?>" + ROBOT,
    "unknown encoding": '\n<?xml version="1.0" encoding="klingon"?>' + ROBOT,
    "ampersand in an attribute": ROBOT.replace('"r"', '"r" x="a&b"'),
    "ampersand in a text": ROBOT.replace("<link", "x & y<link"),
    "undefined entity": ROBOT.replace("<link", "&nbsp;<link"),
    "dashes in a comment": "<!-- a -- b -->" + ROBOT,
    "dashes at its end": "<!-- a --->" + ROBOT,
    "text after": ROBOT + "junk",
    "two roots": ROBOT + '<robot name="s"/>',
    "undeclared prefix": ROBOT.replace("<link", "<gazebo:x/><link"),
    "CDATA": ROBOT.replace("<link", "<![CDATA[x & y]]><link"),
}
REFUSED = {
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


def test_document_types_stay_refused() -> None:
    with pytest.raises(XmlError, match="document type"):
        parse_tolerantly("\n" + DECLARATION + "<!DOCTYPE robot>" + ROBOT)


def test_errors_name_the_place_in_the_original_text() -> None:
    text = "\n<!-- a -- b\n -->\n" + DECLARATION + "\n<robot>\n  <link name=x/>\n</robot>"
    with pytest.raises(XmlError, match=r"^<string>:6:14: "):
        parse_tolerantly(text)


def test_entities_and_comments_keep_their_meaning() -> None:
    assert parse_tolerantly('<a b="&amp;&lt;&#65;&x;"/>').attributes["b"] == "&<A&x;"
    assert parse_tolerantly("<a><!-- <b/> --><![CDATA[<!-- & -->]]></a>").text == "<!-- & -->"


def test_many_comments_that_are_not_closed_take_linear_time() -> None:
    text = "<!--" * 500_000
    assert strict_text(text) == text


@pytest.mark.parametrize("count", [1, 20_000])
def test_many_declarations_take_linear_time(count: int) -> None:
    assert strict_text("<?xml?> \n" * count + "<robot/>").split() == ["<robot/>"]
    open_ones = "<?xml " * count
    assert strict_text(open_ones) == open_ones
    assert strict_text("<?xml?>" + open_ones) == " " * 7 + open_ones


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
