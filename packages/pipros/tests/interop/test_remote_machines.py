"""Nodes on another machine, started by genuine roslaunch and ours over a real ssh connection."""

import os
import re
import shutil
import signal
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from tests.support.processes import Process
from tests.support.programs import make_programs
from tests.support.ros import RosSystem, Side
from tests.support.sshd import SSHD, SshServer
from tests.support.waiting import wait_until

FILE = """\
<launch>
  <machine name="far" address="{address}" ssh-port="{port}" env-loader="{loader}" timeout="60"/>
  <remap from="a" to="b"/>
  <group ns="g">
    <node machine="far" pkg="programs" type="tell" name="there" args="one 'two words'" output="screen">
      <env name="E" value="v"/>
    </node>
  </group>
  <node machine="far" pkg="programs" type="{other}" name="other" {more}/>
  <node pkg="programs" type="{here}" name="here"/>
</launch>
"""

PROGRAMS = {
    "tell": """\
#!/bin/sh
for word; do
  case $word in __name:=*) file=$HOME/${word#__name:=};; esac
done
{
  for word; do echo "arg $word"; done
  env
} > "$file.part"
mv "$file.part" "$file"
exec sleep 1000
""",
    "fails": "#!/bin/sh\necho the reason >&2\nexit 3\n",
    "ends": "#!/bin/sh\nexit 0\n",
    "waits": "#!/bin/sh\nexec sleep 1000\n",
    "lingers": """\
#!/bin/sh
trap 'while [ ! -e "$HOME/over" ]; do sleep 0.1; done; exit' INT
echo > "$HOME/trapped"
while :; do sleep 0.1; done
""",
}


@pytest.fixture
def sshd(tmp_path: Path) -> Iterator[SshServer]:
    if not Path(SSHD).exists() or shutil.which("ssh") is None:
        pytest.skip("openssh-server and openssh-client are needed")
    server = SshServer(tmp_path / "ssh")
    yield server
    server.close()


@pytest.fixture
def programs(ros: RosSystem) -> Path:
    folder = make_programs(ros.home / "programs", PROGRAMS)
    for side in (ros.pipros, ros.genuine):
        side.environment["ROS_PACKAGE_PATH"] = f"{folder}:/usr/share"
    return folder


def loader_of(side: Side, folder: Path) -> Path:
    """An env-loader with only the environment of one side, for programs started by ssh."""
    loader = folder / "loader"
    variables = "".join(
        f" '{name}={value}'" for name, value in side.environment.items() if name != "ROS_MASTER_URI"
    )
    loader.write_text(
        f'#!/bin/sh\nexec env -i{variables} "ROS_MASTER_URI=$ROS_MASTER_URI" "SSH_CLIENT=$SSH_CLIENT" "$@"\n'
    )
    loader.chmod(0o755)
    return loader


def launch_on_genuine(
    ros: RosSystem, sshd: SshServer, programs: Path, other: str = "waits", more: str = "", here: str = "tell"
) -> Process:
    """Genuine roslaunch as the parent, ours as its child. Genuine roslaunch treats the address 0 as another
    machine; it connects to this one."""
    file = programs / "x.launch"
    loader = loader_of(ros.pipros, programs)
    text = FILE.format(address="0", port=sshd.port, loader=loader, other=other, more=more, here=here)
    file.write_text(text)
    return ros.genuine.start("roslaunch", file, HOME=str(sshd.folder), ROSLAUNCH_SSH_UNKNOWN="1")


def end(ros: RosSystem, running: Process) -> None:
    """End a genuine roslaunch, and wait for the end of its child on the other machine."""
    running.press_ctrl_c()
    running.wait(60)
    ros.pipros.processes.assert_nothing_left(60)


def told(ros: RosSystem, node: str) -> list[str]:
    """Return the arguments and the environment of a node of the type `tell`."""
    return wait_until(lambda: (ros.home / node).exists() and (ros.home / node).read_text().splitlines())


