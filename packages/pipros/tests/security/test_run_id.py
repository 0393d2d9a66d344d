"""Any peer may set `/run_id`, which names the folder of log files: paths and line breaks are refused."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from pipros.master.master import Master
from pipros.net.master_client import MasterClient
from pipros_tools.launch.run_id import is_run_id, new_run_id
from tests.support.ros import RosSystem

HOSTILE = ["../../stolen", "a/b", "..", "latest", "x" * 65, "line\nbreak", "\x1b[31m", "", "run\n"]


@pytest.fixture
def client(ros: RosSystem) -> Iterator[MasterClient]:
    with Master(host="127.0.0.1", port=ros.port) as master:
        client = MasterClient(master.uri, "/a_peer")
        yield client
        client.close()


def launch_nothing(ros: RosSystem, *options: str) -> tuple[int, str]:
    file = ros.home / "empty.launch"
    file.write_text("<launch><param name='a' value='1'/></launch>")
    run = ros.pipros.run("roslaunch", *options, file)
    return run.returncode or 0, run.output


@pytest.mark.parametrize("value", HOSTILE)
def test_an_invalid_folder_name_is_not_a_run_id(value: str) -> None:
    assert not is_run_id(value)


def test_ids_of_noetic_and_of_pipros_name_runs() -> None:
    assert is_run_id("0fb2803c-e4ea-11f1-916a-02fc00000001")
    assert is_run_id(new_run_id())


@pytest.mark.parametrize("value", ["../../stolen", "x" * 300, "line\nbreak"], ids=repr)
def test_roslaunch_logs_to_a_new_folder_if_the_run_id_is_unsafe(
    ros: RosSystem, client: MasterClient, value: str
) -> None:
    client.set_param("/run_id", value)

    code, output = launch_nothing(ros)

    assert code == 0, output
    assert "WARNING: /run_id on the parameter server must be up to 64 letters" in output
    logs = Path(ros.pipros.environment["ROS_HOME"]) / "log"
    [folder] = (entry for entry in logs.iterdir() if not entry.is_symlink())
    assert is_run_id(folder.name)
    assert list(ros.home.rglob("stolen")) == []


def test_roslaunch_logs_does_not_print_an_unsafe_run_id(ros: RosSystem, client: MasterClient) -> None:
    client.set_param("/run_id", "../\u009b31m")

    run = ros.pipros.run("roslaunch-logs")

    assert (run.returncode, run.stdout) == (1, [])
    assert "\u009b" not in run.output


def test_a_run_id_on_the_command_line_is_checked_as_well(ros: RosSystem) -> None:
    code, output = launch_nothing(ros, "--run_id", "../up")

    assert code == 1
    assert "--run_id must be up to 64 letters, digits, _ and -, got [../up]" in output
