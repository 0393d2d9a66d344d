"""The reports of machine monitors, and the packets of SNTP."""

import struct
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from diagnostic_common_diagnostics.nodes import hd_monitor, sensors_monitor
from pipros_libraries.diagnostics import sntp
from pipros_libraries.diagnostics.items import ERROR, OK, WARN
from pipros_libraries.diagnostics.machine import (
    BadReading,
    DiskHeat,
    DiskSpace,
    Report,
    Sensor,
    cpu_report,
    heat_report,
    ntp_failure,
    ntp_report,
    parsed_hddtemp,
    ram_report,
    sensors_report,
    space_report,
)

NOW = 1_800_000_000.25


def test_the_busiest_processor_counts() -> None:
    report = cpu_report([10.0, 95.5], 90)
    assert (report.level, report.message) == (WARN, "At least one CPU exceeds 90 percent")
    assert report.values == [("CPU Load Average", "52.75"), ("CPU 0 Load", "10.00"), ("CPU 1 Load", "95.50")]
    assert cpu_report([], 90).level == OK


def test_memory() -> None:
    assert ram_report(50.0, 90).message == "RAM Average 50.00 percent"
    assert (ram_report(91.0, 90).level, ram_report(91.0, 90).message) == (
        WARN,
        "RAM Average exceeds 90 percent",
    )


def test_the_daemon_of_hddtemp_is_read() -> None:
    disks = parsed_hddtemp("|/dev/sda|WDC 10|41|C||/dev/sdb|Old|158|F||/dev/sdc|Quiet|SLP|*|")

    assert disks == [
        DiskHeat("/dev/sda", "WDC 10", 41.0),
        DiskHeat("/dev/sdb", "Old", 70.0),
        DiskHeat("/dev/sdc", "Quiet", None),
    ]
    assert parsed_hddtemp("") == []
    with pytest.raises(BadReading, match="HTTP/1"):
        parsed_hddtemp("HTTP/1.1 400 Bad Request")


@pytest.mark.parametrize(
    ("degrees", "level", "message"), [(55, OK, "OK"), (55.1, WARN, "Hot"), (70.1, ERROR, "Critical Hot")]
)
def test_disks_are_hot(degrees: float, level: int, message: str) -> None:
    disks = [DiskHeat("/dev/sda", "A", degrees), DiskHeat("/dev/sdb", "B", None)]
    report = heat_report(disks)

    assert (report.level, report.message) == (level, message)
    assert report.values[:4] == [
        ("Disk 0 Temp Status", message), ("Disk 0 Mount Pt.", "/dev/sda"), ("Disk 0 Device ID", "A"),
        ("Disk 0 Temp", f"{degrees:g}"),
    ]  # fmt: skip
    assert report.values[7] == ("Disk 1 Temp", "SLP")
    assert (heat_report(disks, warns=False).level, heat_report([]).level) == (OK, ERROR)


def test_disks_are_full() -> None:
    full = DiskSpace("/dev/a", "/", 100, 1)
    assert (space_report([full]).level, space_report([full]).message) == (ERROR, "Very Low Disk Space")
    report = space_report([DiskSpace("/dev/b", "/b", 100, 5), DiskSpace("stick", "/c", 9, 0)])
    assert (report.level, report.message, len(report.values)) == (WARN, "Low Disk Space", 6)
    assert space_report([DiskSpace("/dev/b", "/b", 100, 6)]).level == OK


def test_the_room_is_that_of_the_disk_with_the_folder() -> None:
    parts = [SimpleNamespace(device=f"dev{m}", mountpoint=m) for m in ("/", "/home", "/ho")]
    source = SimpleNamespace(
        disk_usage=lambda _: SimpleNamespace(total=20 * 2**30 - 1, free=7 * 2**30 + 5),
        disk_partitions=lambda all: parts,  # noqa: A006
    )

    values = dict(hd_monitor.space_below(source, "/home/me").values)

    assert values["Disk 1 Name"] == "dev/home"
    assert (values["Disk 1 Size"], values["Disk 1 Available"]) == ("20", "7")

    def fail(_: str) -> Any:
        raise FileNotFoundError("nothing there")

    source.disk_usage = fail
    report = hd_monitor.space_below(source, "/nothing")
    assert (report.level, report.values[1]) == (ERROR, ("Disk Space Ex", "nothing there"))


def test_a_kept_report_is_read_when_it_is_old() -> None:
    reports = iter([heat_report([]), space_report([])])
    kept = hd_monitor.Kept(lambda: next(reports), 10.0)

    assert kept.report(5.0).level == ERROR
    later = kept.report(14.5)
    assert (later.level, later.values[:2]) == (ERROR, [("Update Status", "OK"), ("Time Since Update", "9.5")])
    assert kept.report(15.0).level == OK


