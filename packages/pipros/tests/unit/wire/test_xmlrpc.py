"""XML-RPC documents: values survive a round trip, in the form that genuine peers use."""

import datetime
import math
import subprocess
import sys
import xmlrpc.client
from contextlib import suppress
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from pipros.basics.errors import LimitExceeded, ProtocolError
from pipros.wire import xmlrpc_expat, xmlrpc_fast
from pipros.wire.xmlrpc import (
    ANSWER_NESTING_LIMIT,
    NESTING_LIMIT,
    Encoded,
    Fault,
    ValueTooLarge,
    decode_call,
    decode_response,
    encode_call,
    encode_fault,
    encode_response,
)
from tests.support.examples import examples

texts = st.text(
    st.characters(blacklist_categories=["Cs", "Cc"], blacklist_characters="\ufffe\uffff")
    | st.sampled_from("\t\n<>&\"'")
)


values = st.recursive(
    texts
    | st.integers(-(2**31), 2**31 - 1)
    | st.booleans()
    | st.floats(allow_nan=False)
    | st.binary().map(xmlrpc.client.Binary),
    lambda inner: st.lists(inner) | st.dictionaries(texts, inner),
    max_leaves=20,
)


@given(st.lists(values))
def test_calls_survive_a_round_trip(params: list[Any]) -> None:
    assert decode_call(encode_call("setParam", params)) == ("setParam", tuple(params))


@given(values)
def test_python_reads_our_documents_and_we_read_pythons(value: Any) -> None:
    assert xmlrpc.client.loads(encode_response(value))[0][0] == value
    assert decode_response(xmlrpc.client.dumps((value,), methodresponse=True).encode()) == value


def test_documents_have_the_form_that_the_c_plus_plus_parser_of_roscpp_expects() -> None:
    assert encode_call("getParam", ("/node", "/a<b")) == (
        b"<?xml version='1.0'?>\n<methodCall><methodName>getParam</methodName><params>"
        b"<param><value><string>/node</string></value></param>"
        b"<param><value><string>/a&lt;b</string></value></param></params></methodCall>\n"
    )
    assert encode_response((1, True, 0.5, {"a": []})) == (
        b"<?xml version='1.0'?>\n<methodResponse><params><param><value><array><data>"
        b"<value><int>1</int></value><value><boolean>1</boolean></value><value><double>0.5</double></value>"
        b"<value><struct><member><name>a</name><value><array><data></data></array></value></member></struct>"
        b"</value></data></array></value></param></params></methodResponse>\n"
    )


def test_documents_of_roscpp_are_decoded() -> None:
    request = (
        b'<?xml version="1.0"?>\r\n<methodCall><methodName>setParam</methodName>\r\n<params>'
        b"<param><value>/n</value></param><param><value><i4>5</i4></value></param>"
        b"<param><value><double>1.5000000000000000</double></value></param>"
        b"<param><value><boolean>0</boolean></value></param></params></methodCall>\r\n"
    )
    assert decode_call(request) == ("setParam", ("/n", 5, 1.5, False))


@pytest.mark.parametrize(("document", "value"), [
    ("<value>text</value>", "text"), ("<value></value>", ""), ("<value/>", ""), ("<value> x </value>", " x "),
    ("<value><string/></value>", ""), ("<value>\n <int> 5 </int>\n</value>", 5),
    ("<value><i8>-7</i8></value>", -7), ("<value><double>inf</double></value>", math.inf),
    ("<value><boolean> 1 </boolean></value>", True), ("<value><array><data/></array></value>", []),
    ("<value><struct/></value>", {}),
    ("<value><string>a<![CDATA[<b>]]>&#99;<!-- no --></string></value>", "a<b>c"),
    ("<value><string>&lt;&amp;&gt;&quot;&apos;</string></value>", "<&>\"'"),
    ("<value><string kind='x'>a\r\nb</string></value>", "a\nb"),
    ("<value><base64>aGk=</base64></value>", xmlrpc.client.Binary(b"hi")),
    ("<value><dateTime.iso8601>20200101T00:00:00</dateTime.iso8601></value>",
        xmlrpc.client.DateTime("20200101T00:00:00")),
    ("<value><struct><member>\n<name>a</name>\n<value>1</value></member>"
        "<member><name>a</name><value><int>2</int></value></member></struct></value>", {"a": 2}),
])  # fmt: skip
def test_every_legal_way_to_write_a_value_is_read(document: str, value: Any) -> None:
    body = f"<?xml version='1.0'?><methodResponse><params><param>{document}</param></params></methodResponse>"
    assert decode_response(body.encode()) == value


