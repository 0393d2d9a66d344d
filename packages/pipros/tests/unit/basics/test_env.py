"""Addresses of masters and nodes: variables of the environment, ports, URIs."""

import pytest

from pipros.basics.env import Environment, InvalidEnvironment, split_master_uri
from pipros.basics.ports import AdvertisedAddress, PortRange
from pipros.basics.uri import split_uri


@pytest.mark.parametrize(("uri", "place"), [
    ("http://localhost:11311", ("localhost", 11311)), ("http://robot:11311/", ("robot", 11311)),
    ("http://[::1]:5/", ("::1", 5)),
])  # fmt: skip
def test_a_master_uri_has_a_host_and_a_port(uri: str, place: tuple[str, int]) -> None:
    assert split_master_uri(uri) == place


@pytest.mark.parametrize("uri", [
    "", "robot", "robot:11311", "http://robot", "http://:1", "https://r:1", "rosrpc://r:1", "http://r:0",
    "http://r:x",
])  # fmt: skip
def test_an_invalid_master_uri_is_refused_with_an_example(uri: str) -> None:
    with pytest.raises(InvalidEnvironment, match="for example http://localhost:11311"):
        split_master_uri(uri)


def test_blanks_around_addresses_do_not_count() -> None:
    names = ("ROS_MASTER_URI", "ROS_HOSTNAME", "ROS_IP")
    assert Environment.from_os(dict.fromkeys(names, " http://r:1 "))[:3] == ("http://r:1",) * 3
    assert Environment.from_os(dict.fromkeys(names, " "))[:3] == Environment()[:3]


def test_a_namespace_begins_and_ends_with_a_slash() -> None:
    assert Environment.from_os({"ROS_NAMESPACE": "robot/arm/"}).namespace == "/robot/arm/"
    assert Environment.from_os({}).namespace == "/"


def test_a_program_with_the_variables_of_an_environment_reaches_the_same_system() -> None:
    given = Environment(master_uri="http://robot:1", ip="10.0.0.1", advertise="robot:4000")
    others = {
        "ROS_MASTER_URI": "http://127.0.0.1:2", "ROS_HOSTNAME": "other", "ROS_IPV6": "on", "HOME": "/me",
    }  # fmt: skip
    variables = given.applied_to(others)
    found = Environment.from_os(variables)
    assert (found.master_uri, found.hostname, found.ip, found.ipv6, found.advertise) == (
        *("http://robot:1", None, "10.0.0.1", False, "robot:4000"),
    )
    assert variables["HOME"] == "/me"


# Ports


def test_a_range_has_its_first_and_its_last_port() -> None:
    ports = Environment.from_os({"PIPROS_PORTS": "11400-11402"}).port_range
    assert ports is not None
    assert list(ports) == [11400, 11401, 11402]
    assert (len(ports), 11402 in ports, 11403 in ports, str(ports)) == (3, True, False, "11400-11402")
    assert list(PortRange.parse("80")) == [80]
    assert Environment.from_os({"PIPROS_PORTS": ""}).port_range is None


@pytest.mark.parametrize(
    "text", ["-", "x", "1-", "-5", "11420-11400", "0-10", "1-65536", "1-2-3", "1.5", "²", "9" * 100]
)
def test_an_invalid_range_is_refused_with_the_variable(text: str) -> None:
    with pytest.raises(InvalidEnvironment, match=r"PIPROS_PORTS \["):
        PortRange.parse(text)


@pytest.mark.parametrize(("text", "ports", "bound", "outside"), [
    ("robot", None, 5000, ("robot", 5000)), ("robot", "5000-5001", 5000, ("robot", 5000)),
    ("robot:80", "5000", 5000, ("robot", 80)), ("robot:31400-31401", "5000-5001", 5001, ("robot", 31401)),
    ("robot:31400-31401=5000-5001,21311=11311", None, 5001, ("robot", 31401)),
    ("robot:31400-31401=5000-5001,21311=11311", None, 11311, ("robot", 21311)),
    ("robot:31400=5000", "6000-6001", 6000, ("robot", 6000)), ("fd00::5", None, 5000, ("fd00::5", 5000)),
    ("[fd00::5]:80=5000", None, 5000, ("fd00::5", 80)),
])  # fmt: skip
def test_bound_ports_have_addresses_outside(
    text: str, ports: str | None, bound: int, outside: tuple[str, int]
) -> None:
    address = Environment(advertise=text, ports=ports).advertised_address()
    assert address.outside(bound) == outside
    if outside[1] != bound:
        assert address.inside(outside[1]) == bound
    assert address.inside(1) is None


@pytest.mark.parametrize(("text", "problem"), [
    (":80", "must have the form"), ("http://robot:80", "must"), ("ro bot", "must have the form"),
    ("robot:x=5", "must have the form"),
    ("robot:80", r"must map 80 to bound ports: set PIPROS_PORTS, or write robot:80=PORT"),
    ("robot:80-81=5000", "80-81 and 5000 must have the same number of ports"),
    ("robot:81-80=1-2", "with the smaller port first"),
])  # fmt: skip
def test_an_invalid_advertised_address_is_refused_with_the_variable(text: str, problem: str) -> None:
    with pytest.raises(InvalidEnvironment, match=rf"PIPROS_ADVERTISE \[.*{problem}"):
        AdvertisedAddress.parse(text, None)


# Host, port and path of the URIs of nodes, masters and services.


@pytest.mark.parametrize(("text", "parts"), [
    ("http://robot:11311", ("robot", 11311, "/")), ("http://robot:11311/", ("robot", 11311, "/")),
    ("HTTP://robot:1/a/b", ("robot", 1, "/a/b")), ("http://[::1]:5/", ("::1", 5, "/")),
    ("http://röbot.local.:5", ("röbot.local.", 5, "/")),
])  # fmt: skip
def test_uris_are_split(text: str, parts: tuple[str, int, str]) -> None:
    assert split_uri(text) == parts


@pytest.mark.parametrize("text", [
    "", "robot:1", "http://robot", "http://robot:/", "http://:1", "https://r:1", "rosrpc://r:1",
    "http://r:99999", "http://r:1²/", "http://r obot:1/", "http://r:1/ HTTP/1.1\r\nX: y", "http://a..b:1/",
    f"http://{'x' * 64}:1/", f"http://{'ü' * 64}:1/", "http://[::1:1/",
])  # fmt: skip
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
