"""Plugins of other distributions: one that is broken does not end the others, or any command."""

import json
import sys
from collections.abc import Iterator
from importlib.metadata import EntryPoint
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from pipros.basics import plugins
from pipros.basics.extras import install_command, missing
from pipros.basics.plugins import ENTRY_POINTS, Plugin, all_loaded, all_offered

GOOD = ["good_one", "good_two"]


BROKEN = {
    "broken_plugin:missing": "AttributeError",
    "broken_plugin:TEXT": "it must name a Plugin, got str",
    "no_such_module:PLUGIN": "ModuleNotFoundError: No module named 'no_such_module'",
}


def plugin(name: str, offer: str = "") -> Plugin:
    return Plugin(name, "test", offers={"test": offer} if offer else {}, check=offer)


@pytest.fixture(autouse=True)
def fresh_plugins(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    module = ModuleType("broken_plugin")
    module.TEXT, module.CHECK = "a text", "a check"  # type: ignore[attr-defined]
    for name in GOOD:
        setattr(module, name, plugin(name, "broken_plugin:CHECK"))
    module.offering = plugin("offering", "broken_plugin:missing")  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "broken_plugin", module)
    plugins._plugins_of_entry_points.cache_clear()
    yield
    plugins._plugins_of_entry_points.cache_clear()


def install(monkeypatch: pytest.MonkeyPatch, targets: list[str]) -> None:
    points = [EntryPoint(f"point_{number}", each, ENTRY_POINTS) for number, each in enumerate(targets)]
    monkeypatch.setattr("importlib.metadata.entry_points", lambda **_: points)


@pytest.mark.parametrize("place", range(len(GOOD) + 1))
@pytest.mark.parametrize("broken", BROKEN)
def test_a_plugin_that_cannot_be_loaded_is_left_out_by_name(
    broken: str, place: int, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    targets = [f"broken_plugin:{name}" for name in GOOD]
    targets.insert(place, broken)
    install(monkeypatch, targets)
    assert [each.name for each in plugins.plugins() if each not in plugins.named_plugins()] == GOOD
    (text,) = caplog.messages
    assert text.startswith(
        f"the entry point point_{place} = {broken} in the group {ENTRY_POINTS} is left out: "
    )
    assert BROKEN[broken] in text


@pytest.mark.parametrize("place", range(len(GOOD) + 1))
def test_an_offer_that_cannot_be_loaded_is_left_out_by_name(
    place: int, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    targets = [f"broken_plugin:{name}" for name in GOOD]
    targets.insert(place, "broken_plugin:offering")
    install(monkeypatch, targets)
    assert all_offered("test") == ["a check"] * len(GOOD)
    assert "broken_plugin:missing of the plugin offering is left out: AttributeError" in caplog.text
    assert all_loaded(lambda each: each.check).count("a check") == len(GOOD)


# The command in a hint installs an extra of this pipros, whatever its source.


NUMPY = ImportError("numpy.core.multiarray failed to import")


@pytest.fixture
def come_from(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Sets the record that pip makes of an installation."""

    def note(noted: object) -> None:
        text = noted if noted is None or isinstance(noted, str) else json.dumps(noted)
        monkeypatch.setattr(
            "importlib.metadata.distribution", lambda _: SimpleNamespace(read_text=lambda _: text)
        )

    monkeypatch.setattr("pipros.basics.words.ON_WINDOWS", False)  # the quotes of sh
    monkeypatch.setattr("shutil.which", lambda name: str(Path(sys.executable).parent / name))
    return note


def test_a_checkout_is_named(come_from: Any, tmp_path: Path) -> None:
    come_from({"url": tmp_path.as_uri(), "dir_info": {}})
    assert install_command("numpy") == f"pip install 'pipros[numpy] @ {tmp_path.as_uri()}'"


def test_an_editable_checkout_stays_editable(come_from: Any, tmp_path: Path) -> None:
    come_from({"url": tmp_path.as_uri(), "dir_info": {"editable": True}})
    assert install_command("lz4", "mcap") == f"pip install --editable '{tmp_path.as_posix()}[lz4,mcap]'"


def test_a_repository_is_named_with_its_commit(come_from: Any) -> None:
    come_from({"url": "https://example.org/p.git", "vcs_info": {"vcs": "git", "commit_id": "abc"}})
    assert install_command("numpy") == "pip install 'pipros[numpy] @ git+https://example.org/p.git@abc'"


@pytest.mark.parametrize("noted", [None, "{", {"url": "file:///gone/away"}, []])
def test_otherwise_the_index_is_asked(come_from: Any, noted: object) -> None:
    come_from(noted)
    assert install_command("numpy") == "pip install 'pipros[numpy]'"


def test_pip_of_another_environment_is_not_used(
    come_from: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    come_from(None)
    monkeypatch.setattr("shutil.which", lambda _: "/usr/bin/pip")
    python = str(tmp_path / "my env" / "python")
    monkeypatch.setattr(sys, "executable", python)
    assert install_command("numpy") == f"'{python}' -m pip install 'pipros[numpy]'"


def test_a_missing_library_is_named_with_the_command_that_installs_it() -> None:
    error = missing("this node needs scipy", "navigation", ModuleNotFoundError("no scipy", name="scipy"))

    assert str(error).startswith("this node needs scipy, which is not installed. Try: ")
    assert "[navigation]" in str(error)
    assert error.name == "scipy"


def test_ctrl_c_during_the_import_of_numpy_stays_ctrl_c(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "last_type", KeyboardInterrupt, raising=False)

    with pytest.raises(KeyboardInterrupt):
        missing("images need numpy", "images", NUMPY)


def test_a_numpy_that_cannot_be_imported_is_not_called_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(sys, "last_type", raising=False)

    said = str(missing("images need numpy", "images", NUMPY))

    assert "images need numpy, which cannot be imported: numpy.core.multiarray failed to import. Try" in said
