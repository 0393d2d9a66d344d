from __future__ import annotations

import pytest

from pipros.safe.xml import XML_DEPTH, XmlError, parse


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
    assert parse(document.encode("latin-1")).text == "ä"
    assert parse(document).text == "ä"


@pytest.mark.parametrize(
    ("text", "place", "reason"),
    [
        ("<launch>\n <node>\n</launch>", "f.launch:3:3", "mismatched tag"),
        ("", "f.launch:1:1", "no element found"),
        ("hello", "f.launch:1:1", "syntax error"),
        ("<a b='1' b='2'/>", "f.launch:1:10", "duplicate attribute"),
        ("<a>&nope;</a>", "f.launch:1:4", "undefined entity"),
        (b"<a>\xff</a>", "f.launch:1:4", "not well-formed"),
        (b'<?xml version="1.0" encoding="nope"?><a/>', "f.launch:1:", "unknown encoding"),
    ],
)
def test_malformed_xml_is_refused_with_its_place(text: str | bytes, place: str, reason: str) -> None:
    with pytest.raises(XmlError) as error:
        parse(text, "f.launch")
    assert str(error.value).startswith(place)
    assert reason in str(error.value)


@pytest.mark.parametrize(
    "text",
    [
        "<!DOCTYPE launch><launch/>",
        '<!DOCTYPE a [<!ENTITY x "y">]><a>&x;</a>',
        '<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]><a>&x;</a>',
        '<!DOCTYPE a SYSTEM "http://localhost/x.dtd"><a/>',
    ],
)
def test_document_types_and_entities_are_refused(text: str) -> None:
    with pytest.raises(XmlError, match="document type"):
        parse(text)


def test_nesting_is_limited() -> None:
    parse("<a>" * XML_DEPTH + "</a>" * XML_DEPTH)
    with pytest.raises(XmlError, match="nested more than"):
        parse("<a>" * (XML_DEPTH + 1))