def test_other_encodings_are_read_when_the_document_names_them() -> None:
    body = (
        encode_response("ü").replace(b"'1.0'", b"'1.0' encoding='iso-8859-1'").replace("ü".encode(), b"\xfc")
    )
    assert decode_response(body) == "ü"


@pytest.mark.parametrize("document", [
    "<value><nil/></value>", "<value><int>x</int></value>", "<value><int>1_0</int></value>",
    "<value><int>2147483648</int></value>", "<value><i8>-2147483649</i8></value>",
    "<value><int>99999999999999999999999999</int></value>", "<value><double>1_0.0</double></value>",
    "<value><double>x</double></value>", "<value><boolean>2</boolean></value>",
    "<value><base64>a</base64></value>", "<value><int>1</int><int>2</int></value>",
    "<value>text<int>1</int></value>", "<value><struct><name>a</name></struct></value>",
    "<value><struct><member><value>1</value><name>a</name></member></struct></value>",
    "<value><struct><member><name>a</name></member></struct></value>", "<value><array></array></value>",
    "<value><array><data><int>1</int></data></array></value>", "<value><string>&unknown;</string></value>",
    "<value><string>a]]>b</string></value>", "<value><string>\x01</string></value>",
    "<value><string>\ufffe</string></value>", "<value><string>a</value>", "<value>1</value><value>2</value>",
    "<VALUE>1</VALUE>", "",
])  # fmt: skip
def test_an_invalid_value_is_refused(document: str) -> None:
    body = f"<methodResponse><params><param>{document}</param></params></methodResponse>"
    with pytest.raises(ProtocolError):
        decode_response(body.encode())
    call = f"<methodCall><methodName>m</methodName><params><param>{document}</param></params></methodCall>"
    with pytest.raises(ProtocolError):
        decode_call(call.encode())


@pytest.mark.parametrize("body", [
    b"", b"hello", b"\xff\xfe", b"<methodCall/>", b"<methodCall><methodName>m</methodName>",
    b"<methodCall><params/></methodCall>",
    b"<methodCall><methodName>m</methodName><params/></methodCall>trailing",
    b"<methodCall><methodName>m</methodName><params></params></methodCall><methodCall/>",
    b"<methodCall><methodName>m</methodName><params/><params/></methodCall>",
    b"<methodCall><methodName>m</methodName><params><param/></params></methodCall>",
    b"<?xml version='1.0' encoding='no-such'?><methodCall><methodName>m</methodName></methodCall>",
    encode_response(1),
])  # fmt: skip
def test_an_invalid_call_is_refused(body: bytes) -> None:
    with pytest.raises(ProtocolError):
        decode_call(body)


def test_a_call_may_come_without_a_params_element() -> None:
    assert decode_call(b"<methodCall><methodName>m</methodName></methodCall>") == ("m", ())


def test_a_document_type_is_refused_at_once_and_so_are_its_entities() -> None:
    bomb = b"""<?xml version="1.0"?><!DOCTYPE b [<!ENTITY a "aaaaaaaaaa"><!ENTITY c "&a;&a;&a;&a;">]>
    <methodCall><methodName>m</methodName><params><param><value>&c;</value></param></params></methodCall>"""
    with pytest.raises(ProtocolError, match="DTD"):
        decode_call(bomb)


def test_a_large_document_is_read_the_same_in_slices() -> None:
    value = ["ä€𝄞 <&" * 9_000, {"k" * 5000: list(range(20_000))}, "z" * 100_000]
    plain = encode_call("setParam", (value,))
    thorough = plain.replace(b"<methodCall>", b"<methodCall><!-- not for the quick reader -->")
    assert decode_call(thorough) == decode_call(plain) == ("setParam", (value,))


