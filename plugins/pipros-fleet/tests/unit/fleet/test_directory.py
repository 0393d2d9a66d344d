"""Directory documents of members, including hostile ones."""

from __future__ import annotations

import json

import pytest

from pipros.basics.errors import LimitExceeded, ProtocolError
from pipros_fleet.directory import (
    Directory,
    DirectoryEntry,
    TopicRequests,
    from_json,
    requests_from_json,
    requests_to_json,
    to_json,
)

MD5 = "992ce8a1687cec8c8bd883ec73ca41d1"


def test_a_directory_survives_its_encoding() -> None:
    directory = Directory(
        "r1",
        "0" * 16,
        7,
        (DirectoryEntry("/chatter", "std_msgs/String", MD5), DirectoryEntry("/x", "a/B", MD5)),
        (DirectoryEntry("/cmd", "std_msgs/String", MD5),),
        (DirectoryEntry("/reset", "std_srvs/Empty", MD5, 2.5),),
        has_parameters=True,
    )
    assert from_json(to_json(directory), "r1") == directory


@pytest.mark.parametrize(
    "content", [b"", b"\xff", b"[]", b"{}", b'{"member": "r1"}', b"[" * 100_000, b'{"member": 1}']
)
def test_malformed_directories_raise(content: bytes) -> None:
    with pytest.raises(ProtocolError, match="malformed"):
        from_json(content, "r1")


def test_a_directory_of_another_member_raises() -> None:
    with pytest.raises(ProtocolError, match=r"\[r1\] claims to be that of \[r2\]"):
        from_json(to_json(Directory("r2", "0" * 16)), "r1")


def test_a_directory_that_is_too_large_raises() -> None:
    with pytest.raises(LimitExceeded, match="the limit is 10 bytes"):
        from_json(to_json(Directory("r1", "0" * 16)), "r1", limit_bytes=10)


def test_invalid_entries_are_omitted() -> None:
    good = {"name": "/ok", "type": "a/B", "md5sum": MD5}
    wrong = [
        1, {}, {**good, "name": "relative"}, {**good, "name": "/a//b"}, {**good, "name": "/a/"},
        {**good, "name": "/a\nb"}, {**good, "name": "/~a"}, {**good, "type": "nothing"},
        {**good, "type": "*"}, {**good, "md5sum": "*"}, {**good, "md5sum": 5},
    ]  # fmt: skip
    document = {"member": "r1", "instance": "i", "revision": 1, "shared": [*wrong, good], "services": 4}
    document["accepted"] = [
        {**good, "timeout_s": value} for value in (-1, 1e9, "1", None, float("nan"), True)
    ]
    found = from_json(json.dumps(document).encode(), "r1")
    assert found.shared == (DirectoryEntry("/ok", "a/B", MD5),)
    assert found.services == ()
    assert found.accepted == (DirectoryEntry("/ok", "a/B", MD5),)


def test_requests_survive_their_encoding() -> None:
    requests = TopicRequests("0" * 16, 4, frozenset({"/b", "/a"}))
    assert requests_from_json(requests_to_json(requests)) == requests
    assert requests_from_json(requests_to_json(requests), limit_bytes=2) is None
    for content in (b"", b"{}", b"\xff", b"[]"):
        assert requests_from_json(content) is None
