"""The quick XML-RPC reader agrees with the complete one, or leaves the text to it."""

from contextlib import suppress
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from pipros.basics.errors import ProtocolError
from pipros.wire import xmlrpc_expat, xmlrpc_fast
from pipros.wire.xmlrpc import encode_call, encode_response
from tests.support.examples import examples

LIMIT = 5

blanks = st.sampled_from(["", "", "", " ", "\n", "\t\n  "])
numbers = st.sampled_from(["5", "-7", "+1", "99999999999", "1.5", "1e5", ".", "1", "0", " 5 ", "nan"])
texts = st.sampled_from(["", "x", "ü", "true", "&lt;", "&amp", "&#65;", "]]>", "\ufffe", "\r\n", "\x00"])
scraps = numbers | texts | st.sampled_from(["<!-- c -->", "<![CDATA[x]]>", "<?pi?>"])
tags = st.sampled_from(["int", "i4", "i8", "string", "double", "boolean", "name", "value", "nil"])


@st.composite
def documents(draw: st.DrawFn, depth: int = 0) -> str:
    """Strategy for mostly well-formed values."""
    kind = draw(st.integers(0, 9))
    gap = draw(blanks)
    if kind < 5 or depth > LIMIT:
        tag = draw(tags)
        close = draw(st.sampled_from([*([tag] * 9), "int"]))
        return f"{gap}<value>{gap}<{tag}>{draw(scraps)}</{close}>{draw(blanks)}</value>"
    if kind == 5:
        return f"<value>{draw(scraps)}</value>{gap}"
    if kind in (6, 7):
        items = "".join(draw(st.lists(documents(depth + 1), max_size=3)))
        return f"<value>{gap}<array>{draw(blanks)}<data>{items}{gap}</data></array></value>"
    members = [
        f"<member>{draw(blanks)}<name>{draw(scraps)}</name>{draw(documents(depth + 1))}{gap}</member>"
        for _ in range(draw(st.integers(0, 3)))
    ]
    return f"<value><struct>{gap}{''.join(members)}</struct>{gap}</value>"


declarations = st.sampled_from(
    [
        "",
        "<?xml version='1.0'?>\n",
        '<?xml version="1.0" encoding="utf-8"?>',
        " <?xml version='1.0'?>",
        "<?xml?>",
        "<?xml version='1.0\"?>",
        "<?xml version='1.0' encoding='ascii'?>",
        "\ufeff",
    ]
)


def read(decode: Any, body: bytes) -> Any:
    try:
        return decode(body, LIMIT)
    except ProtocolError:
        return ProtocolError


@settings(max_examples=examples(600))
@given(declarations, st.lists(documents(), max_size=3), blanks, st.sampled_from(["m", "a.b", "", "<x/>"]))
@example("<?xml version='1.0'?>", ["<value>" + " " * 100 + "<int>5</int></value>"], "", "m")
def test_on_any_call_the_quick_reader_agrees_or_gives_up(
    declaration: str, params: list[str], gap: str, method: str
) -> None:
    body = f"{declaration}{gap}<methodCall><methodName>{method}</methodName>{gap}<params>"
    body += "".join(f"<param>{gap}{param}</param>" for param in params) + f"</params>{gap}</methodCall>{gap}"
    with suppress(xmlrpc_fast.NeedsExpat):
        quick = xmlrpc_fast.decode_call(body.encode(), LIMIT)
        assert repr(quick) == repr(read(xmlrpc_expat.decode_call, body.encode()))


@settings(max_examples=examples(400))
@given(st.data())
def test_on_a_damaged_document_the_quick_reader_agrees_or_gives_up(data: st.DataObject) -> None:
    body = bytearray(encode_response([1, {"a": "b", "c": [True, 2.5]}, "x&y"]))
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(body) - 1))
        body[at : at + data.draw(st.integers(0, 3))] = data.draw(st.binary(max_size=3))
    with suppress(xmlrpc_fast.NeedsExpat):
        quick = xmlrpc_fast.decode_response(bytes(body), LIMIT)
        value, is_fault = xmlrpc_expat.decode_response(bytes(body), LIMIT)
        assert not is_fault
        assert repr(quick) == repr(value)


@pytest.mark.parametrize(
    "params", [("/n", "/key"), ("/n", 5, -1.5, True), ("/n", {"a": {"b": [1, 2]}, "ü": ""}), ()]
)
def test_the_quick_reader_reads_documents_of_ros_peers(params: tuple[Any, ...]) -> None:
    import xmlrpc.client

    assert xmlrpc_fast.decode_call(encode_call("m", params), 100) == ("m", params)
    assert xmlrpc_fast.decode_call(xmlrpc.client.dumps(params, "m").encode(), 100) == ("m", params)