@pytest.mark.parametrize("document", [
    b"x" * 200_000, b"<methodCall " + b" ".join(b"a%d='' " % number for number in range(20_000)) + b">",
    b"<methodCall><!--" + b"x" * 200_000 + b"-->", b"<?xml version='1.0'?><?" + b"x" * 200_000 + b"?>",
    b"<methodCall><methodName>m</methodName><params><param><value a='" + b"x" * 200_000 + b"'>",
])  # fmt: skip
def test_an_unterminated_tag_or_comment_is_refused_early(document: bytes) -> None:
    with pytest.raises(LimitExceeded, match="a tag or comment in XML-RPC must have at most 65536 bytes"):
        decode_call(document)


def test_values_nest_to_the_limit_and_no_deeper() -> None:
    def nested(depth: int) -> bytes:
        opened = "<value><array><data>" * depth
        closed = "</data></array></value>" * depth
        return f"<params><param>{opened}<value>x</value>{closed}</param></params>".encode()

    def call(depth: int) -> Any:
        return decode_call(b"<methodCall><methodName>m</methodName>" + nested(depth) + b"</methodCall>")[1][0]

    def response(depth: int) -> Any:
        return decode_response(b"<methodResponse>" + nested(depth) + b"</methodResponse>")

    for decode, limit in ((call, NESTING_LIMIT), (response, ANSWER_NESTING_LIMIT)):
        value = decode(limit)
        for _ in range(limit):
            [value] = value
        assert value == "x"
        for depth in (limit + 1, 100_000):
            with pytest.raises(LimitExceeded, match="must be nested at most"):
                decode(depth)


def test_every_value_read_from_a_call_can_be_encoded() -> None:
    value: Any = []
    for _ in range(NESTING_LIMIT - 1):
        value = [value]
    [back] = decode_call(encode_call("m", (value,)))[1]
    assert decode_response(encode_response([1, "", Encoded(back)])) == [1, "", value]
    with pytest.raises(TypeError, match="nested this deeply"):
        encode_call("m", ([value],))


def test_a_document_larger_than_the_limit_is_refused() -> None:
    with pytest.raises(LimitExceeded, match="the limit is 10"):
        decode_call(encode_call("m", ()), limit_bytes=10)


@pytest.mark.parametrize("value", [None, {1, 2}, {1: "a"}, object(), [None], {"a": {"b": None}}])
def test_values_that_xml_rpc_cannot_carry_raise_type_error_before_sending(value: Any) -> None:
    with pytest.raises(TypeError):
        encode_call("setParam", ("/n", value))


@pytest.mark.parametrize("value", [2**31, -(2**31) - 1])
def test_integers_beyond_32_bits_are_an_overflow_error(value: int) -> None:
    with pytest.raises(OverflowError, match="int exceeds XML-RPC limits"):
        encode_response(value)


@pytest.mark.parametrize("text", ["\x00", "\x1b[0m", "\ud800", "\uffff"])
def test_characters_that_xml_cannot_carry_are_a_value_error(text: str) -> None:
    with pytest.raises(ValueError, match="XML-RPC cannot represent the character"):
        encode_response(text)


def test_a_list_that_contains_itself_is_a_type_error() -> None:
    endless: list[Any] = []
    endless.append(endless)
    with pytest.raises(TypeError, match="recursive"):
        encode_response(endless)


def test_bytes_and_dates_are_carried() -> None:
    assert decode_response(encode_response(b"\x00\xff")).data == b"\x00\xff"
    when = datetime.datetime(2020, 1, 2, 3, 4, 5)  # noqa: DTZ001  # XML-RPC knows no time zones
    assert decode_response(encode_response(when)).value == "20200102T03:04:05"
    assert decode_response(encode_response(xmlrpc.client.DateTime("20200102T03:04:05"))) == when


def test_a_fault_is_raised_with_its_code_and_text() -> None:
    with pytest.raises(Fault) as caught:
        decode_response(encode_fault(-1, "no <such> method\x00"))
    assert (caught.value.code, caught.value.text) == (-1, "no <such> method?")


