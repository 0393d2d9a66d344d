"""Findings about the setup of a machine: each fault is found, and nothing on a healthy one."""

import base64
import hashlib
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from pipros.basics.env import DEFAULT_MASTER_URI
from pipros_tools.health.finding import FindingSeverity, has_errors
from pipros_tools.health.gather_machine import changed_packages, gather_machine
from pipros_tools.health.machine import MachineReport, PathKind
from pipros_tools.health.machine_checks import check_machine
from pipros_tools.health.windows_setup import WindowsReport

PROGRAMS, PACKAGES = Path("/venv/bin"), Path("/venv/lib")

HEALTHY = MachineReport(
    variables={"ROS_MASTER_URI": "http://robot:11311", "ROS_PACKAGE_PATH": "/ws/src", "PYTHONPATH": ""},
    hostname="desk", addresses=("127.0.0.1", "10.0.0.2"),
    resolved={"robot": ("10.0.0.1",), "desk": ("10.0.0.2",)},
    own_hosts=frozenset({"desk", "127.0.0.1", "10.0.0.2", "192.168.7.2", "localhost"}),
    address_towards_master="10.0.0.2", paths={"/ws/src": PathKind.FOLDER}, own_programs=PROGRAMS,
    python_packages={"rospy": PACKAGES}, own_packages=frozenset({PACKAGES}), master_error="",
)  # fmt: skip


def machine(variables: dict[str, str] | None = None, **changes: Any) -> MachineReport:
    return replace(HEALTHY, variables={**HEALTHY.variables, **(variables or {})}, **changes)


FAULTS: dict[str, MachineReport] = {
    "mixed-programs": machine(foreign_programs={"rostopic": Path("/opt/ros/noetic/bin/rostopic")}),
    "mixed-python": machine(python_packages={"rospy": Path("/opt/ros/noetic/lib/python3/dist-packages")}),
    "changed-packages": machine(changed_packages={"rospy": "py3rosmsgs", "genpy": ""}),
    "ros-2-environment": machine({"ROS_VERSION": "2", "AMENT_PREFIX_PATH": "/opt/ros/humble"}),
    "ros-2-packages": machine(ros2_packages=("nav_msgs", "rcl", "std_msgs", "std_srvs", "tf2_msgs")),
    "mixed-paths": machine({"CMAKE_PREFIX_PATH": "/ws/devel:/opt/ros/noetic"}),
    "missing-path": machine({"ROS_PACKAGE_PATH": "/gone/src"}, paths={"/gone/src": PathKind.MISSING}),
    "missing-setup-file": machine(missing_setup_files={"/opt/ros/noetic/setup.bash": "~/.bashrc"}),
    "workspace-not-set-up": machine(workspace=Path("/home/me/ws/devel")),
    "master-uri": machine({"ROS_MASTER_URI": "robot:11311"}),
    "master-host-unknown": machine(resolved={"robot": (), "desk": ("10.0.0.2",)}),
    "no-master": machine(master_error="Connection refused"),
    "stale-master-uri": machine(master_error="no response in time", other_master=DEFAULT_MASTER_URI),
    "hostname-unknown": machine(resolved={"robot": ("10.0.0.1",), "desk": ()}),
    "hostname-of-another": machine({"ROS_HOSTNAME": "lamp"}, resolved={"lamp": ("10.0.0.9",)}),
    "hostname-form": machine({"ROS_HOSTNAME": "http://desk:11311"}),
    "hostname-and-ip": machine({"ROS_HOSTNAME": "desk", "ROS_IP": "192.168.7.2"}),
    "ip-of-another": machine({"ROS_IP": "10.9.9.9"}),
    "ip-of-another-network": machine({"ROS_IP": "192.168.7.2"}),
    "loopback-advertised": machine({"ROS_IP": "127.0.0.1"}),
    "port-range": machine({"PIPROS_PORTS": "11420-11400"}),
    "ports-taken": machine({"PIPROS_PORTS": "11400"}, port_problem="no free port in 11400"),
    "advertised-form": machine({"PIPROS_ADVERTISE": "lamp:80"}),
    "advertised-unknown": machine({"PIPROS_PORTS": "11400", "PIPROS_ADVERTISE": "lamp"},
        resolved={**HEALTHY.resolved, "lamp": ()}),
    "advertised-any-port": machine({"PIPROS_ADVERTISE": "10.0.0.9"}),
    "unmapped-port": machine({"PIPROS_PORTS": "11400-11401", "PIPROS_ADVERTISE": "10.0.0.9:80=11400"}),
    "advertised-not-bound": machine({"PIPROS_PORTS": "11400", "PIPROS_ADVERTISE": "10.0.0.9:80"},
        bound_host="127.0.0.1"),
    "not-called-back": machine(not_called_back="http://10.0.0.9:80/"),
    "execution-policy": machine(windows=WindowsReport(refusing_policy="Restricted")),
    "scripts-not-in-path": machine(windows=WindowsReport(scripts_off_path=r"C:\venv\Scripts")),
    "long-paths": machine({"ROS_HOME": "/" + "x" * 140}, windows=WindowsReport(has_long_paths=False)),
    "firewall": machine(windows=WindowsReport(blocking_rules=("python.exe",))),
    "wsl-nat": machine(windows=WindowsReport(wsl_network="nat")),
    "cannot-write": machine({"ROS_LOG_DIR": "/logs"}, paths={"/logs": PathKind.READ_ONLY}),
}  # fmt: skip


