"""The changes that a launch makes to the parameter server, in order."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from pipros.basics.errors import Refused
from pipros_tools.launch.model import Launch, LaunchError, ParameterAction, ParameterCommand
from pipros_tools.launch.param_upload import upload


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
        if isinstance(value, object) and type(value) is object:
            raise TypeError("cannot marshal an object")
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
        LaunchError, match=r"cannot dump the parameters of \[/a\] to \[.*missing/a.yaml\]: No such"
    ):
        upload(Launch(commands=(dump("/a", tmp_path / "missing" / "a.yaml"),)), FakeServer(a=1))


@pytest.mark.parametrize(("value", "complaint"), [
    (object(), r"cannot set the parameter \[/p\] to <object .*cannot marshal"),
    ("too large", r"the parameter \[/p\] was not set: there is no room for it"),
])  # fmt: skip
def test_a_value_that_is_not_accepted_is_named(value: object, complaint: str) -> None:
    with pytest.raises(LaunchError, match=complaint):
        upload(Launch(params={"/p": value}), FakeServer())
