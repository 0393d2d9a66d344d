"""Run the commands of the pages "How do I ...", beside a robot with the names that the pages use.

A block with a title is a file. A command must end with code 0, or show that it works (`GOES_ON`) and go on
until its page ends. A test that runs elsewhere, or a reason, is named for each of the few others
(`NOT_HERE`).
"""

import re
import runpy
import shutil
from pathlib import Path

import pytest
import yaml

import rosbag
from genpy import Time
from tests.support import documents
from tests.support.absent_plugins import DELETED
from tests.support.environments import EXAMPLES, REPOSITORY
from tests.support.ros import RosSystem
from tests.support.terminal import Terminal
from tests.support.waiting import wait_until
from tests.tutorial.blocks import BLOCK

TASKS = [name for name in documents.pages() if name.startswith("how/") and name != "how/index.md"]
MY_ROBOT = Path(__file__).parent / "my_robot"

GOES_ON: dict[str, str | None] = {
    "python count.py": None, "python watcher.py": r"torch.Size\(\[48, 64, 3\]\)",
    "roslaunch my_robot .*": "started with pid", "roslaunch pipros_sim .*": "started with pid",
    "pipros dataset --marker .*": None, "rosbag record .*": "Recording|Subscribing|Snapshot",
    "rosbag play .*": "RUNNING", "rosrun tf tf_echo .*": "At time", "rosrun tf tf_monitor": "Broadcasters",
    "rosrun tf2_ros static_transform_publisher .*": None, "rosrun topic_tools throttle .*": None,
    "rosrun teleop_twist_keyboard .*": "CTRL-C to quit", "rqt.*|rviz.*": r"http://\S+#token=",
}  # fmt: skip
"""Commands that go on, and what they print when they work: regular expressions. None: nothing, but a node."""

NOT_HERE = {
    r"(uv |conda )?.*pip install .*|uv venv .*|conda .*|sudo .*": "installs; script/fresh does it",
    r"deactivate|rm -r .*|pip uninstall .*": "removes; tutorial/test_installed_wheel.py",
    r"export ROS_(MASTER_URI|IP)=.*": "addresses of a robot",
    r"docker .*|  my_robot roslaunch .*": "needs Docker; interop/test_nat.py has such settings",
    r"ssh-copy-id .*|ssh .*|roslaunch my_robot two.launch": "two machines; graph/test_launch_run.py",
    r"py -m .*|\.venv\\Scripts.*|rosrun turtlesim .*|roscore": "on Windows; tests/windows",
    r"roslaunch rplidar_ros .*|rosrun (urg_node|usb_cam) .*": "devices; pipros-robot/tests simulate them",
    r"roslaunch turtlebot3.*|rosrun map_server .*|export ROS_PACKAGE_PATH=\$PWD/examples/turtlebot3:.*": (
        "pipros-robot/tests/graph/test_simulated_driving.py"
    ),
    r"pipros serve --bind .*|roslaunch rosbridge_server .*": "fixed ports; pipros-bridges: test_serve.py",
    r"(ROS_\w+=\w+ )?pipros ros2 .*": "multicast; pipros-ros2/tests/graph/test_ros2_command.py",
    r"rviz --bind .*": "a fixed port; pipros-page/tests/browser/test_access.py",
    r"openssl .*|rqt --read-only --bind .*": "a fixed port; pipros-page/tests/graph/test_page_tabs.py",
    r"pipros fleet (router|join|top).*": "a fixed port; pipros-fleet/tests/graph/test_fleet_history.py",
    r"python imu.py": "pandas; pipros-data/tests/unit/data/test_tables.py",
    r"pipros (install|wheel) .*|roslaunch my_robot bringup.launch": "installs; pipros-wheels: test_pip.py",
    r"cd ~/catkin_ws && catkin_make|source devel/setup.bash|rosrun my_robot driver": (
        "compiles; interop/test_mixed_packages.py"
    ),
}
"""Commands that this test does not run, and why, or where such commands run: regular expressions."""