def test_nothing_is_found_on_a_healthy_machine() -> None:
    assert check_machine(HEALTHY) == []


@pytest.mark.parametrize("rule", FAULTS)
def test_only_the_planted_fault_is_found(rule: str) -> None:
    findings = check_machine(FAULTS[rule])
    assert [finding.rule for finding in findings] == [rule]
    assert findings[0].summary
    assert findings[0].cure


def test_a_loopback_master_asks_for_no_addresses() -> None:
    lonely = machine(
        {"ROS_MASTER_URI": "http://localhost:11311", "ROS_IP": "127.0.0.1"}, resolved={"desk": ()}
    )
    assert check_machine(lonely) == []


@pytest.mark.parametrize(("uri", "cure"), [
    ("http://localhost:11311", "Start it: roscore"), ("http://localhost:11312", "Start it: roscore -p 11312"),
    ("http://robot:11311", "Start roscore on [robot]"),
])  # fmt: skip
def test_advice_for_a_missing_master_depends_on_its_host(uri: str, cure: str) -> None:
    (finding,) = check_machine(machine({"ROS_MASTER_URI": uri}, master_error="Connection refused"))
    assert finding.cure.startswith(cure)


@pytest.mark.parametrize(("uri", "other", "cure"), [
    ("http://localhost:11311", "http://10.0.0.2:11311", "export ROS_MASTER_URI=http://10.0.0.2:11311 in"),
    ("http://10.0.0.2:11311", DEFAULT_MASTER_URI, "or, to let other machines connect, restart that master"),
    ("http://robot:11311", DEFAULT_MASTER_URI, "ROS_MASTER_URI is probably outdated"),
])  # fmt: skip
def test_advice_if_another_master_runs_here_never_starts_a_second_one(
    uri: str, other: str, cure: str
) -> None:
    (finding,) = check_machine(
        machine({"ROS_MASTER_URI": uri}, master_error="Connection refused", other_master=other)
    )
    assert finding.rule == "stale-master-uri"
    assert other in finding.summary
    assert cure in finding.cure
    assert "Start it" not in finding.cure


def test_the_cure_names_the_address_that_others_can_reach() -> None:
    (finding,) = check_machine(FAULTS["ip-of-another-network"])
    assert finding.cure == "export ROS_IP=10.0.0.2"
    assert finding.severity is FindingSeverity.WARNING
    assert has_errors(check_machine(FAULTS["ip-of-another"]))


def test_a_machine_without_a_route_to_the_master_is_not_advised_to_advertise_loopback() -> None:
    unplugged = machine(
        {"ROS_IP": "10.0.0.2"}, address_towards_master="127.0.0.1", master_error="Network is unreachable"
    )
    assert [finding.rule for finding in check_machine(unplugged)] == ["no-master"]


def test_a_zip_file_may_be_in_the_python_path() -> None:
    assert check_machine(machine({"PYTHONPATH": "/x.zip"}, paths={"/x.zip": PathKind.FILE})) == []


def test_an_address_that_is_right_but_not_reached_points_to_a_firewall() -> None:
    (finding,) = check_machine(machine(not_called_back="http://10.0.0.2:41000/"))
    assert finding.rule == "not-called-back"
    assert "a firewall drops incoming connections" in finding.cure
    (finding,) = check_machine(machine(not_called_back="http://192.168.7.2:41000/"))
    assert "firewall" not in finding.cure
    assert finding.cure.startswith(
        "Set ROS_IP to an address of this machine that the master's machine can reach, such as 10.0.0.2. "
    )


@pytest.mark.parametrize("value", ["10.0.0.2:11311", "http://10.0.0.2"])
def test_an_invalid_address_is_a_finding(value: str) -> None:
    found = check_machine(machine({"ROS_IP": value}, not_called_back=f"http://[{value}]:41000/"))
    assert [finding.rule for finding in found] == ["ip-of-another", "not-called-back"]
    assert found[0].cure == "export ROS_IP=10.0.0.2, or unset it."


