"""Host, port and path of the URIs of nodes, masters and services."""

from __future__ import annotations

import pytest

from pipros.basics.uri import split_uri


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("http://robot:11311", ("robot", 11311, "/")),
        ("http://robot:11311/", ("robot", 11311, "/")),
        ("HTTP://robot:1/a/b", ("robot", 1, "/a/b")),
        ("http://[::1]:5/", ("::1", 5, "/")),
        ("http://röbot.local.:5", ("röbot.local.", 5, "/")),
    ],
)
def test_uris_are_split(text: str, parts: tuple[str, int, str]) -> None:
    assert split_uri(text) == parts


@pytest.mark.parametrize(
    "text",
    [
        "",
        "robot:1",
        "http://robot",
        "http://robot:/",
        "http://:1",
        "https://r:1",
        "rosrpc://r:1",
        "http://r:99999",
        "http://r:1²/",
        "http://r obot:1/",
        "http://r:1/ HTTP/1.1\r\nX: y",
        "http://a..b:1/",
        f"http://{'x' * 64}:1/",
        f"http://{'ü' * 64}:1/",
        "http://[::1:1/",
    ],
)
def test_anything_else_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="must have the form http://HOST:PORT/, got"):
        split_uri(text)


def test_other_schemes_are_accepted_on_request() -> None:
    assert split_uri("rosrpc://robot:5", ["rosrpc"]) == ("robot", 5, "/")
    assert split_uri("ROSRPC://[::1]:5", ["http", "rosrpc"]) == ("::1", 5, "/")
    with pytest.raises(ValueError, match="must have the form http://HOST:PORT/ or rosrpc://HOST:PORT/, got"):
        split_uri("ftp://robot:5", ["http", "rosrpc"])


def test_a_refusal_shows_a_peers_text_without_control_characters() -> None:
    with pytest.raises(ValueError, match=r"got \[http://\\x1b\[31mr:1\]"):
        split_uri("http://\x1b[31mr:1")
