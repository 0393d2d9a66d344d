"""Replies of SCIP 2, decoded by the driver and by hokuyolx."""

import random

import pytest
from hokuyolx.hokuyo import HokuyoLX

from pipros_robot.perception.drivers.urg import scip
from pipros_robot.perception.drivers.urg.clock import USED_AFTER, DeviceClock
from tests.support import simulated_urg as device


def replies(data: bytes, sizes: list[int] | None = None) -> tuple[list[scip.ScipReply], int]:
    """Return the replies in data that arrives in pieces, and the number of errors."""
    splitter, found, at = scip.Replies(), [], 0
    for number, size in enumerate([*(sizes or []), len(data)]):
        found += splitter.feed(data[at : at + size], number)
        at += size
    return found, splitter.errors


@pytest.mark.parametrize("is_intense", [False, True])
def test_scans_are_those_of_hokuyolx(is_intense: bool) -> None:
    rng = random.Random(is_intense)  # noqa: S311
    steps = [[(rng.choice([0, 1, rng.randrange(1 << 18)]), rng.randrange(1 << 18))] for _ in range(1081)]
    raw = device.scan_block("ME0000108001000", "99", 123456, steps, is_intense=is_intense)
    [reply], errors = replies(raw, [rng.randrange(500) for _ in range(10)])
    assert (errors, reply.status, reply.echo) == (0, "99", "ME0000108001000")
    _, _, clock, *lines = raw.decode().split("\n")
    assert scip.clock_ms(reply.lines[0]) == HokuyoLX._convert2int(clock[:4]) == 123456

    theirs = HokuyoLX._process_scan_data(object.__new__(HokuyoLX), lines[:-2], is_intense)
    distances, intensities = scip.scan_of(b"".join(reply.lines[1:]), has_intensities=is_intense)
    if is_intense:
        assert (distances, intensities) == (theirs[:, 0].tolist(), theirs[:, 1].tolist())
    else:
        assert (distances, intensities) == (theirs.tolist(), [])


def test_echoes_end_at_the_first_that_is_missing() -> None:
    steps = [[(1000, 5)], [(2000, 6), (3000, 7), (4000, 8)], [], [(5000, 9), (0, 0)]]
    for is_intense in (True, False):
        raw = device.scan_block("NE", "99", 0, steps, is_intense=is_intense)
        [reply], _ = replies(raw)
        found = scip.echoes_of(b"".join(reply.lines[1:]), has_intensities=is_intense)
        assert found == [[(mm, value * is_intense) for mm, value in step if mm] for step in steps]


def test_keys_and_values_are_read() -> None:
    [reply], errors = replies(device.texts("PP", device.PARAMETERS))
    assert (errors, scip.texts(reply.lines)) == (0, device.PARAMETERS)


def test_a_reply_without_checksum_of_the_status_is_read() -> None:
    assert replies(b"SCIP2.0\n0\n\n")[0] == [scip.ScipReply("SCIP2.0", "0", [], 0)]


def test_damage_costs_one_reply() -> None:
    good = device.scan_block("MD", "99", 7, [[(1000, 0)]] * 100, is_intense=False)
    for bad in (
        good[:-9] + b"0" + good[-8:], good[:50], b"\n\n", b"\xff\x00", b"MD\n\n", b"\n\n\n\n;\n;\n\n",
    ):  # fmt: skip
        found, errors = replies(good + bad + b"\n\n" + good)
        assert 2 <= len(found) <= 3, bad
        assert errors >= 1, bad
        assert found[0]._replace(received_ns=0) == found[-1]._replace(received_ns=0)


def test_an_endless_reply_is_bounded() -> None:
    splitter = scip.Replies()
    for _ in range(100):
        assert list(splitter.feed(b"x" * 10_000, 0)) == []
    assert splitter.errors == 3
    assert [each.echo for each in splitter.feed(b"\n\n" + device.block("QT", "00"), 0)] == ["QT"]


def test_the_clock_of_a_device_smooths_timestamps_and_wraps() -> None:
    rng, clock = random.Random(1), DeviceClock()  # noqa: S311
    begin_ms = scip.CLOCK_MS - 3000
    late = 0.0
    for number in range(400):
        true_s = 1e9 + number * 0.025
        received_s = true_s + rng.uniform(0, 0.02)
        stamp_s = clock.host_s((begin_ms + number * 25) % scip.CLOCK_MS, received_s)
        if number < USED_AFTER:
            assert stamp_s == received_s
        else:
            late = max(late, abs(stamp_s - true_s - 0.01))
    assert 0 < late < 0.006
    # the device is restarted: its clock no longer fits
    assert clock.host_s(5, 2e9) == 2e9
