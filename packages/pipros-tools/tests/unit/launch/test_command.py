import getpass
from pathlib import Path

import pytest

from pipros.basics.env import Environment
from pipros_tools.launch import placement
from pipros_tools.launch.command import CannotLaunch, CommandMaker
from pipros_tools.launch.log_history import FILE_BYTES, log_history
from pipros_tools.launch.logs import LogFolder, disk_usage_report
from pipros_tools.launch.model import LaunchNode, Machine, WorkingFolder
from pipros_tools.launch.placement import Placement, is_local
from pipros_workspace.index import SHARED_PACKAGES, PackageIndex
from tests.support.debian_system import make_debian


@pytest.fixture
def talker(tmp_path: Path) -> Path:
    program = tmp_path / "src" / "talkers" / "scripts" / "talker"
    program.parent.mkdir(parents=True)
    (program.parent.parent / "package.xml").write_text("<package><name>talkers</name></package>")
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    return program


@pytest.fixture
def maker(tmp_path: Path, talker: Path) -> CommandMaker:
    index = PackageIndex([tmp_path / "src", SHARED_PACKAGES])
    return CommandMaker(index, {"PATH": "/bin", "ROS_NAMESPACE": "/outer"}, tmp_path / "home")


def test_the_arguments_of_a_command_are_in_noetics_order(maker: CommandMaker, talker: Path) -> None:
    node = LaunchNode(
        "talkers", "talker", "n", arguments="one 'two three' $HOME", remappings=(("a", "b"), ("~c", "/d")),
        launch_prefix="nice -n 5",
    )  # fmt: skip
    command = maker.make(node, "http://m:1", log_stem="/log/n-1", extra_arguments=["--xml=y"])
    assert command.argv == (
        "nice", "-n", "5", str(talker), "one", "two three", "$HOME", "--xml=y",
        "a:=b", "~c:=/d", "__name:=n", "__log:=/log/n-1.log",
    )  # fmt: skip


def test_a_launcher_gives_its_variables_and_its_log_file(monkeypatch, tmp_path: Path, talker: Path) -> None:
    monkeypatch.setenv("COLOUR", "blue")
    environment = Environment(ros_home=tmp_path / "home")
    index = PackageIndex([tmp_path / "src"])
    maker = CommandMaker.for_launcher(environment, index, tmp_path / "roslaunch.log")
    command = maker.make(LaunchNode("talkers", "talker", "n"), "http://m:1")
    assert command.environment["COLOUR"] == "blue"
    assert command.environment["ROS_LOG_FILENAME"] == str(tmp_path / "roslaunch.log")
    assert maker.tag == f"ROS_LOG_FILENAME={tmp_path / 'roslaunch.log'}"
    assert command.folder == tmp_path / "home"


def test_the_environment_is_overlaid_and_later_variables_win(maker: CommandMaker) -> None:
    node = LaunchNode("talkers", "talker", "n", "/g/h/", environment=(("A", "1"), ("A", "2")))
    command = maker.make(node, "http://m:1")
    assert command.overlay == {"ROS_MASTER_URI": "http://m:1", "ROS_NAMESPACE": "/g/h", "A": "2"}
    assert command.environment["PATH"].endswith("/bin")
    assert command.environment["A"] == "2"


def test_a_node_at_the_root_has_no_namespace_of_the_launchers(maker: CommandMaker) -> None:
    assert "ROS_NAMESPACE" not in maker.make(LaunchNode("talkers", "talker", "n"), "http://m:1").environment


@pytest.mark.parametrize("choice", list(WorkingFolder))
def test_the_working_folder_is_the_requested_one(maker, talker, tmp_path, choice: WorkingFolder) -> None:
    command = maker.make(LaunchNode("talkers", "talker", "n", working_folder=choice), "http://m:1")
    assert command.folder == (talker.parent if choice is WorkingFolder.NODE else tmp_path / "home")


