"""Plugins of other distributions: one that is broken does not end the others, or any command."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib.metadata import EntryPoint
from types import ModuleType

import pytest

from pipros.basics import plugins
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
