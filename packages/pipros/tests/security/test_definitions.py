"""Types and definitions of peers: exhausting, differing, or named like modules; YAML and expressions."""

import gc
import subprocess
import sys
import tracemalloc
import weakref
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from std_msgs.msg import Empty

from pipros.basics.env import Environment
from pipros.basics.errors import NotFound
from pipros.basics.limits import Limits
from pipros.master.master import Master
from pipros.msg import load_message_class, load_service_class
from pipros.msg.class_finder import ClassFinder
from pipros.msg.compile.arrays import EMPTY_ELEMENTS
from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.errors import DeserializationError
from pipros.msg.importing.load import installed_md5
from pipros.msg.language.digest import DEPTH_LIMIT, SEPARATOR
from pipros.msg.language.spec import DefinitionError
from pipros.node import Node
from pipros.node.any_msg import AnyMsg
from pipros.safe.yaml import YamlError, load
from pipros_tools.bag.errors import BagError
from pipros_tools.bag.images import image_file
from pipros_tools.cli.rostopic.delay import Delays
from tests.support.constants import Constants, changed
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

# Definitions of peers that would exhaust memory or time are refused early.


def text_of(first: str, **others: str) -> str:
    """A full text: the definition of a/T, and those of other types by name."""
    return first + "".join(f"\n{SEPARATOR}\nMSG: a/{name}\n{text}" for name, text in others.items())


def made(text: str) -> Any:
    return message_classes_from_text("a/T", text)["a/T"]


def refusal(text: str, limits: Limits | None = None) -> str:
    with pytest.raises(DefinitionError) as raised:
        message_classes_from_text("a/T", text, limits)
    return str(raised.value)


class TestReading:
    """A few bytes create only a few objects."""

    FIXED_IN_ELEMENTS = text_of("E[] es", E="C[50000] cs", C="")
    ONE_BYTE_FOR_MANY = text_of("E[] es", E="uint8 x\nC[50000] cs", C="")
    ZERO_LENGTHS = text_of("E[] es", E="\n".join(f"int32[0] x{i}" for i in range(1000)))
    WRAPPED = text_of("E0[] es", **{f"E{i}": f"E{i + 1} e" for i in range(50)}, E50="bool b")

    @pytest.mark.parametrize(
        ("text", "data"),
        [
            (FIXED_IN_ELEMENTS, (80).to_bytes(4, "little")),
            (ONE_BYTE_FOR_MANY, (80).to_bytes(4, "little") + bytes(80)),
            (ZERO_LENGTHS, (60_000).to_bytes(4, "little")),
            (WRAPPED, (60_000).to_bytes(4, "little") + bytes(60_000)),
        ],
        ids=["fixed arrays in elements", "a byte for many", "arrays of length zero", "wrapped"],
    )
    def test_elements_are_counted_with_the_values_that_they_hold(self, text: str, data: bytes) -> None:
        cls = made(text)

        assert_refused_without_memory(cls, data)

    def test_arrays_of_empty_messages_are_counted_together(self) -> None:
        """Twenty arrays of 60,000, each of which would be allowed alone."""
        cls = made(text_of("E[] es", E="C[] cs", C=""))

        assert_refused_without_memory(cls, (20).to_bytes(4, "little") + (60_000).to_bytes(4, "little") * 20)

    def test_numpy_and_replaced_characters_change_nothing(self) -> None:
        cls = made(text_of("string s\nE[] es", E="C[50000] cs", C=""))
        data = b"\1\0\0\0\xff" + (80).to_bytes(4, "little")

        with pytest.raises(DeserializationError, match="more values than its size allows"):
            cls().deserialize_numpy(data, None)
        with pytest.raises(DeserializationError, match="more values than its size allows"):
            cls().deserialize(data)

    def test_elements_with_bytes_in_the_message_are_not_counted(self) -> None:
        cls = made(text_of("E[] es", E="bool b\nC c", C=""))

        assert len(cls().deserialize((200_000).to_bytes(4, "little") + bytes(200_000)).es) == 200_000

    def test_as_many_empty_messages_as_the_limit_says_are_read(self) -> None:
        cls = made(text_of("E[] es\nE[] more", E=""))
        half = EMPTY_ELEMENTS // 2

        read = cls().deserialize(half.to_bytes(4, "little") * 2)

        assert len(read.es) + len(read.more) == EMPTY_ELEMENTS
        with pytest.raises(DeserializationError, match="has 1 more values"):
            cls().deserialize(half.to_bytes(4, "little") + (half + 1).to_bytes(4, "little"))


