"""Rooms of other distributions: one that is broken does not end the others, or any command."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib.metadata import EntryPoint
from types import ModuleType

import pytest

from pipros.basics import rooms
from pipros.basics.rooms import ENTRY_POINTS, Room, all_loaded, all_offered

GOOD = ["good_one", "good_two"]
BROKEN = {
    "broken_room:missing": "AttributeError",
    "broken_room:TEXT": "it must name a Room, got str",
    "no_such_module:ROOM": "ModuleNotFoundError: No module named 'no_such_module'",
}


def room(name: str, offer: str = "") -> Room:
    return Room(name, "test", offers={"test": offer} if offer else {}, check=offer)


@pytest.fixture(autouse=True)
def fresh_rooms(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    module = ModuleType("broken_room")
    module.TEXT, module.CHECK = "a text", "a check"  # type: ignore[attr-defined]
    for name in GOOD:
        setattr(module, name, room(name, "broken_room:CHECK"))
    module.offering = room("offering", "broken_room:missing")  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "broken_room", module)
    rooms._rooms_of_others.cache_clear()
    yield
    rooms._rooms_of_others.cache_clear()


def install(monkeypatch: pytest.MonkeyPatch, targets: list[str]) -> None:
    points = [EntryPoint(f"point_{number}", each, ENTRY_POINTS) for number, each in enumerate(targets)]
    monkeypatch.setattr("importlib.metadata.entry_points", lambda **_: points)


@pytest.mark.parametrize("place", range(len(GOOD) + 1))
@pytest.mark.parametrize("broken", BROKEN)
def test_a_room_that_cannot_be_loaded_is_left_out_by_name(
    broken: str, place: int, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    targets = [f"broken_room:{name}" for name in GOOD]
    targets.insert(place, broken)
    install(monkeypatch, targets)
    assert [each.name for each in rooms.rooms() if each not in rooms.own_rooms()] == GOOD
    (text,) = caplog.messages
    assert text.startswith(
        f"the entry point point_{place} = {broken} in the group {ENTRY_POINTS} is left out: "
    )
    assert BROKEN[broken] in text


@pytest.mark.parametrize("place", range(len(GOOD) + 1))
def test_an_offer_that_cannot_be_loaded_is_left_out_by_name(
    place: int, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    targets = [f"broken_room:{name}" for name in GOOD]
    targets.insert(place, "broken_room:offering")
    install(monkeypatch, targets)
    assert all_offered("test") == ["a check"] * len(GOOD)
    assert "broken_room:missing of the room offering is left out: AttributeError" in caplog.text
    assert all_loaded(lambda each: each.check).count("a check") == len(GOOD)
