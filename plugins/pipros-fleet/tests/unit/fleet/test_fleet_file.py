"""Fleet files: their settings and their error messages."""

from pathlib import Path

import pytest

from pipros_fleet.fleet_file import BadFleetFile, parse_fleet_file, read_fleet_file
from pipros_fleet.fleet_rules import FleetFile, Priority, matches

FULL = """
router: tls/fleet.example.org:7447
show: ["robot*"]
bandwidth_kbit: 1000
share:
  topics:
    - name: /camera/**
      rate_hz: 2
      latest_only: true
      priority: low
      compress: true
    - name: /tf
      rate_hz: 10
      prefix_frames: true
    - name: /debug/**
      allow: false
    - /**
  parameters: [/robot_description]
accept:
  topics:
    - name: /cmd_vel
      from: [operator]
  services: [/reset]
  parameters: []
"""


def test_a_file_is_read_whole() -> None:
    file = parse_fleet_file(FULL)

    camera = file.shared_topic("/camera/left/image")
    assert camera is not None
    assert (camera.rate_hz, camera.is_latest_only, camera.priority) == (2.0, True, Priority.LOW)
    assert camera.is_compressed
    tf = file.shared_topic("/tf")
    assert tf is not None
    assert tf.has_prefixed_frames
    assert (file.router, file.show, file.bandwidth_kbit) == ("tls/fleet.example.org:7447", ("robot*",), 1000)
    assert file.shared_topic("/debug/a") is None
    assert file.shared_topic("/scan") is not None
    command = file.accepted_topic("/cmd_vel")
    assert command is not None
    assert command.accepts("operator")
    assert not command.accepts("robot2")
    assert file.accepted_topic("/other") is None
    assert file.accepted_service("/reset") is not None
    assert file.shares_parameter("/robot_description", "anyone")
    assert not file.shares_parameter("/secret", "anyone")
    assert not file.sets_parameter("/robot_description", "operator")


def test_without_a_file_everything_is_shared_and_nothing_is_accepted() -> None:
    assert parse_fleet_file("") == FleetFile()
    assert FleetFile().shared_topic("/scan") is not None
    assert FleetFile().accepted_topic("/cmd_vel") is None
    assert FleetFile().accepted_service("/reset") is None


def test_simulated_time_is_never_shared() -> None:
    file = parse_fleet_file("{share: {topics: [/clock]}, accept: {topics: [/clock]}}")
    assert file.shared_topic("/clock") is None
    assert file.accepted_topic("/clock") is None


def test_logs_are_shared_only_by_name() -> None:
    assert FleetFile().shared_topic("/rosout") is None
    assert parse_fleet_file("share: {topics: [/rosout]}").shared_topic("/rosout") is not None


@pytest.mark.parametrize(("pattern", "name", "expected"), [
    ("/a/*", "/a/b", True), ("/a/*", "/a/b/c", False), ("/a/**", "/a/b/c", True), ("/**", "/a", True),
    ("/*/x", "/a/x", True), ("/a", "/ab", False), ("robot*", "robot12", True), ("/a.b", "/axb", False),
])  # fmt: skip
def test_wildcards(pattern: str, name: str, expected: bool) -> None:
    assert matches(pattern, name) is expected


@pytest.mark.parametrize(("text", "reason"), [
    (
        "[1, 2]",
        "f.yaml: the file must be a mapping with the keys accept, bandwidth_kbit, router, share, show",
    ),
    ("shares: {}", "f.yaml: unknown key [shares]; the keys are"),
    ("share: {topics: /a}", "f.yaml: share.topics must be a list, got '/a'"),
    ("share: {topics: [a b]}", "share.topics[0] must be a global name such as /camera/**, got 'a b'"),
    ("share: {topics: [{rate_hz: 1}]}", "share.topics[0]: missing required key [name]"),
    (
        "share: {topics: [{name: /a, rate_hz: -1}]}",
        "share.topics[0].rate_hz must be a finite number >= 0, got -1",
    ),
    ("share: {topics: [{name: /a, rate_hz: .nan}]}", "rate_hz must be a finite number >= 0, got nan"),
    ("share: {topics: [{name: /a, rate_hz: true}]}", "rate_hz must be a finite number >= 0, got True"),
    ("accept: {services: [{name: /a, timeout_s: 0}]}", "timeout_s must be > 0, got 0"),
    (
        "share: {topics: [{name: /a, priority: top}]}",
        "priority must be one of high, normal, low, got 'top'",
    ),
    (
        "share: {topics: [{name: /a, priority: [1]}]}",
        "priority must be one of high, normal, low, got [1]",
    ),
    ("share: {topics: [{name: /a, compress: 1}]}", "compress must be true or false, got 1"),
    ("share: {topics: [{name: /a, from: [b]}]}", "share.topics[0]: unknown key [from]"),
    (
        "accept: {topics: [{name: /a, from: b}]}",
        "accept.topics[0].from must be a list of strings, got 'b'",
    ),
    ("router: 7447", "router must be a string, got 7447"), ("a: !!python/object:os.system {}", "f.yaml"),
    ("{", "f.yaml"), ("&a [*a, *a]", "f.yaml"), ("[" * 100_000, "f.yaml"),
    (f"share: {{topics: [{'&a [' + ', '.join(['x'] * 9) + ']'}, [*a, *a]]}}", "f.yaml"),
])  # fmt: skip
def test_errors_name_the_file_and_the_place(text: str, reason: str) -> None:
    with pytest.raises(BadFleetFile) as caught:
        parse_fleet_file(text, "f.yaml")
    assert reason in str(caught.value)


def test_unreadable_files_raise(tmp_path: Path) -> None:
    with pytest.raises(BadFleetFile, match="No such file"):
        read_fleet_file(tmp_path / "missing.yaml")
    with pytest.raises(BadFleetFile, match=r"not a regular file|directory|denied"):
        read_fleet_file(tmp_path)


def test_large_files_are_refused_before_they_are_parsed(tmp_path: Path) -> None:
    file = tmp_path / "large.yaml"
    file.write_text(f"share: {{topics: [{2_000_000 * 'a,'}]}}")
    with pytest.raises(BadFleetFile, match=r"large\.yaml: it is larger than 262144 bytes"):
        read_fleet_file(file)


def test_the_example_of_the_module_is_valid() -> None:
    from pipros_fleet import fleet_file

    head = (fleet_file.__doc__ or "").partition("\n\n")[2].partition("\n\nThe first rule")[0]
    assert parse_fleet_file(head).bandwidth_kbit == 1000