@pytest.mark.parametrize(("node", "complaint"), [
    (LaunchNode("taker", "talker", "n"), r"package \[taker\] not found.*; did you mean talkers\?"),
    (LaunchNode("talkers", "taker", "n"), r"of type \[taker\] in package .* Did you mean talker\?"),
    (LaunchNode("talkers", "talker", "n", arguments="'open"), r"the arguments \['open\] of node \[/n\]"),
    (LaunchNode("talkers", "talker", "n", launch_prefix="'open"), r"the launch-prefix \['open\]"),
    (
        LaunchNode("slam_karto", "slam_karto", "map"),
        r": package \[slam_karto\] not found. The programs of slam_karto .* ros-noetic-slam-karto",
    ),
    (
        LaunchNode(
            "nodelet", "nodelet", "cloud", arguments="load velodyne_pointcloud/CloudNodelet manager"
        ),
        "The nodelet velodyne_pointcloud/CloudNodelet is a C.* plugin",
    ),
])  # fmt: skip
def test_nodes_that_cannot_be_launched_are_explained(
    maker: CommandMaker, node: LaunchNode, complaint: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make_debian(tmp_path / "debian", monkeypatch)
    with pytest.raises(CannotLaunch, match=complaint):
        maker.make(node, "http://m:1")


def test_a_program_that_must_be_compiled_names_the_line_that_compiles_it(maker, talker: Path) -> None:
    package = talker.parents[1]
    (package / "package.xml").write_text("<package><name>turtlebot3_slam</name></package>")
    (package / "CMakeLists.txt").write_text(
        "project(turtlebot3_slam)\nadd_executable(${PROJECT_NAME}_imu src/imu.cpp)\n"
    )
    with pytest.raises(
        CannotLaunch, match=r"CMakeLists\.txt:2: turtlebot3_slam_imu is compiled from C"
    ) as refused:
        maker.make(LaunchNode("turtlebot3_slam", "turtlebot3_slam_imu", "n"), "http://m:1")
    assert "git clone" not in str(refused.value)


def test_a_well_known_package_with_programs_here_is_not_called_compiled(maker, talker: Path) -> None:
    (talker.parents[1] / "package.xml").write_text("<package><name>turtlesim</name></package>")
    with pytest.raises(CannotLaunch, match="Cannot locate node") as refused:
        maker.make(LaunchNode("turtlesim", "turtlesim", "n"), "http://m:1")
    assert "C++" not in str(refused.value)


@pytest.mark.needs("executable files")
def test_a_script_that_is_not_executable_is_reported(maker: CommandMaker, talker: Path) -> None:
    talker.chmod(0o644)
    with pytest.raises(CannotLaunch, match=rf"chmod \+x\)\. There is {talker}"):
        maker.make(LaunchNode("talkers", "talker", "n"), "http://m:1")


def test_another_machine_is_reached_by_ssh_and_runs_rosrun(maker: CommandMaker) -> None:
    machine = Machine("m", "robot", user="ada", ssh_port=2222, env_loader="/opt/env.sh", timeout_s=2.5)
    node = LaunchNode("talkers", "talker", "n", "/g/", arguments="'a b'", launch_prefix="nice -n 5")
    command = maker.make(node, "http://m:1", machine=machine, log_stem="/log/n")
    *ssh, remote = command.argv
    assert ssh == [
        "ssh", "-tt", "-o", "BatchMode=yes", "-o", "ConnectTimeout=3", "-p", "2222", "--", "ada@robot",
    ]  # fmt: skip
    assert remote == (
        "/opt/env.sh env ROS_MASTER_URI=http://m:1 ROS_NAMESPACE=/g "
        "rosrun --prefix 'nice -n 5' talkers talker 'a b' __name:=n"
    )


BASE = Machine("base", "base.local")


@pytest.fixture
def lookups(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The resolved addresses; only `localhost` is this computer."""
    found: list[str] = []

    def is_this_machine(host: str) -> bool:
        found.append(host)
        return host == "localhost"

    monkeypatch.setattr(placement, "is_this_machine", is_this_machine)
    return found


def test_a_machine_is_looked_up_once_and_only_when_a_node_needs_it(lookups: list[str]) -> None:
    machines = {
        "base": BASE, "near": Machine("near", "localhost"), "unused": Machine("unused", "unused.local")
    }  # fmt: skip
    nodes = Placement(machines)
    for _ in range(3):
        assert nodes.remote_machine(LaunchNode("p", "t", "n", machine="base")) is BASE
        assert nodes.remote_machine(LaunchNode("p", "t", "n", machine="near")) is None
        assert nodes.remote_machine(LaunchNode("p", "t", "n")) is None
    assert lookups == ["base.local", "localhost"]


def test_this_computer_is_local_for_its_own_user_only(lookups: list[str]) -> None:
    assert is_local(Machine("m", "localhost", user=getpass.getuser()))
    assert not is_local(Machine("m", "localhost", user=getpass.getuser() + "x"))
    assert lookups == ["localhost"]


def test_each_run_has_a_log_folder_and_latest_points_to_the_newest(tmp_path: Path) -> None:
    environment = Environment(log_dir=tmp_path / "log")
    LogFolder.of_run(environment, "one")
    second = LogFolder.of_run(environment, "two")
    assert (tmp_path / "log" / "latest").resolve() == second.path
    assert second.stem("g/h/n-2") == str(tmp_path / "log" / "two" / "g-h-n-2")
    assert second.is_usable
    assert list(second.path.iterdir()) == []


def test_a_log_folder_that_cannot_be_made_is_reported_once(tmp_path: Path, capsys) -> None:
    (tmp_path / "file").touch()
    environment = Environment(log_dir=tmp_path / "file" / "log")
    assert [LogFolder.of_run(environment, "run").is_usable for _ in range(2)] == [False, False]
    assert capsys.readouterr().err.count("set ROS_LOG_DIR to a writable location") == 1


def test_a_large_log_folder_is_warned_about(tmp_path: Path) -> None:
    assert disk_usage_report(tmp_path) == "Done checking log file disk usage. Usage is <1GB."
    with (tmp_path / "large").open("wb") as file:
        file.truncate(1_000_000_001)
    assert disk_usage_report(tmp_path).startswith(f"WARNING: disk usage in log directory [{tmp_path}]")


@pytest.mark.parametrize(
    ("files", "end"), [(1, "Usage is <1GB."), (200, "There are too many files to measure it quickly.")]
)
def test_few_log_files_are_measured_on_a_busy_machine_too(tmp_path: Path, files: int, end: str) -> None:
    is_over_at_once = -1.0
    for number in range(files):
        (tmp_path / str(number)).touch()
    assert disk_usage_report(tmp_path, is_over_at_once) == f"Done checking log file disk usage. {end}"


# Log entries read from the log file of a run.


RUN = "0fb2803c-e4ea-11f1"
GENUINE = "1.5  WARN /arm [/ws/arm.py:7(move)] [topics: /rosout, /a] slow"


def history(folder: Path, text: str, run_id: object = RUN) -> list[list[object]]:
    (folder / RUN).mkdir()
    (folder / RUN / "rosout.log").write_text(text)
    return log_history(folder, run_id, 100, 100)


def test_lines_become_entries(tmp_path: Path) -> None:
    text = f"1.0 Node Startup\n{GENUINE}\n2.000000001 ERROR /b [x.cpp:1(f)] [topics: ] two\n\tlines\n"
    assert history(tmp_path, text) == [
        [4, "/arm", "slow", 1.5, "/ws/arm.py", 7, "move"],
        [8, "/b", "two\nlines", 2.0, "x.cpp", 1, "f"],
    ]


def test_only_the_end_of_a_large_file_is_read(tmp_path: Path) -> None:
    found = history(tmp_path, f"{GENUINE} {'x' * 90}\n" * (FILE_BYTES // 100))
    assert 0 < len(found) <= FILE_BYTES // (len(GENUINE) + 92)
    assert all(len(str(entry[2])) <= 100 for entry in found)


@pytest.mark.parametrize("run_id", ["../x", "", 7, "other"])
def test_a_run_without_a_file_has_no_history(tmp_path: Path, run_id: object) -> None:
    assert history(tmp_path, f"{GENUINE}\n", run_id) == []