@pytest.fixture
def robot(ros: RosSystem) -> RosSystem:
    """A home folder with the packages and bags that the pages name; the robot does not run."""
    source = ros.home / "catkin_ws" / "src"
    shutil.copytree(MY_ROBOT, source / "my_robot")
    shutil.copytree(EXAMPLES / "composiv_tryouts", source / "composiv_tryouts")
    (ros.home / "examples").symlink_to(REPOSITORY / "examples")
    shutil.copy(REPOSITORY / "examples" / "navigation" / "navigation.rviz", ros.home / "my_robot.rviz")
    (ros.home / "torch.py").write_text(  # PyTorch is hundreds of megabytes
        "def from_numpy(array):\n    return f'torch.Size({list(array.shape)})'\n"
        "class Shape(str):\n    shape = property(str)\n"
        "numpy_shape = from_numpy\n"
        "def from_numpy(array):\n    return Shape(numpy_shape(array))\n"
    )
    measured = runpy.run_path(str(MY_ROBOT / "scripts" / "driver.py"))["measured"]
    for name in ("run.bag", "run.bag.active", "morning.bag", "noon.bag"):
        with rosbag.Bag(str(ros.home / name), "w") as bag:
            for number in range(20):
                stamp = Time(1000 + number // 10, number % 10 * 100_000_000)
                for topic, message in measured(stamp, number).items():
                    bag.write(topic, message, stamp)
    ros.serve_master()
    return ros


@pytest.mark.timeout(400)
@pytest.mark.parametrize("name", TASKS)
def test_the_commands_of_a_task_work(robot: RosSystem, name: str) -> None:
    blocks = BLOCK.findall(documents.text_of(name))
    for _, title, content in blocks:
        if title:
            file = robot.home / title.removeprefix("~/")
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(content)
    blocks_of_commands = [commands(language, content) for language, _, content in blocks]
    if not any(blocks_of_commands):
        return
    going: list[Terminal] = []
    if name not in ("how/simulated-robot.md", "how/play-a-bag-in-a-loop.md"):
        going.append(typed(robot, "roslaunch my_robot bringup.launch", "process.*viewer.*started with pid"))
        robot.wait_for_links("/scan")
    for lines in blocks_of_commands:
        recorders: list[Terminal] = []
        terminal = opened(robot) if lines else None
        for line in lines:
            goes_on = [output for each, output in GOES_ON.items() if re.fullmatch(each, line)]
            if goes_on:
                one = typed(robot, line, goes_on[0])
                (recorders if line.startswith("rosbag record") else going).append(one)
            elif terminal is not None:
                code, text = terminal.run(line, 90)
                assert code == 0, f"{line}\n{text}"
        end(recorders)
    end(going)


def test_the_tests_that_run_elsewhere_exist() -> None:
    named = {name for reason in NOT_HERE.values() for name in re.findall(r"test_\w+\.py", reason)}
    assert len(named) > 8
    assert [name for name in named if not DELETED and not any(REPOSITORY.glob(f"p*/*/tests/**/{name}"))] == []


def commands(language: str, content: str) -> list[str]:
    """Return the commands of a block that can run here. Those of a workflow install, except the last."""
    if language == "yaml" and "jobs" in (read := yaml.safe_load(content)):
        last = read["jobs"]["test"]["steps"][-1]["run"]
        return ["cd ~/catkin_ws", last.replace("results.xml", "/dev/null")]
    lines = content.splitlines() if language == "sh" else []
    return [line for line in lines if not any(re.fullmatch(pattern, line) for pattern in NOT_HERE)]


def opened(robot: RosSystem) -> Terminal:
    terminal = robot.pipros.open_terminal()
    terminal.run("export ROS_PACKAGE_PATH=$HOME/catkin_ws/src")
    return terminal


def typed(robot: RosSystem, line: str, output: str | None) -> Terminal:
    """Type a command that goes on, and wait until it prints what shows that it works, or is a node."""
    terminal = opened(robot)
    before = robot.publishers("/rosout")
    terminal.type(line)
    if output is None:
        wait_until(lambda: set(robot.publishers("/rosout")) - set(before), 90)
    else:
        terminal.wait_for(output, 90)
    return terminal


def end(terminals: list[Terminal]) -> None:
    for terminal in reversed(terminals):
        terminal.press_ctrl_c()
        assert terminal.wait_for_prompt() in (0, 130), terminal.text
