from __future__ import annotations

import pytest

from pipros.basics.env import Environment, InvalidEnvironment, split_master_uri


@pytest.mark.parametrize(
    ("uri", "place"),
    [
        ("http://localhost:11311", ("localhost", 11311)),
        ("http://robot:11311/", ("robot", 11311)),
        ("http://[::1]:5/", ("::1", 5)),
    ],
)
def test_a_master_uri_has_a_host_and_a_port(uri: str, place: tuple[str, int]) -> None:
    assert split_master_uri(uri) == place


@pytest.mark.parametrize(
    "uri",
    [
        "",
        "robot",
        "robot:11311",
        "http://robot",
        "http://:1",
        "https://r:1",
        "rosrpc://r:1",
        "http://r:0",
        "http://r:x",
    ],
)
def test_an_invalid_master_uri_is_refused_with_an_example(uri: str) -> None:
    with pytest.raises(InvalidEnvironment, match="for example http://localhost:11311"):
        split_master_uri(uri)


def test_a_namespace_begins_and_ends_with_a_slash() -> None:
    assert Environment.from_os({"ROS_NAMESPACE": "robot/arm/"}).namespace == "/robot/arm/"
    assert Environment.from_os({}).namespace == "/"


def test_a_program_with_the_variables_of_an_environment_reaches_the_same_system() -> None:
    given = Environment(master_uri="http://robot:1", ip="10.0.0.1", advertise="robot:4000")
    others = {
        "ROS_MASTER_URI": "http://127.0.0.1:2",
        "ROS_HOSTNAME": "other",
        "ROS_IPV6": "on",
        "HOME": "/me",
    }
    variables = given.applied_to(others)
    found = Environment.from_os(variables)
    assert (found.master_uri, found.hostname, found.ip, found.ipv6, found.advertise) == (
        *("http://robot:1", None, "10.0.0.1", False, "robot:4000"),
    )
    assert variables["HOME"] == "/me"
