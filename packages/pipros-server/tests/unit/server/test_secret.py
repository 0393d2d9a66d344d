"""The secret of a server, and the one-time codes that replace it."""

from __future__ import annotations

import json

import pytest

from pipros_server.secret import CODE_S, CODES, Denied, Secret


class Clock:
    """A clock that only changes when it is set."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


def test_each_server_has_its_own_token() -> None:
    assert len(Secret().token) >= 32
    assert Secret().token != Secret().token


def test_the_first_message_has_the_token_or_a_code() -> None:
    secret = Secret()
    secret.check_first_message(json.dumps({"token": secret.token}))
    secret.check_first_message(json.dumps({"token": secret.token}).encode())
    secret.check_first_message(json.dumps({"code": secret.new_code()}))


@pytest.mark.parametrize(
    "message",
    [
        "",
        "{",
        "[]",
        "null",
        '"token"',
        "{}",
        '{"token": null}',
        '{"token": ""}',
        '{"token": "wrong"}',
        '{"token": ["wrong"]}',
        '{"token": "\\ud800"}',
        '{"token": "ä"}',
        '{"code": ""}',
        '{"code": {}}',
        "[" * 100_000,
        b"\xff\xfe",
        b"",
    ],
)
def test_other_first_messages_are_refused(message: str | bytes) -> None:
    with pytest.raises(Denied, match="The token is missing or wrong"):
        Secret().check_first_message(message)


def test_tokens_and_codes_are_not_interchangeable() -> None:
    secret = Secret()
    for values in ({"code": secret.token}, {"token": secret.new_code()}):
        with pytest.raises(Denied):
            secret.check_first_message(json.dumps(values))


def test_a_request_has_the_token_in_its_header() -> None:
    secret = Secret()
    for header in (f"Bearer {secret.token}", f"bearer  {secret.token} "):
        secret.check_authorization(header)
    for wrong in (None, "", secret.token, "Bearer", "Bearer wrong", f"Basic {secret.token}", "Bearer ä"):
        with pytest.raises(Denied, match="Authorization: Bearer"):
            secret.check_authorization(wrong)


def test_a_code_works_once() -> None:
    secret = Secret()
    code = secret.new_code()
    assert secret.redeem(code)
    assert not secret.redeem(code)


def test_a_code_expires() -> None:
    clock = Clock()
    secret = Secret(clock)
    in_time, late = secret.new_code(), secret.new_code()
    clock.now = CODE_S - 0.1
    assert secret.redeem(in_time)
    clock.now = CODE_S
    assert not secret.redeem(late)


def test_unredeemed_codes_make_room_for_new_ones() -> None:
    secret = Secret()
    codes = [secret.new_code() for _ in range(CODES + 1)]
    assert not secret.redeem(codes[0])
    assert all(secret.redeem(code) for code in codes[1:])