def assert_refused_without_memory(cls: Any, data: bytes) -> None:
    tracemalloc.start()
    try:
        with pytest.raises(DeserializationError, match="more values than its size allows"):
            cls._from_bytes(data)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 20_000_000


class TestCompiling:
    @pytest.mark.parametrize(
        "text", [text_of("C[100000] cs", C=""), text_of("D[65000] d", D="E[60] e", E="")],
        ids=["many", "many of many"],
    )  # fmt: skip
    def test_a_message_that_holds_too_much_without_bytes_is_refused_before_any_is_made(self, text) -> None:
        """A class of the second type would create 3.9 million objects for each empty message."""
        tracemalloc.start()
        try:
            assert "exceed the budget of eight values per byte" in refusal(text)
            peak = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
        assert peak < 20_000_000

    def test_the_fields_of_the_message_itself_are_counted(self) -> None:
        """As many as fit into a connection header; compiling all of them once took 16 seconds."""
        words = refusal("\n".join(f"string f{i}" for i in range(60_000)))

        assert (
            "the types in the text have 60000 fields in total; the limit is 3000 (definition_fields" in words
        )

    def test_the_fields_of_all_types_are_counted_together(self) -> None:
        large = "\n".join(f"string f{i}" for i in range(1000))
        others = {f"U{i}": "\n".join(f"Large l{j}" for j in range(15)) for i in range(100)}

        words = refusal(text_of("int32 x", Large=large, **others))

        assert "fields in total; the limit is 3000 (" in words

    def test_constants_are_counted(self) -> None:
        words = refusal("\n".join(f"int8 C{i}=1" for i in range(20_001)))

        assert "fields in total; the limit is 3000 (" in words

    def test_a_text_is_not_multiplied_by_the_types_that_embed_it(self) -> None:
        comment = "# " + "x" * 100_000
        others = {f"U{i}": "Large l" for i in range(900)}

        words = refusal(text_of("int32 x", Large=f"int32 x\n{comment}", **others))

        assert "each with its embedded types, exceed 67108864 bytes in total" in words

    def test_nesting_is_counted_through_types_that_were_met_before(self) -> None:
        chains = {f"A{i}": f"A{i + 1} x" for i in range(90)} | {"A90": "int8 x"}
        chains |= {f"B{i}": f"B{i + 1} x" for i in range(90)} | {"B90": "A0 a"}

        words = refusal(text_of("A0 a\nB0 b", **chains))

        assert f"nested deeper than {DEPTH_LIMIT}" in words

    def test_the_limits_apply(self) -> None:
        with changed(DEFINITION_BYTES=3):
            assert "longer than 3 characters" in refusal("int32 x", Limits())
        with changed(DEFINITION_TYPES=1):
            assert "more than 1 types" in refusal(text_of("int32 x", U=""), Limits())
        assert "fields in total; the limit is 1 (" in refusal("int32 x\nint32 y", Limits(definition_fields=1))
        with changed(MESSAGE_VALUES=8):
            assert "too many values; the limit is 8" in refusal("int32[9] x", Limits())


# Peers and bags with types that have the names of well-known ones, but other fields.


OTHER_HEADER = f"Header header\n{'=' * 80}\nMSG: std_msgs/Header\nstring stamp\n"


@pytest.fixture
def liar(ros: RosSystem) -> Iterator[Node]:
    ros.serve_master()
    with ros.node("liar") as node:
        yield node


def test_rosconsole_names_a_log_of_another_definition(ros: RosSystem, liar: Node) -> None:
    log = message_classes_from_text("rosgraph_msgs/Log", "string level\n")["rosgraph_msgs/Log"]
    liar.advertise("/rosout", log, latch=True).publish(log("x"))
    echo = ros.pipros.run("rosconsole", "echo")
    echo.check(1, "/liar publishes [rosgraph_msgs/Log/")


def test_rostopic_delay_needs_the_stamp_of_a_header(capsys: pytest.CaptureFixture[str]) -> None:
    stamped = message_classes_from_text("a/Stamped", OTHER_HEADER)["a/Stamped"]
    assert stamped._has_header
    raw = AnyMsg(b"\1\0\0\0x")
    fields = {"type": "a/Stamped", "md5sum": stamped._md5sum, "message_definition": OTHER_HEADER}
    raw._connection_header = fields
    Delays().add(raw, 1)
    assert "msg does not have header" in capsys.readouterr().err


