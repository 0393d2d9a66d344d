from __future__ import annotations

import pytest

from pipros.basics.env import Environment, InvalidEnvironment
from pipros.basics.ports import AdvertisedAddress, PortRange


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


@pytest.mark.parametrize(
    ("text", "ports", "bound", "outside"),
    [
        ("robot", None, 5000, ("robot", 5000)),
        ("robot", "5000-5001", 5000, ("robot", 5000)),
        ("robot:80", "5000", 5000, ("robot", 80)),
        ("robot:31400-31401", "5000-5001", 5001, ("robot", 31401)),
        ("robot:31400-31401=5000-5001,21311=11311", None, 5001, ("robot", 31401)),
        ("robot:31400-31401=5000-5001,21311=11311", None, 11311, ("robot", 21311)),
        ("robot:31400=5000", "6000-6001", 6000, ("robot", 6000)),
        ("fd00::5", None, 5000, ("fd00::5", 5000)),
        ("[fd00::5]:80=5000", None, 5000, ("fd00::5", 80)),
    ],
)
def test_bound_ports_have_addresses_outside(
    text: str, ports: str | None, bound: int, outside: tuple[str, int]
) -> None:
    address = Environment(advertise=text, ports=ports).advertised_address()
    assert address is not None
    assert address.outside(bound) == outside
    if outside[1] != bound:
        assert address.inside(outside[1]) == bound
    assert address.inside(1) is None


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (":80", "must have the form"),
        ("http://robot:80", "must"),
        ("ro bot", "must have the form"),
        ("robot:x=5", "must have the form"),
        ("robot:80", r"must map 80 to bound ports: set PIPROS_PORTS, or write robot:80=PORT"),
        ("robot:80-81=5000", "80-81 and 5000 must have the same number of ports"),
        ("robot:81-80=1-2", "with the smaller port first"),
    ],
)
def test_an_invalid_advertised_address_is_refused_with_the_variable(text: str, problem: str) -> None:
    with pytest.raises(InvalidEnvironment, match=rf"PIPROS_ADVERTISE \[.*{problem}"):
        AdvertisedAddress.parse(text, None)