def test_our_roslaunch_is_the_child_of_a_genuine_one(ros: RosSystem, sshd: SshServer, programs: Path) -> None:
    running = launch_on_genuine(ros, sshd, programs, here="lingers")
    running.wait_for(r"\[0-0\]: process\[g/there-1\]: started with pid \[\d+\]", 60)
    running.wait_for(r"\[0-0\]: \.\.\. done launching nodes", 60)
    lines = told(ros, "there")
    log = next(line for line in lines if line.startswith("arg __log:=")).removeprefix("arg __log:=")
    assert [line[4:] for line in lines if line.startswith("arg ")] == [
        "one", "two words", "a:=b", "__name:=there", f"__log:={log}",
    ]  # fmt: skip
    assert re.fullmatch(rf"{ros.home}/.ros/log/[-0-9a-f]+/g-there-1.log", log)
    assert {"E=v", "ROS_NAMESPACE=/g", f"ROS_MASTER_URI={ros.master_uri}"} <= set(lines)
    wait_until((sshd.folder / "trapped").exists, 60)
    running.send_signal(signal.SIGINT)
    running.wait_for(r"\[0-0\]: \[g/there-1\] killing on exit")
    (
        sshd.folder / "over"
    ).touch()  # until then, the parent waits for its own node, and prints what it is told
    assert running.wait(60) == 0
    ros.pipros.processes.assert_nothing_left(60)


def test_a_genuine_parent_is_notified_of_the_end_of_a_node(ros, sshd: SshServer, programs: Path) -> None:
    running = launch_on_genuine(ros, sshd, programs, "fails")
    running.wait_for(r"\[0-0\]: \[other-2\] process has died \[pid \d+, exit code 3, cmd ", 60)
    running.wait_for(r"^\[other-2\]   the reason")
    end(ros, running)


def test_the_child_of_a_genuine_parent_ends_with_a_required_node(ros, sshd, programs: Path) -> None:
    running = launch_on_genuine(ros, sshd, programs, "ends", 'required="true"')
    running.wait_for(r"\[0-0\]: =+REQUIRED process \[other-2\] has died!", 60)
    running.wait_for(r"\[0-0\]: \[g/there-1\] killing on exit")
    running.wait_for(r"\[0-0\] process has died")  # a genuine parent keeps running, as with a genuine child
    ros.pipros.processes.assert_nothing_left(60)


def test_a_genuine_parent_gets_the_nodes_that_cannot_be_started(ros, sshd: SshServer, programs: Path) -> None:
    running = launch_on_genuine(ros, sshd, programs, "nope")
    running.wait_for(r"\[0-0\]: ERROR: cannot launch node of type \[programs/nope\]", 60)
    running.wait_for(r"\[0-0\]: \.\.\. done launching nodes")
    end(ros, running)


def test_nothing_of_the_child_outlives_a_genuine_parent_that_is_killed(ros, sshd, programs: Path) -> None:
    running = launch_on_genuine(ros, sshd, programs)
    running.wait_for(r"\[0-0\]: \.\.\. done launching nodes", 60)
    running.kill()
    ros.pipros.processes.assert_nothing_left(60)
    for line in ros.genuine.processes.left():  # genuine ROS leaves a master running
        with suppress(ProcessLookupError):
            os.kill(int(line.partition(":")[0]), signal.SIGKILL)


@pytest.mark.parametrize("far", ["genuine", "pipros"])
def test_our_roslaunch_starts_nodes_over_a_real_ssh(ros, sshd, programs, bare_tools: Path, far: str) -> None:
    side = getattr(ros, far)
    tools = ros.home / "tools"
    tools.mkdir()
    sshd.client(tools, "robot.example")
    file = programs / "x.launch"
    loader = loader_of(side, programs)
    file.write_text(
        FILE.format(
            address="robot.example", port=sshd.port, loader=loader, other="fails", more="", here="tell"
        )
    )
    path = f"{tools}:{ros.pipros.environment['PATH']}"
    running = ros.pipros.start("roslaunch", file, PATH=path)
    running.wait_for(r"\[other-3\] process has died \[pid \d+, exit code 3, cmd ssh ", 60)
    lines = told(ros, "there")
    assert [line[4:] for line in lines if line.startswith("arg ")] == [
        "one", "two words", "a:=b", "__name:=there",
    ]  # fmt: skip
    assert {"E=v", "ROS_NAMESPACE=/g", f"ROS_MASTER_URI={ros.master_uri}"} <= set(lines)
    running.press_ctrl_c()
    assert running.wait(60) == 0
    side.processes.assert_nothing_left(60)
