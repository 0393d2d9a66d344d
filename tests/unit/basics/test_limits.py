from __future__ import annotations

import os
import subprocess
import sys

import pytest

from pipros.basics.limits import InvalidLimits, Limits
from tests.support.environments import REPOSITORY


def test_unnamed_limits_keep_their_defaults() -> None:
    assert Limits.parse("") == Limits()
    assert Limits.parse("handshakes=8") == Limits(handshakes=8)


def test_blanks_and_empty_pairs_are_ignored() -> None:
    assert Limits.parse(" handshakes = 8 ,, stall_s=0.5,") == Limits(handshakes=8, stall_s=0.5)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("frames=1", "unknown limit [frames]; the limits are header_bytes, frame_bytes"),
        ("handshakes", "handshakes must be a whole number greater than zero, got []"),
        ("handshakes=x", "handshakes must be a whole number greater than zero, got [x]"),
        ("handshakes=1.5", "handshakes must be a whole number greater than zero, got [1.5]"),
        ("handshakes=0", "handshakes must be a whole number greater than zero, got [0]"),
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


def test_the_process_reads_its_limits_from_the_environment() -> None:
    script = "from pipros.basics.limits import process_limits; print(process_limits().frame_bytes)"
    environment = {**os.environ, "PIPROS_LIMITS": "frame_bytes=1000"}

    done = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True)

    assert (done.stdout, done.stderr) == ("1000\n", "")


def test_the_table_in_the_documents_has_every_limit() -> None:
    rows = {
        cells[1].strip("` "): cells[2].strip()
        for line in (REPOSITORY / "docs" / "reliability.md").read_text().splitlines()
        if len(cells := line.split("|")) == 5 and cells[1].strip().startswith("`")
    }

    assert rows == {name: _as_written(name, value) for name, value in Limits._field_defaults.items()}


def _as_written(name: str, value: float) -> str:
    """Format a default like the table: `1 MiB`, `10 s`, `20,000`."""
    if name.endswith("_bytes"):
        unit, size = ("MiB", 1 << 20) if value >= 1 << 20 else ("KiB", 1 << 10)
        return f"{value / size:,g} {unit}"
    return f"{value:g} s" if name.endswith("_s") else f"{value:,}"
