"""Who may see the page."""

from __future__ import annotations

import pytest

from pipros.web.access import LOOPBACK_HOSTS, Access, Denied

ACCESS = Access.with_new_token(8000, LOOPBACK_HOSTS, is_secure=False)
OPEN = Access.with_new_token(8000, {*LOOPBACK_HOSTS, "robot"}, is_secure=True, takes_addresses=True)


def test_each_server_has_a_token_of_its_own() -> None:
    assert len(ACCESS.token) >= 32
    assert ACCESS.token != OPEN.token


@pytest.mark.parametrize("host", ["localhost:8000", "127.0.0.1:8000", "[::1]:8000", "LOCALHOST:8000"])
def test_own_names_are_served(host: str) -> None:
    ACCESS.check_host(host)
    ACCESS.check_origin(f"http://{host}")


@pytest.mark.parametrize(
    "host",
    [None, "", "evil.example:8000", "localhost", "localhost:80", "10.0.0.1:8000", "localhost.evil:8000"],
)
def test_other_names_are_refused(host: str | None) -> None:
    with pytest.raises(Denied):
        ACCESS.check_host(host)


@pytest.mark.parametrize("host", ["10.0.0.1:8000", "[fe80::1]:8000", "robot:8000"])
def test_an_open_server_takes_addresses_and_its_name(host: str) -> None:
    OPEN.check_host(host)
    OPEN.check_origin(f"https://{host}")


def test_an_open_server_takes_no_other_name() -> None:
    with pytest.raises(Denied):
        OPEN.check_host("evil.example:8000")


@pytest.mark.parametrize(
    "origin", [None, "null", "https://localhost:8000", "http://evil.example:8000", "http://["]
)
def test_other_origins_are_refused(origin: str | None) -> None:
    with pytest.raises(Denied):
        ACCESS.check_origin(origin)


def test_the_cookie_or_the_address_has_the_token() -> None:
    ACCESS.check_cookie(f"other=1; {ACCESS.cookie_name}={ACCESS.token}")
    assert ACCESS.comes_with_token(f"/?token={ACCESS.token}")
    assert "HttpOnly; SameSite=Strict" in ACCESS.cookie
    assert "Secure" not in ACCESS.cookie
    assert "Secure" in OPEN.cookie


@pytest.mark.parametrize(
    "cookies", [None, "", "pipros_8000=", "pipros_8000=wrong", "pipros_1=x", "=;=", "ä=1"]
)
def test_without_it_nothing_is_served(cookies: str | None) -> None:
    with pytest.raises(Denied, match="token"):
        ACCESS.check_cookie(cookies)
    assert not ACCESS.comes_with_token("/?token=")
    assert not ACCESS.comes_with_token("/?token=%C3%A4")
    assert not ACCESS.comes_with_token("/")


def test_the_address_has_token_and_tab() -> None:
    assert ACCESS.url("localhost", "graph") == f"http://localhost:8000/?token={ACCESS.token}#graph"
