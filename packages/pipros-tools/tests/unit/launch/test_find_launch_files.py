from pathlib import Path
from typing import Any

import pytest

from pipros.basics.errors import Refused
from pipros.wire.xmlrpc import encode_call
from pipros_tools.launch.find_launch_files import NoSuchFiles, resolve_files
from pipros_tools.launch.model import Launch, LaunchError, ParameterAction, ParameterCommand
from pipros_tools.launch.param_upload import upload
from pipros_workspace.index import SHARED_PACKAGES, PackageIndex


@pytest.fixture
def index(tmp_path: Path) -> PackageIndex:
    package = tmp_path / "talkers"
    for path in ("launch/a.launch", "launch/twice.launch", "more/twice.launch", ".git/hidden.launch"):
        (package / path).parent.mkdir(parents=True, exist_ok=True)
        (package / path).touch()
    (package / "package.xml").write_text("<package><name>talkers</name></package>")
    return PackageIndex([tmp_path])


def test_launch_files_are_found_by_package_and_by_path(index: PackageIndex, tmp_path: Path) -> None:
    found = str(tmp_path / "talkers" / "launch" / "a.launch")
    assert resolve_files(["talkers", "a.launch"], index) == [found]
    assert resolve_files(["talkers", "launch/a.launch"], index) == [found]
    assert resolve_files([found], index) == [found]
    assert resolve_files([found, found], index) == [found, found]
    assert resolve_files(["talkers", "a.launch", found], index) == [found, found]
    assert (resolve_files(["-"], index), resolve_files([], index)) == (["-"], [])


@pytest.mark.parametrize(("words", "complaint"), [
    (["nope.launch"], r"^\[nope.launch\] is not a launch file name"),
    (
        ["talkers", "nope.launch"],
        r"^\[nope.launch\] is neither a launch file in package \[talkers\] nor is \[talkers\] a launch",
    ),
    (["nope", "a.launch"], r"^\[a.launch\] is neither a launch file in package \[nope\]"),
    (["talkers", "hidden.launch"], "is neither"),
    (["talkers", "twice.launch"], r"^multiple files named \[twice.launch\] in package \[talkers\]:\n- "),
])  # fmt: skip
def test_launch_files_that_are_not_found_are_refused_in_noetics_words(
    index: PackageIndex, words: list[str], complaint: str
) -> None:
    with pytest.raises(LaunchError, match=complaint):
        resolve_files(words, index)


def test_without_folders_to_search_the_error_says_what_to_set() -> None:
    with pytest.raises(LaunchError, match=r"launch file name\nROS_PACKAGE_PATH lists no workspace: "):
        resolve_files(["nope", "a.launch"], PackageIndex([SHARED_PACKAGES]))


@pytest.mark.parametrize(("words", "suggestion"), [
    (["talkers", "twice.lauch"], r"launch file name\nDid you mean twice.launch\?$"),
    (["talkers", "twice"], r"launch file name\nDid you mean twice.launch\?$"),
    (["launch/twice.lauch"], r"launch file name\nDid you mean twice.launch\?$"),
    (["talker", "a.launch"], r"launch file name\nDid you mean talkers\?$"),
])  # fmt: skip
def test_similar_names_are_suggested(index, tmp_path, monkeypatch, words: list[str], suggestion: str) -> None:
    monkeypatch.chdir(tmp_path / "talkers")
    with pytest.raises(LaunchError, match=suggestion):
        resolve_files(words, index)


def test_all_missing_files_are_named(index: PackageIndex) -> None:
    with pytest.raises(NoSuchFiles) as error:
        resolve_files(["talkers", "a.launch", "x", "y"], index)
    assert error.value.files == ("x", "y")


# The changes that a launch makes to the parameter server, in order.


class FakeServer:
    """A flat parameter server that records the calls that change it."""

    def __init__(self, **params: Any) -> None:
        self.params = {f"/{name}": value for name, value in params.items()}
        self.calls: list[tuple[Any, ...]] = []

    def get_param(self, key: str) -> Any:
        if key not in self.params:
            raise Refused("the master", -1, f"Parameter [{key}] is not set")
        return self.params[key]

    def set_param(self, key: str, value: Any) -> None:
        encode_call("setParam", (key, value))
        if value == "too large":
            raise Refused("the master", -1, "there is no room for it")
        self.calls.append(("set", key, value))

    def delete_param(self, key: str) -> None:
        self.calls.append(("delete", key))
        if key not in self.params:
            raise Refused("the master", -1, f"parameter [{key}] is not set")


def dump(key: str, file: Path | str = "") -> ParameterCommand:
    return ParameterCommand(ParameterAction.DUMP, key, str(file))


def test_commands_come_first_then_cleared_namespaces_then_parameters(tmp_path: Path) -> None:
    server = FakeServer(a={"x": [1, "two"]})
    delete = ParameterCommand(ParameterAction.DELETE, "/old")
    launch = Launch(
        commands=(dump("/a", tmp_path / "a.yaml"), delete),
        clear_params=("/ns/",),
        params={"/ns/b": 1, "/ns/a": 2},
    )
    upload(launch, server)
    assert server.calls == [("delete", "/old"), ("delete", "/ns/"), ("set", "/ns/b", 1), ("set", "/ns/a", 2)]
    assert (tmp_path / "a.yaml").read_text() == "x:\n- 1\n- two\n"


def test_a_dump_without_a_file_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    upload(Launch(commands=(dump("/a"), dump("/missing"))), FakeServer(a=5))
    assert capsys.readouterr().out == "5\n...\n{}\n"


def test_a_dump_that_cannot_be_written_names_parameter_and_file(tmp_path: Path) -> None:
    with pytest.raises(
        LaunchError, match=r"cannot dump the parameters of \[/a\] to \[.*missing/a.yaml\]: there is no folder"
    ):
        upload(Launch(commands=(dump("/a", tmp_path / "missing" / "a.yaml"),)), FakeServer(a=1))


@pytest.mark.parametrize(("value", "complaint"), [
    (object(), r"cannot set the parameter \[/p\] to <object .*must consist of booleans"),
    ("a\0b", r"cannot set the parameter \[/p\]: XML-RPC cannot represent the character '.x00'"),
    ("too large", r"the parameter \[/p\] was not set: there is no room for it"),
])  # fmt: skip
def test_a_value_that_is_not_accepted_is_named(value: object, complaint: str) -> None:
    with pytest.raises(LaunchError, match=complaint):
        upload(Launch(params={"/p": value}), FakeServer())
