"""Allowed hosts and origins of requests to the page."""

from __future__ import annotations

import pytest

from pipros_server.access import LOOPBACK_HOSTS, Access, is_forwarded_tls
from pipros_server.secret import Denied

ACCESS = Access(8000)
OPEN = Access(8000, {*LOOPBACK_HOSTS, "robot"}, is_secure=True, takes_addresses=True)


@pytest.mark.parametrize("host", ["localhost:8000", "127.0.0.1:8000", "[::1]:8000", "LOCALHOST:8000"])
def test_own_names_are_served(host: str) -> None:
    ACCESS.check_host(host)
    ACCESS.check_origin(f"http://{host}", host)


@pytest.mark.parametrize(
    "host",
    [
        None,
        "",
        "evil.example:8000",
        "evil.example",
        "10.0.0.1:8000",
        "localhost.evil:8000",
        "localhost:9000x",
    ],
)
def test_other_names_are_refused(host: str | None) -> None:
    with pytest.raises(Denied):
        ACCESS.check_host(host)


@pytest.mark.parametrize("host", ["10.0.0.1:8000", "[fe80::1]:8000", "robot:8000"])
def test_an_open_server_takes_addresses_and_its_name(host: str) -> None:
    OPEN.check_host(host)
    OPEN.check_origin(f"https://{host}", host)


def test_an_open_server_takes_no_other_name() -> None:
    with pytest.raises(Denied):
        OPEN.check_host("evil.example:8000")


@pytest.mark.parametrize(
    "origin", [None, "null", "https://localhost:8000", "http://evil.example:8000", "http://["]
)
def test_other_origins_are_refused(origin: str | None) -> None:
    with pytest.raises(Denied):
        ACCESS.check_origin(origin, "localhost:8000")


@pytest.mark.parametrize(
    "origin", ["https://203.0.113.5:8000", "https://10.0.0.11:8000", "https://[::5]:8000"]
)
@pytest.mark.parametrize("host", ["10.0.0.1:8000", "robot:8000", "localhost:8000", None])
def test_a_site_that_is_opened_by_its_address_is_another_origin(origin: str, host: str | None) -> None:
    with pytest.raises(Denied):
        OPEN.check_origin(origin, host)


def test_the_names_of_a_server_may_be_mixed() -> None:
    OPEN.check_origin("https://localhost:8000", "robot:8000")
    OPEN.check_origin("https://robot:8000", "10.0.0.1:8000")


@pytest.mark.parametrize(("port", "is_secure", "scheme"), [(80, False, "http"), (443, True, "https")])
@pytest.mark.parametrize("name", ["localhost", "127.0.0.1", "[::1]", "LocalHost"])
def test_the_default_port_may_be_left_out(port: int, is_secure: bool, scheme: str, name: str) -> None:
    access = Access(port, is_secure=is_secure)
    for host in (name, f"{name}:{port}"):
        access.check_host(host)
        access.check_origin(f"{scheme}://{host}", host)
    for host in (f"{name}:", f"{name}:080x", f"{name}:1:{port}"):
        with pytest.raises(Denied):
            access.check_host(host)


@pytest.mark.parametrize("host", ["localhost:9000", "localhost", "127.0.0.1:1", "[::1]:65535"])
def test_the_outer_port_of_a_tunnel_or_container_may_differ(host: str) -> None:
    ACCESS.check_host(host)
    ACCESS.check_origin(f"http://{host}", host)


@pytest.mark.parametrize("host", ["10.0.0.1:443", "robot", "robot:9000", "[fe80::1]:1"])
def test_the_outer_port_of_an_open_server_may_differ(host: str) -> None:
    OPEN.check_host(host)
    OPEN.check_origin(f"https://{host}", host)


@pytest.mark.parametrize(
    ("origin", "host"),
    [
        ("http://localhost:3000", "localhost:8000"),  # a page of another server on this machine
        ("http://localhost:8000", "localhost:9000"),  # outside, 8000 is the port of another server
        ("http://localhost", "localhost:8000"),
        ("http://127.0.0.1:3000", "127.0.0.1:8000"),
        ("http://evil.example:9000", "localhost:9000"),
        ("https://localhost:9000", "localhost:9000"),
    ],
)
def test_a_page_of_another_port_or_name_is_another_origin(origin: str, host: str) -> None:
    with pytest.raises(Denied):
        ACCESS.check_origin(origin, host)


@pytest.mark.parametrize("host", ["localhost", "localhost:9443", "localhost:443"])
def test_a_proxy_may_add_tls_if_it_says_so(host: str) -> None:
    ACCESS.check_origin(f"https://{host}", host, is_behind_tls=True)
    for origin, wanted in ((f"http://{host}", host), (f"https://{host}", "localhost:1"), ("https://x", host)):
        with pytest.raises(Denied):
            ACCESS.check_origin(origin, wanted, is_behind_tls=True)


def test_the_header_of_a_proxy_says_whether_it_adds_tls() -> None:
    assert all(map(is_forwarded_tls, ("https", "wss", " HTTPS ")))
    assert not any(map(is_forwarded_tls, (None, "", "http", "ws", "https, http", "x")))


def test_the_address_has_the_token_in_its_fragment_and_the_tab() -> None:
    token = ACCESS.secret.token
    assert ACCESS.url("localhost", "graph") == f"http://localhost:8000/#token={token}/graph"
    assert OPEN.url("robot") == f"https://robot:8000/#token={OPEN.secret.token}"


def test_a_one_time_address_has_a_code_instead_of_the_token() -> None:
    url = ACCESS.url_with_code("localhost", ACCESS.secret.new_code(), "plot/%2Fimu")
    code = url.removeprefix("http://localhost:8000/#code=").removesuffix("/plot/%2Fimu")
    assert ACCESS.secret.token not in url
    assert ACCESS.secret.redeem(code)


def test_the_repr_of_a_secret_does_not_contain_the_token() -> None:
    assert ACCESS.secret.token not in repr(ACCESS)