def test_sensors() -> None:
    hot = Sensor("Core 0", "Temperature", 91.0, 80.0, 90.0)
    warm = Sensor("Core 1", "Temperature", 85.0, 80.0, 90.0)
    still = Sensor("fan1", "Speed", 0.0)
    unknown = Sensor("Core 2", "Temperature", 200.0, 0.0, None)

    assert sensors_report([]).message == "OK"
    assert sensors_report([unknown]).values == [("Core 2 Temperature", "200")]
    assert sensors_report([unknown]).level == OK
    assert (sensors_report([warm]).level, sensors_report([warm]).message) == (WARN, "High Temperature")
    assert sensors_report([hot, warm]).message == "Critical Temperature; High Temperature"
    assert sensors_report([still]).message == "No Fan Speed"
    assert sensors_report([still], ignore_fans=True).level == OK
    assert list(sensors_monitor.readings(SimpleNamespace())) == []
    item = SimpleNamespace(label="", current=40.0, high=None, critical=None)
    chips = SimpleNamespace(
        sensors_temperatures=lambda: {"acpi": [item]}, sensors_fans=lambda: {"thinkpad": [item]}
    )
    assert [sensor.name for sensor in sensors_monitor.readings(chips)] == ["acpi", "thinkpad"]


def test_voltages(tmp_path: Path) -> None:
    chip = tmp_path / "hwmon0"
    chip.mkdir()
    files = {
        "name": "nct6775", "in0_input": "1208", "in0_label": "Vcore Voltage", "in0_min": "900",
        "in0_max": "1400", "in1_input": "3000", "in1_min": "3200", "in2_input": "not a number",
    }  # fmt: skip
    for name, text in files.items():
        (chip / name).write_text(f"{text}\n")

    found = list(sensors_monitor.voltages(tmp_path))

    assert found == [
        Sensor("Vcore", "Voltage", 1.208, high=1.4, low=0.9),
        Sensor("nct6775 in1", "Voltage", 3.0, low=3.2),
    ]
    assert sensors_report(found[:1]) == Report(OK, "OK", [("Vcore Voltage", "1.208")])
    assert sensors_report(found).message == "Low Voltage"
    high = sensors_report([Sensor("Vcore", "Voltage", 1.5, high=1.4)])
    assert (high.level, high.message) == (ERROR, "High Voltage")
    assert list(sensors_monitor.voltages(tmp_path / "nothing")) == []


def test_clocks() -> None:
    assert (ntp_report(-400, 500, 5e6).level, ntp_report(-501, 500, 5e6).level) == (OK, WARN)
    report = ntp_report(6e6, 500, 5e6)
    assert (report.level, report.message) == (ERROR, "NTP Offset Too High")
    assert dict(report.values)["Offset (us)"] == "6000000"
    assert dict(ntp_failure("no", 500, 5e6).values)["Offset (us)"] == "N/A"


def answer_to(asked: bytes, ahead_s: float, **changed: int) -> bytes:
    """Return the response of a server whose clock is ahead; packets take a tenth of a second each way."""
    words = list(struct.unpack(">11I", asked[4:]))
    words[5:7] = struct.unpack(">II", asked[40:48])
    for place, after in ((7, 0.1), (9, 0.2)):
        at = NOW + ahead_s + after + 2_208_988_800
        words[place : place + 2] = [int(at) & 0xFFFFFFFF, int((at % 1) * 2**32)]
    first = changed.get("leap", 0) << 6 | 4 << 3 | changed.get("mode", 4)
    return struct.pack(">BBbb11I", first, changed.get("stratum", 2), 0, 0, *words)


@pytest.mark.parametrize("ahead_s", [0.0, 0.5, -3600.0, 86400.0 * 365 * 30])
def test_a_server_reports_the_offset_of_its_clock(ahead_s: float) -> None:
    asked = sntp.question(NOW)
    assert len(asked) == 48

    assert sntp.offset_s(answer_to(asked, ahead_s), asked, NOW, NOW + 0.3) == pytest.approx(ahead_s, abs=1e-6)


def test_invalid_ntp_responses_are_refused() -> None:
    asked = sntp.question(NOW)
    good = answer_to(asked, 0.0)
    for wrong in (
        b"",
        good[:47],
        answer_to(asked, 0.0, mode=3),
        answer_to(asked, 0.0, stratum=0),
        answer_to(asked, 0.0, leap=3),
        good[:24] + bytes(8) + good[32:],
    ):
        with pytest.raises(BadReading):
            sntp.offset_s(wrong, asked, NOW, NOW)
