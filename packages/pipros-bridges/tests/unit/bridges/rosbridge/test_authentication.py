"""The operation `auth`: which claims are accepted."""

import hashlib
from typing import Any

import pytest

from pipros_bridges.rosbridge.authentication import Authenticator

SECRET = "0123456789abcdef"  # noqa: S105 # of these tests
NOW = 1000


def claims(**changed: Any) -> dict[str, Any]:
    """Return valid claims for the present time; changes are made before they are signed."""
    values: dict[str, Any] = {
        "client": "127.0.0.1", "dest": "here", "rand": "r", "t": NOW, "level": "user", "end": NOW + 100,
        **changed
    }  # fmt: skip
    text = "".join(str(values[name]) for name in ("client", "dest", "rand", "t", "level", "end"))
    return {**values, "mac": hashlib.sha512((SECRET + text).encode()).hexdigest()}


@pytest.fixture
def authenticator() -> Authenticator:
    return Authenticator(SECRET, lambda: float(NOW))


def test_authentic_claims_are_accepted_once(authenticator: Authenticator) -> None:
    assert authenticator.accepts(claims())
    assert not authenticator.accepts(claims())
    assert authenticator.accepts(claims(rand="other"))


@pytest.mark.parametrize("moved", [
    {"dest": "herer", "rand": "and"}, {"client": "127.0.0.", "dest": "1here"},
    {"client": "", "dest": "127.0.0.1here"}, {"level": "", "end": None},
])  # fmt: skip
def test_characters_moved_between_claims_do_not_make_a_proof_new(
    authenticator: Authenticator, moved: dict[str, Any]
) -> None:
    proof = claims(rand="rand", level="7")
    assert authenticator.accepts(proof)
    if "end" in moved:
        moved = {**moved, "end": int(f"7{proof['end']}")}
    assert not authenticator.accepts({**proof, **moved})


@pytest.mark.parametrize("changed", [
    {"t": NOW - 5}, {"t": NOW + 5}, {"end": NOW}, {"t": float(NOW)}, {"t": str(NOW)}, {"end": None},
    {"rand": 5}, {"client": None}, {"level": ["user"]},
])  # fmt: skip
def test_old_expired_and_malformed_claims_are_refused(
    authenticator: Authenticator, changed: dict[str, Any]
) -> None:
    assert not authenticator.accepts(claims(**changed))


@pytest.mark.parametrize("mac", ["", "0" * 128, "\N{SNOWMAN}", None])
def test_claims_without_the_right_proof_are_refused(authenticator: Authenticator, mac: Any) -> None:
    assert not authenticator.accepts({**claims(), "mac": mac})


def test_a_secret_of_another_length_is_refused() -> None:
    with pytest.raises(ValueError, match="the secret must have 16 characters, got 3"):
        Authenticator("abc", lambda: 0.0)
