"""Who may connect to a bridge: origins and tokens."""

import pytest

from pipros_bridges import serve
from pipros_bridges.admission import Admission
from pipros_bridges.serve import BridgeOptions
from pipros_server.secret import Denied, Secret

TOKEN = "-".join(["a", "token", "of", "16", "characters"])


@pytest.mark.parametrize("origin", [
    None, "http://localhost:3000", "https://127.0.0.1", "http://[::1]:8080", "http://app.localhost"
])  # fmt: skip
def test_programs_and_pages_of_this_machine_may_connect(origin: str | None) -> None:
    Admission().check_origin(origin)


@pytest.mark.parametrize("origin", [
    "https://evil.example", "http://localhost.evil.example", "http://127.0.0.1.evil.example",
    "http://evil.example:80@localhost", "http://localhost@evil.example",
    "http://127.0.0.1:80, http://evil.example", "http://[::1", "file://localhost", "null", "",
])  # fmt: skip
def test_pages_of_others_may_not(origin: str) -> None:
    with pytest.raises(Denied):
        Admission().check_origin(origin)


def test_options_allow_further_origins() -> None:
    Admission(origins=["https://app.example"]).check_origin("https://app.example")
    with pytest.raises(Denied, match="--origin"):
        Admission(origins=["https://app.example"]).check_origin("https://app.example.evil")
    Admission(origins=["*"]).check_origin("https://evil.example")
    Admission(allows_null_origin=True).check_origin("null")


def test_the_refusal_of_a_file_says_how_to_open_it() -> None:
    with pytest.raises(Denied, match=r"python -m http\.server.*websocket_null_origin:=true"):
        Admission(null_origin_option="websocket_null_origin:=true").check_origin("null")
    with pytest.raises(Denied, match="--origin null"):
        Admission().check_origin("null")


@pytest.mark.parametrize(("path", "authorization"), [
    (f"/{TOKEN}", None), (f"/robot/{TOKEN}?x=1", None), (f"/?token={TOKEN}", None), ("/", f"Bearer {TOKEN}"),
])  # fmt: skip
def test_the_token_is_in_the_url_or_the_header(path: str, authorization: str | None) -> None:
    assert Admission(Secret(tokens=["another-token-of-mine", TOKEN])).has_token(path, authorization)


@pytest.mark.parametrize(("path", "authorization"), [
    ("/", None), ("", None), (f"/{TOKEN}/", None), (f"/{TOKEN}x", None),
    (f"/?token=x&token={TOKEN}", None), ("/", f"Basic {TOKEN}"),
    ("/\N{LATIN SMALL LETTER E WITH ACUTE}", "Bearer"),
])  # fmt: skip
def test_other_requests_have_no_token(path: str, authorization: str | None) -> None:
    assert not Admission(Secret(tokens=[TOKEN])).has_token(path, authorization)


def test_without_a_secret_no_token_is_needed() -> None:
    assert Admission().has_token("/", None)


# Options of the programs that serve bridge clients.


@pytest.mark.parametrize(("host", "shown"), [
    ("127.0.0.1", "localhost"), ("[::1]", "localhost"), ("127.0.0.2", "127.0.0.2"),
    ("robot.example", "robot.example"), ("fe80::1", "[fe80::1]"),
])  # fmt: skip
def test_a_printed_address_is_one_that_the_server_listens_at(host: str, shown: str) -> None:
    assert BridgeOptions("bridge", 0, host=host).shown_host == shown


@pytest.mark.parametrize(
    ("tool", "how"), [("pipros foxglove", "--token-file"), ("foxglove_bridge", "~token_file")]
)
def test_an_open_server_names_the_setting_that_limits_access(
    tool: str, how: str, capsys: pytest.CaptureFixture[str]
) -> None:
    serve._announce(BridgeOptions(tool, 8765, host="192.0.2.1"), 8765, None, None)
    assert f"Everyone on this network can see the system; {how} limits access." in capsys.readouterr().err
