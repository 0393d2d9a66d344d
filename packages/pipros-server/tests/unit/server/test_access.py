"""Access to a server: hosts and origins, tokens and codes, certificates."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from pipros_server.access import LOOPBACK_HOSTS, Access, is_forwarded_tls
from pipros_server.secret import CODE_S, CODES, Denied, Secret
from pipros_server.tls import ServerFailed, tls_context
from pipros_server.token_file import BadTokenFile, read_tokens
from tests.support.environments import file_of_tests

ACCESS = Access(8000)


OPEN = Access(8000, {*LOOPBACK_HOSTS, "robot"}, is_secure=True, takes_addresses=True)


OUTER_PORTS = ["localhost:9000", "localhost", "127.0.0.1:1", "[::1]:65535"]  # of a tunnel or container


@pytest.mark.parametrize(
    "host", ["localhost:8000", "127.0.0.1:8000", "[::1]:8000", "LOCALHOST:8000", *OUTER_PORTS]
)
def test_own_names_are_served_whatever_the_outer_port(host: str) -> None:
    ACCESS.check_host(host)
    ACCESS.check_origin(f"http://{host}", host)


@pytest.mark.parametrize("host", [
    None, "", "evil.example:8000", "evil.example", "10.0.0.1:8000", "localhost.evil:8000", "localhost:9000x",
])  # fmt: skip
def test_other_names_are_refused(host: str | None) -> None:
    with pytest.raises(Denied):
        ACCESS.check_host(host)


@pytest.mark.parametrize(
    "host",
    ["10.0.0.1:8000", "[fe80::1]:8000", "robot:8000", "10.0.0.1:443", "robot", "robot:9000", "[fe80::1]:1"],
)
def test_an_open_server_takes_addresses_and_its_name_but_no_other(host: str) -> None:
    OPEN.check_host(host)
    OPEN.check_origin(f"https://{host}", host)
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


# The secret of a server, and the one-time codes that replace it.


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


@pytest.mark.parametrize("message", [
    "", "{", "[]", "null", '"token"', "{}", '{"token": null}', '{"token": ""}', '{"token": "wrong"}',
    '{"token": ["wrong"]}', '{"token": "\\ud800"}', '{"token": "ä"}', '{"code": ""}', '{"code": {}}',
    "[" * 100_000, b"\xff\xfe", b"",
])  # fmt: skip
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


# Files of tokens.


def written(folder: Path, text: str, mode: int = 0o600) -> str:
    file = folder / "tokens"
    file.write_text(text)
    file.chmod(mode)
    return str(file)


def test_each_line_has_a_token(tmp_path: Path) -> None:
    path = written(tmp_path, "# mine\nabcdefghijklmnop # phone\n\n0123456789-._~ABC\n")
    assert read_tokens(path) == ["abcdefghijklmnop", "0123456789-._~ABC"]


@pytest.mark.parametrize(("text", "reason"), [
    ("", "contains no token"), ("# abcdefghijklmnop", "contains no token"),
    ("short", "at least 16 characters"), ("abcdefghijklmnop/", "letters, digits"),
    ("abcdefghijk lmnop", "letters, digits"),
])  # fmt: skip
def test_weak_tokens_are_refused(text: str, reason: str, tmp_path: Path) -> None:
    with pytest.raises(BadTokenFile, match=reason):
        read_tokens(written(tmp_path, text))


@pytest.mark.needs("file owners")
@pytest.mark.parametrize("mode", [0o640, 0o604, 0o620])
def test_files_that_others_can_use_are_refused(mode: int, tmp_path: Path) -> None:
    with pytest.raises(BadTokenFile, match="chmod 600"):
        read_tokens(written(tmp_path, "abcdefghijklmnop", mode))


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(BadTokenFile, match=r"cannot read .*none: No such file"):
        read_tokens(str(tmp_path / "none"))


# Certificates and keys that a server cannot use.


CERTIFICATES = file_of_tests("support/certificates")


CERTIFICATE, KEY = str(CERTIFICATES / "cert.pem"), str(CERTIFICATES / "key.pem")


def complaint(certificate: str | None, key: str | None) -> str:
    with pytest.raises(ServerFailed) as caught:
        tls_context(certificate, key)
    return str(caught.value)


def test_a_key_without_a_certificate_does_not_disable_tls_in_silence() -> None:
    assert complaint(None, KEY) == f"the key {KEY} needs its certificate; give it with --cert"
    assert tls_context(None, None) is None
    assert tls_context(CERTIFICATE, KEY) is not None


def test_the_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    missing = str(tmp_path / "missing.pem")
    assert complaint(CERTIFICATE, missing) == f"cannot use the key {missing}: No such file or directory"
    assert complaint(missing, KEY) == f"cannot use the certificate {missing}: No such file or directory"
    needed = "a certificate and its private key, both in PEM format, are needed"
    assert complaint(CERTIFICATE, None) == f"cannot use the certificate {CERTIFICATE}: {needed}"


@pytest.mark.skipif(not shutil.which("openssl"), reason="needs openssl")
def test_a_key_with_a_passphrase_is_refused_instead_of_asking(tmp_path: Path) -> None:
    locked, other = str(tmp_path / "locked.pem"), str(tmp_path / "other.pem")
    convert = ["openssl", "pkey", "-in", KEY, "-aes256", "-passout", "pass:secret", "-out", locked]
    subprocess.run(convert, check=True)
    subprocess.run(["openssl", "genpkey", "-algorithm", "RSA", "-out", other], check=True, stderr=-3)

    assert f"cannot use the key {locked}: it has a passphrase. Try: " in complaint(CERTIFICATE, locked)
    what = f"cannot use the certificate {CERTIFICATE} with the key {other}"
    assert complaint(CERTIFICATE, other) == f"{what}: the key belongs to another certificate"