def test_definitions_that_change_for_ever_take_bounded_memory(constants: Constants) -> None:
    constants(DEFINITION_CACHE_BYTES=200000)
    finder = ClassFinder()
    found = []
    for number in range(100):
        text = f"int32 field_{number}\n"
        found.append(weakref.ref(finder.find("a/T", f"{number:032}", text)))
    gc.collect()
    assert sum(each() is not None for each in found) <= 10
    assert finder.find("a/T", f"{99:032}", text) is found[-1]()


@pytest.mark.parametrize("name", ["sensor_msgs/Image", "sensor_msgs/CompressedImage"])
def test_an_image_of_another_definition_is_not_exported(name: str) -> None:
    image = message_classes_from_text(name, "string encoding\n")[name]("rgb8")
    with pytest.raises(BagError, match="must equal an installed package's"):
        image_file(image)


# A type name chosen by a peer imports only modules of message packages.


TEXT_OF_THIS = "Beautiful is better than ugly"


@pytest.fixture
def modules(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder on the path with a module, a package and a namespace package that report their execution."""
    loud = "raise AssertionError('was imported')"
    (tmp_path / "loud_module.py").write_text(loud)
    (tmp_path / "loud_package" / "msg").mkdir(parents=True)
    (tmp_path / "loud_package" / "__init__.py").write_text(loud)
    (tmp_path / "loud_package" / "msg" / "__init__.py").write_text("Foo = 1")
    (tmp_path / "quiet_package" / "msg").mkdir(parents=True)
    (tmp_path / "quiet_package" / "msg" / "__init__.py").write_text(loud)
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    for name in [name for name in sys.modules if name.partition(".")[0] in ("made_msgs", "quiet_package")]:
        del sys.modules[name]


@pytest.mark.parametrize("package", ["loud_module", "loud_package", "quiet_package", "this", "antigravity"])
def test_modules_that_are_not_message_packages_are_not_imported(modules: Path, package: str) -> None:
    for load_class in (load_message_class, load_service_class):
        with pytest.raises(NotFound, match=f"there is no package {package}"):
            load_class(f"{package}/Foo")
    assert package not in sys.modules


def test_classes_that_genpy_generated_are_found_on_the_path(modules: Path) -> None:
    for kind, name in (("msg", "Foo"), ("srv", "Bar")):
        (modules / "made_msgs" / kind).mkdir(parents=True)
        (modules / "made_msgs" / kind / "__init__.py").write_text(f"from ._{name} import *\n")
        (modules / "made_msgs" / kind / f"_{name}.py").write_text(f"class {name}:\n    _md5sum = '0'\n")

    assert load_message_class("made_msgs/Foo").__name__ == "Foo"
    assert load_service_class("made_msgs/Bar").__name__ == "Bar"
    with pytest.raises(NotFound):
        load_message_class("made_msgs/Missing")


def test_the_md5_sum_of_an_installed_type_is_known_without_an_import(modules: Path) -> None:
    sources = {
        "_Foo": f'class Foo:\n  _md5sum = "{"a" * 32}"\nraise AssertionError("was imported")',
        "_Bar": "class Bar: pass",
    }
    for name, source in sources.items():
        (modules / "loud_package" / "msg" / f"{name}.py").write_text(source)
    names = ["std_msgs/String", "loud_package/Foo", "loud_package/Bar", "loud_package/None", "this/Foo", "x"]

    assert [installed_md5(name) for name in names] == [
        "992ce8a1687cec8c8bd883ec73ca41d1", "a" * 32, *[None] * 4,
    ]  # fmt: skip
    assert not {"loud_package", "this"} & set(sys.modules)


def test_a_class_that_is_not_a_message_is_not_returned(modules: Path) -> None:
    (modules / "made_msgs" / "msg").mkdir(parents=True)
    (modules / "made_msgs" / "msg" / "__init__.py").write_text("Foo = 1\n")
    (modules / "made_msgs" / "msg" / "_Foo.py").write_text("")

    with pytest.raises(NotFound):
        load_message_class("made_msgs/Foo")


def test_tools_do_not_import_modules_named_by_a_peer(ros: RosSystem) -> None:
    """`import this` would print a poem."""
    message_class = message_classes_from_text("this/Foo", "string data")["this/Foo"]
    service_class: Any = type(
        "Foo", (),
        {"_type": "this/Foo", "_md5sum": "0" * 32, "_request_class": Empty, "_response_class": Empty},
    )  # fmt: skip
    with (
        Master(host="127.0.0.1", port=ros.port) as master,
        Node("peer", environment=Environment(master_uri=master.uri)) as node,
    ):
        node.advertise("/wisdom", message_class, latch=True).publish(message_class("heard"))
        node.serve("/wise", service_class, lambda _: Empty())
        outputs = {
            command: ros.pipros.run(*command.split()).output
            for command in (
                "rostopic echo -n1 /wisdom", "rostopic pub -1 /wisdom this/Foo {}",
                "rosservice call /wise {}", "rosservice args /wise",
                "pipros-complete 3 rosservice call /wise", "pipros-complete 4 rostopic pub /wisdom this/Foo",
            )
        }  # fmt: skip

    assert "heard" in outputs["rostopic echo -n1 /wisdom"]
    assert [command for command, output in outputs.items() if TEXT_OF_THIS in output] == []
    assert "Unable to load type [this/Foo]" in outputs["rosservice call /wise {}"]


# Untrusted YAML that would crash the process, or exhaust memory or time, is refused.


MODULUS = (1 << 61) - 1
"""Python gives all multiples of it the same hash."""


@pytest.mark.parametrize(
    "text", ["[" * 40_000, "{a: " * 40_000, "- " * 40_000, "? " * 40_000, "[" * 40_000 + "]" * 40_000],
    ids=["lists", "mappings", "lines", "keys", "closed lists"],
)  # fmt: skip
def test_deep_nesting_does_not_crash_the_process(text: str, tmp_path: Path) -> None:
    file = tmp_path / "deep.yaml"
    file.write_text(text)
    code = f"from pipros.safe.yaml import load; load(open({str(file)!r}), 'deep.yaml')"

    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)

    assert done.returncode == 1, done.returncode
    assert "YamlError: deep.yaml:1:" in done.stderr
    assert "nested more than 100 deep" in done.stderr


def test_roslaunch_refuses_a_file_that_is_nested_too_deep(ros: RosSystem, tmp_path: Path) -> None:
    (tmp_path / "deep.yaml").write_text("[" * 40_000)
    launch = tmp_path / "deep.launch"
    launch.write_text(f'<launch><rosparam file="{tmp_path}/deep.yaml"/></launch>')

    run = ros.pipros.run("roslaunch", "--dump-params", launch)

    assert run.returncode == 0  # like genuine roslaunch, which prints only the error
    assert "nested more than 100 deep" in run.output


def test_merged_mappings_do_not_grow_exponentially() -> None:
    lines = ["a0: &a0 {x: 1}", *(f"a{n}: &a{n} {{<<: [*a{n - 1}, *a{n - 1}]}}" for n in range(1, 60))]

    with pytest.raises(YamlError, match="expands to more than 1000000 values"):
        load("\n".join(lines))


def test_keys_with_one_hash_are_refused() -> None:
    text = "".join(f"{MODULUS * (n + 1)}: 0\n" for n in range(20_000))

    with pytest.raises(YamlError, match="more than 1000 numbers are longer than 20 digits"):
        load(text)


def test_sexagesimal_numbers_are_limited() -> None:
    with pytest.raises(YamlError, match="longer than 4300 digits"):
        load("1" + ":1" * 300_000)


def test_directives_are_not_compared_without_end() -> None:
    text = "".join(f"%TAG !{n}! x:\n" for n in range(60_000)) + "--- 1\n"

    for content in (text, text.encode(), text.encode("utf-16")):
        with pytest.raises(YamlError, match="more than 100 %TAG directives"):
            load(content)


# Regular expressions that other nodes set as parameters cannot block a process.


ANALYZERS = {"a": {"type": "GenericAnalyzer", "path": "A", "regex": "(a+)+$"}}
STATUS = "a" * 40 + "!"


def test_an_aggregator_gives_up_a_regex_that_takes_too_long(ros: RosSystem) -> None:
    ros.serve_master()
    newest: dict[str, str] = {}

    def keep(array: Any) -> None:
        newest.update({status.name: status.message for status in array.status})

    with ros.node("peer") as node:
        node.master.set_param("/diagnostic_aggregator/analyzers", ANALYZERS)
        aggregator = ros.pipros.start("rosrun", "diagnostic_aggregator", "aggregator_node", "_pub_rate:=50")
        node.subscribe("/diagnostics_agg", DiagnosticArray, keep)
        array = DiagnosticArray(status=[DiagnosticStatus(0, STATUS, "m", "hw", [])])
        array.header.stamp.secs = 1
        node.advertise("/diagnostics", DiagnosticArray, latch=True).publish(array)

        wait_until(lambda: f"/Other/{STATUS}" in newest, 60, lambda: f"{newest} {aggregator.output}")
        assert newest["/A"] == "A regex takes too long and is no longer used"
        aggregator.press_ctrl_c(code=0)