@pytest.mark.parametrize("content", ["<value>x</value>", "<value><struct></struct></value>"])
def test_a_fault_without_code_is_a_protocol_error(content: str) -> None:
    with pytest.raises(ProtocolError, match="faultCode"):
        decode_response(f"<methodResponse><fault>{content}</fault></methodResponse>".encode())


@pytest.mark.parametrize("value", [
    {"a": ["x"] * 1000}, [[["x"] * 10] * 10], "x" * 100_000, {"k" * 100_000: 1}, b"x" * 100_000,
    Encoded("x" * 100_000),
], ids=["elements", "nested", "text", "key", "binary", "encoded"])  # fmt: skip
def test_a_large_value_is_noticed_before_it_is_encoded(value: Any) -> None:
    assert encode_response(value)
    with pytest.raises(ValueTooLarge):
        encode_response(value, size_limit=100)
    assert encode_response(["x" * 400] * 10, size_limit=100)


@pytest.mark.parametrize("text", ["x", "ä€😀", "a & b\n<c>\t"])
def test_long_texts_and_documents_are_unchanged(text: str) -> None:
    value = {"text": text * 3_000, text.strip() * 400: [text] * 3_000}
    assert decode_response(encode_response(value)) == value
    assert xmlrpc.client.loads(encode_call("m", (value,))) == ((value,), "m")
    with pytest.raises(ValueError, match="cannot represent"):
        encode_response(text * 3_000 + "\x01")


def test_an_encoded_value_is_inserted_unchanged() -> None:
    assert encode_response([Encoded({"a": 1}), 2]) == encode_response([{"a": 1}, 2])


@pytest.mark.parametrize("kind", ["call", "response"])
@pytest.mark.parametrize(("count", "size"), [("BRIEF_DOCUMENTS", "0"), ("0", "BRIEF_BYTES")])
def test_the_fast_reader_is_imported_for_long_or_many_documents(kind: str, count: str, size: str) -> None:
    script = (
        "import sys\n"
        "from pipros.wire.xmlrpc import BRIEF_BYTES, BRIEF_DOCUMENTS\n"
        "from pipros.wire.xmlrpc import decode_call, decode_response, encode_call, encode_response\n"
        "def read(value):\n"
        f"    if {kind!r} == 'call':\n"
        "        assert decode_call(encode_call('m', value)) == ('m', value)\n"
        "    else:\n"
        "        assert decode_response(encode_response([*value])) == [*value]\n"
        f"for _ in range({count}):\n"
        "    read((1, '', {'a': 2.5}))\n"
        "print('pipros.wire.xmlrpc_fast' in sys.modules)\n"
        f"read(('x' * {size},))\n"
        "print('pipros.wire.xmlrpc_fast' in sys.modules)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "True"]


# The quick XML-RPC reader agrees with the complete one, or leaves the text to it.


LIMIT = 5


blanks = st.sampled_from(["", "", "", " ", "\n", "\t\n  "])


numbers = st.sampled_from(["5", "-7", "+1", "99999999999", "1.5", "1e5", ".", "1", "0", " 5 ", "nan"])


odd_texts = st.sampled_from(["", "x", "ü", "true", "&lt;", "&amp", "&#65;", "]]>", "\ufffe", "\r\n", "\x00"])


scraps = numbers | odd_texts | st.sampled_from(["<!-- c -->", "<![CDATA[x]]>", "<?pi?>"])


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


declarations = st.sampled_from([
    "", "<?xml version='1.0'?>\n", '<?xml version="1.0" encoding="utf-8"?>', " <?xml version='1.0'?>",
    "<?xml?>", "<?xml version='1.0\"?>", "<?xml version='1.0' encoding='ascii'?>", "\ufeff",
])  # fmt: skip


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

    assert xmlrpc_fast.decode_call(encode_call("m", params), 100) == ("m", params)
    assert xmlrpc_fast.decode_call(xmlrpc.client.dumps(params, "m").encode(), 100) == ("m", params)