def test_the_addresses_of_this_machine_include_the_one_that_the_cure_names() -> None:
    (finding,) = check_machine(machine({"ROS_IP": "10.9.9.9"}, addresses=("127.0.0.1",)))
    assert (
        finding.summary
        == "ROS_IP [10.9.9.9] is not an address of this machine, which has 127.0.0.1, 10.0.0.2"
    )
    assert finding.cure.startswith("export ROS_IP=10.0.0.2")


@pytest.mark.parametrize("harmless", [
    machine(windows=WindowsReport(blocking_rules=("python.exe",)), bound_host="127.0.0.1"),
    machine(windows=WindowsReport(wsl_network="mirrored")),
    machine({"ROS_MASTER_URI": "http://localhost:11311"}, windows=WindowsReport(wsl_network="nat")),
])  # fmt: skip
def test_what_does_no_harm_on_windows_is_not_found(harmless: MachineReport) -> None:
    assert check_machine(harmless) == []


@pytest.mark.parametrize("is_windows", [False, True])
def test_the_command_that_sets_up_a_workspace_is_one_of_the_shell(monkeypatch, is_windows: bool) -> None:
    monkeypatch.setattr("pipros_tools.health.machine_checks.ON_WINDOWS", is_windows)
    (finding,) = check_machine(machine(workspace=Path("/my ws/devel")))
    place = Path("/my ws/devel/setup")
    assert finding.cure == (f'call "{place}.bat"' if is_windows else f"source '{place}.bash'")


# Modules of pipros that another distribution replaced are found by the hashes that pip recorded.


OURS = "pipros-of-test"


def install(folder: Path, name: str, modules: dict[str, str]) -> None:
    """Write modules and a record of them, as pip does."""
    rows = [f"../../bin/{name},,", "RECORD,,"]
    for module, text in modules.items():
        path = folder / module
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(text.encode())
        digest = base64.urlsafe_b64encode(hashlib.sha256(text.encode()).digest()).rstrip(b"=").decode()
        rows.append(f"{module},sha256={digest},{len(text)}")
    records = folder / f"{name.replace('-', '_')}-1.0.dist-info"
    records.mkdir()
    (records / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (records / "RECORD").write_text("\n".join(rows) + "\n")


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    others = [folder for folder in sys.path if "site-packages" not in folder]  # pipros may be installed there
    monkeypatch.setattr(sys, "path", [str(tmp_path), *others])
    install(
        tmp_path, OURS, {"rospy/__init__.py": "ours\n", "rospy/core.py": "ours\n", "rosbag/bag.py": "ours\n"}
    )
    return tmp_path


def test_files_of_other_packages_are_ignored(site: Path) -> None:
    install(site, "bag-viewer", {"bag_viewer/__init__.py": "theirs\n"})
    assert changed_packages(OURS) == {}


def test_the_distribution_that_replaced_modules_is_named(site: Path) -> None:
    install(site, "old-messages", {"rospy/core.py": "theirs\n", "std_msgs/__init__.py": "theirs\n"})
    assert changed_packages(OURS) == {"rospy": "old-messages"}


def test_equal_modules_of_two_distributions_do_not_matter(site: Path) -> None:
    install(site, "same", {"rospy/core.py": "ours\n"})
    assert changed_packages(OURS) == {}


def test_a_deleted_module_has_no_owner(site: Path) -> None:
    (site / "rosbag" / "bag.py").unlink()
    assert changed_packages(OURS) == {"rosbag": ""}


def test_packages_not_installed_by_pip_are_not_examined() -> None:
    assert changed_packages("not-installed-at-all") == {}


# Start files of shells that source setup files of ROS that do not exist.


def test_a_missing_setup_file_in_bashrc_is_found(tmp_path: Path) -> None:
    (tmp_path / "my ws" / "setup.bash").mkdir(parents=True)
    missing = f". /opt/ros/none/setup.sh\nsource ~/my ws/setup.bash # lab\nsource '{tmp_path}/a/setup.bash'\n"
    present = 'source "$HOME/my ws/setup.bash"\n# source /opt/ros/none/setup.zsh\n. $LAB/setup.zsh\n'
    (tmp_path / ".bashrc").write_text(missing + present)
    variables = {"HOME": str(tmp_path), "PATH": "/usr/bin", "ROS_MASTER_URI": "http://127.0.0.1:1"}
    expected = ["/opt/ros/none/setup.sh", f"{tmp_path}/my ws/setup.bash", f"{tmp_path}/a/setup.bash"]
    assert gather_machine(variables).missing_setup_files == dict.fromkeys(expected, "~/.bashrc")
