from __future__ import annotations

import os
import subprocess
import sys
from typing import NamedTuple

import pytest

from pipros.basics.limits import InvalidLimits, Limits
from pipros.basics.plugins import Plugin


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


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("frames=1", "unknown limit [frames]; the limits are frame_bytes, body_bytes"),
        ("goals", "goals must be a whole number greater than zero, got []"),
        ("goals=x", "goals must be a whole number greater than zero, got [x]"),
        ("goals=1.5", "goals must be a whole number greater than zero, got [1.5]"),
        ("goals=0", "goals must be a whole number greater than zero, got [0]"),
        ("stall_s=-1", "stall_s must be a number greater than zero, got [-1]"),
        ("stall_s=nan", "stall_s must be a number greater than zero, got [nan]"),
    ],
)
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


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("baths=x", "baths must be a whole number greater than zero, got [x]"),
        ("doors=1", "unknown limit [doors]; the limits are frame_bytes, body_bytes"),
    ],
)
def test_a_wrong_limit_of_a_room_is_explained(
    text: str, complaint: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pipros.basics.plugins.plugins", lambda: iter([PLUGIN]))

    with pytest.raises(InvalidLimits, match=r"^PIPROS_LIMITS: ") as raised:
        Limits.parse(text)

    assert complaint in str(raised.value)
    assert ("bag_cache_bytes, baths, beds_bytes" in str(raised.value)) is text.startswith("doors")
