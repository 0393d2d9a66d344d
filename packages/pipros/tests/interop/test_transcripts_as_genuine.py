"""roscore, roslaunch and rostest on a terminal, from start to Ctrl-C: the same screen as with genuine ROS."""

import difflib
import itertools
import re
from collections.abc import Callable, Iterator, Sequence

import pytest

import pipros
from pipros_tools.launch.roscore import ROS_COMM_VERSION
from tests.support.ros import RosSystem, Side
from tests.support.terminal import Terminal
from tests.support.waiting import wait_until

# Text that varies between runs, and lines that each side prints about itself.
OPEN = (
    # on a terminal, pipros prefixes each line with its node
    (r"(?m)^\x1b\[\d+m\[\w+-\d+\]\x1b\[0m ", ""),
    (r"\[\d{10}\.\d{6}\]", "[TIME]"),
    (r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}", "RUN_ID"),
    (r"pid \[\d+\]", "pid [PID]"),
    (r"-\d+\.log", "-PID.log"),
    (r"roslaunch server http://[^/]+/", "roslaunch server URI"),
    (r"ROS_MASTER_URI=http://\S+?(?=\x1b)", "ROS_MASTER_URI=URI"),
    (r"http://\S+:\d+/?", "URI"),
    (r"/rosdistro: \w+", "/rosdistro: NAME"),
    # Only pipros prints whether the master is open to the network.
    (r"(?m)^master listens on .*\n", ""),
    (r"\^C", ""),
    (r"/\S+/catkin_ws/src/", "WORKSPACE/"),
    # Genuine roslaunch prints this from one thread for each node, and lines are mixed.
    (r"killing on exit(?=\[)", "killing on exit\n"),
    (r"(?m)(?<=killing on exit\n)\n", ""),
    # genuine nodes race for the link to the newest log folder, and log a lost race
    (r"(?m)^INFO: cannot create a symlink.*\n", ""),
    # Lines of nodes appear at any time between those of the launcher.
    (r"(?m)^(\x1b\[\d+m)?\[(INFO|WARN)\].*\n(\x1b\[0m)?", ""),
    (r"(?m)^.*SyntaxWarning.*\n  pub = .*\n", ""),
)

_NODE_ENDS = re.compile(r"\[\w+-(\d+)\] killing on exit")


def screen(
    side: Side, command: str, is_up: Callable[[], object] | None = None, last_line: str = ""
) -> tuple[int, list[str]]:
    """Return exit code and screen of a command that exits, or that Ctrl-C ends once it is ready.

    `last_line` is a pattern for the last line before Ctrl-C.
    """
    terminal = side.open_terminal()
    terminal.type(command)
    if is_up:
        terminal.wait_for(last_line)
        wait_until(is_up, 60, what=lambda: f"{command} to be up: {terminal.output}")
        terminal.press_ctrl_c()
    return shown(terminal)


def screens(side: Side, commands: Sequence[str]) -> list[tuple[int, list[str]]]:
    """Like `screen`, for several commands that exit."""
    terminal = side.open_terminal()
    found = []
    for command in commands:
        terminal.type(command)
        code, lines = shown(terminal)
        found.append((code, [f"$ {command}", *lines]))
    return found


def shown(terminal: Terminal) -> tuple[int, list[str]]:
    """Return exit code and output of the last command, without text that varies between runs."""
    code = terminal.wait_for_prompt(120)
    text = terminal.output.removesuffix(f"[{code}]> ")
    for pattern, name in OPEN:
        text = re.sub(pattern, name, text)
    return code, list(_in_order(text.splitlines()))


def _in_order(lines: Sequence[str]) -> Iterator[str]:
    """The lines; nodes that genuine roslaunch ends in one thread each are sorted by number, last first."""
    for is_end, group in itertools.groupby(lines, lambda line: bool(_NODE_ENDS.fullmatch(line))):
        found = list(group)
        if is_end:
            found.sort(key=lambda line: int(_NODE_ENDS.sub(r"\1", line)), reverse=True)
        yield from found


def assert_same(ours: tuple[int, list[str]], theirs: tuple[int, list[str]]) -> None:
    """Compare both screens, without pipros's version, which stands below that of ros_comm."""
    ours = ours[0], [line for line in ours[1] if line != f"pipros version {pipros.__version__}"]
    difference = "\n".join(difflib.ndiff(theirs[1], ours[1]))
    assert ours == theirs, f"- genuine, + pipros:\n{difference}"


def both_nodes_are_up(ros: RosSystem) -> bool:
    return bool(ros.publishers("/battery_topic") and ros.subscribers("/battery_topic"))


def test_roscore(ros: RosSystem) -> None:
    command = f"roscore -p {ros.port}"

    def is_up() -> object:
        return ros.publishers("/rosout_agg")

    ours, theirs = (
        screen(side, command, is_up, r"started core service \[/rosout\]")
        for side in (ros.pipros, ros.genuine)
    )
    own = f"pipros version {pipros.__version__}"  # below that of ros_comm
    assert ours[1].pop(ours[1].index(f"ros_comm version {ROS_COMM_VERSION}") + 1) == own
    assert_same(ours, theirs)


@pytest.mark.parametrize("options", ["", "--screen"])
@pytest.mark.parametrize("has_master", [False, True], ids=["with a master of its own", "with one that runs"])
def test_roslaunch(ros: RosSystem, options: str, has_master: bool) -> None:
    command = f"roslaunch {options} composiv_tryouts composiv_tryout.launch"
    if has_master:
        ros.genuine.start_bare_master()

    def is_up() -> object:
        return both_nodes_are_up(ros) and (has_master or ros.publishers("/rosout_agg"))

    last_line = r"process\[listener-\d\]: started with pid"
    ours, theirs = (screen(side, command, is_up, last_line) for side in (ros.pipros, ros.genuine))
    assert_same(ours, theirs)


def test_rostest(ros: RosSystem) -> None:
    command = "rostest composiv_tryouts composiv_tryout.launch"

    assert_same(screen(ros.pipros, command), screen(ros.genuine, command))


MISTAKES = (
    "roscore -p {port}", "rosrun composiv_tryouts nope.py", "rosrun nope composiv_talker.py", "rosrun",
    "rosrun composiv_tryouts", "roslaunch composiv_tryouts nope.launch", "roslaunch nope nope.launch",
    "roslaunch nope.launch", "rostest composiv_tryouts nope.launch", "rostest", "rostopic info /nope",
    "rosnode info /nope", "rosparam get /nope",
)  # fmt: skip


def test_mistakes(ros: RosSystem) -> None:
    """All in one terminal of each side, because starting a master takes longer than a command."""
    ros.genuine.start_bare_master()
    ours, theirs = (
        screens(side, [command.format(port=ros.port) for command in MISTAKES])
        for side in (ros.pipros, ros.genuine)
    )
    for our_screen, their_screen in zip(ours, theirs, strict=True):
        assert_same(our_screen, their_screen)
