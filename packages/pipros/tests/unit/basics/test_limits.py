import json
import os
import subprocess
import sys
from collections.abc import Iterator
from importlib.metadata import EntryPoint
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, NamedTuple
from unittest.mock import Mock

import pytest

from pipros.basics import plugins
from pipros.basics.extras import install_command, missing, optional
from pipros.basics.limits import InvalidLimits, Limits
from pipros.basics.plugins import ENTRY_POINTS, Plugin, all_loaded, all_offered


class BathLimits(NamedTuple):
    """Limits of a room that exists only here."""

    baths: int = 2
    beds_bytes: int = 4096


PLUGIN = Plugin("bath", "for tests", limits=f"{__name__}:BathLimits")


def test_unnamed_limits_keep_their_defaults() -> None:
    assert Limits.parse("") == Limits()
    assert Limits.parse("goals=8") == Limits(goals=8)


def test_blanks_and_empty_pairs_are_ignored() -> None:
    assert Limits.parse(" goals = 8 ,, stall_s=0.5,") == Limits(goals=8, stall_s=0.5)


@pytest.mark.parametrize(("text", "complaint"), [
    ("frames=1", "unknown limit [frames]; the limits are frame_bytes, body_bytes"),
    ("goals", "goals must be a whole number greater than zero, got []"),
    ("goals=x", "goals must be a whole number greater than zero, got [x]"),
    ("goals=1.5", "goals must be a whole number greater than zero, got [1.5]"),
    ("goals=0", "goals must be a whole number greater than zero, got [0]"),
    ("stall_s=-1", "stall_s must be a number greater than zero, got [-1]"),
    ("stall_s=nan", "stall_s must be a number greater than zero, got [nan]"),
])  # fmt: skip
def test_a_wrong_limit_is_explained(text: str, complaint: str) -> None:
    with pytest.raises(InvalidLimits, match=r"^PIPROS_LIMITS: ") as raised:
        Limits.parse(text)
    assert complaint in str(raised.value)


def test_zero_is_allowed_if_it_means_the_default() -> None:
    assert Limits.parse("rpc_connections=0") == Limits()


@pytest.mark.parametrize(("text", "frame_bytes"), [("", Limits().frame_bytes), ("frame_bytes=1000", 1000)])
def test_the_process_reads_its_limits_from_the_environment_without_plugins(
    text: str, frame_bytes: int
) -> None:
    script = (
        "import sys; from pipros.basics.limits import process_limits; "
        "print(process_limits().frame_bytes, 'pipros.basics.plugins' in sys.modules)"
    )
    environment = {**os.environ, "PIPROS_LIMITS": text}
    done = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True)
    assert (done.stdout, done.stderr) == (f"{frame_bytes} False\n", "")


def test_limits_of_plugins_are_read_and_carried(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipros.basics.plugins.plugins", lambda: iter([PLUGIN]))

    limits = Limits.parse("baths=7, goals=8, beds_bytes=9")

    assert limits == Limits(goals=8, tables=(BathLimits(baths=7, beds_bytes=9),))
    assert limits.of(BathLimits) == (7, 9)
    assert limits.with_table(BathLimits(baths=3)).of(BathLimits) == (3, 4096)
    assert Limits().of(BathLimits) == (2, 4096)


@pytest.mark.parametrize(("text", "complaint"), [
    ("baths=x", "baths must be a whole number greater than zero, got [x]"),
    ("doors=1", "unknown limit [doors]; the limits are frame_bytes, body_bytes"),
])  # fmt: skip
def test_a_wrong_limit_of_a_room_is_explained(text: str, complaint: str, monkeypatch) -> None:
    monkeypatch.setattr("pipros.basics.plugins.plugins", lambda: iter([PLUGIN]))

    with pytest.raises(InvalidLimits, match=r"^PIPROS_LIMITS: ") as raised:
        Limits.parse(text)

    assert complaint in str(raised.value)
    assert ("bag_cache_bytes, baths, beds_bytes" in str(raised.value)) is text.startswith("doors")


# Plugins of other distributions: one that is broken does not end the others, or any command.


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
def test_an_offer_that_cannot_be_loaded_is_left_out_by_name(place: int, monkeypatch, caplog) -> None:
    targets = [f"broken_plugin:{name}" for name in GOOD]
    targets.insert(place, "broken_plugin:offering")
    install(monkeypatch, targets)
    assert all_offered("test") == ["a check"] * len(GOOD)
    assert "broken_plugin:missing of the plugin offering is left out: AttributeError" in caplog.text
    assert all_loaded(lambda each: each.check).count("a check") == len(GOOD)


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


def test_pip_of_another_environment_is_not_used(come_from: Any, monkeypatch, tmp_path: Path) -> None:
    come_from(None)
    monkeypatch.setattr("shutil.which", lambda _: "/usr/bin/pip")
    python = str(tmp_path / "my env" / "python")
    monkeypatch.setattr(sys, "executable", python)
    assert install_command("numpy") == f"'{python}' -m pip install 'pipros[numpy]'"


def test_a_missing_library_is_named_with_the_command_that_installs_it() -> None:
    # needs no library
    error = missing("this node needs scipy", "navigation", ModuleNotFoundError("no scipy", name="scipy"))

    assert str(error).startswith("this node needs scipy, which is not installed. Try: ")
    assert "[navigation]" in str(error)
    assert error.name == "scipy"


def test_ctrl_c_during_the_import_of_numpy_stays_ctrl_c(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "last_type", KeyboardInterrupt, raising=False)

    monkeypatch.setattr("importlib.import_module", Mock(side_effect=NUMPY))
    for interrupted in (lambda: missing("images need numpy", "images", NUMPY), lambda: optional("numpy")):
        with pytest.raises(KeyboardInterrupt):
            interrupted()


def test_a_numpy_that_cannot_be_imported_is_not_called_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(sys, "last_type", raising=False)

    said = str(missing("images need numpy", "images", NUMPY))

    assert "images need numpy, which cannot be imported: numpy.core.multiarray failed to import. Try" in said
