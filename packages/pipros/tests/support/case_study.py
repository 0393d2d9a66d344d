"""Carry out sections 4.1 to 4.5 of the case study in a terminal. They create the workspace in `examples/`.

Files that the reader writes in an editor are copied from the example. Generated files are edited; afterwards,
they must have the lines that the document's figures show.
"""

import re
from pathlib import Path

from tests.support.environments import EXAMPLES
from tests.support.terminal import Terminal

WORKSPACE = "feature/buse_nur_emir_07042023/catkin_ws"
SOURCE = f"source ~/{WORKSPACE}/devel/setup.bash"

FIGURE_3 = {
    10: "find_package(catkin REQUIRED COMPONENTS", 11: "  roscpp", 12: "  rospy", 13: "  message_generation",
    14: ")", 50: "add_message_files(FILES BatteryLevel.msg)", 71: "generate_messages()",
    105: "catkin_package(CATKIN_DEPENDS message_runtime",
}  # fmt: skip
FIGURE_4 = {
    51: "  <buildtool_depend>catkin</buildtool_depend>", 52: "  <build_depend>roscpp</build_depend>",
    53: "  <build_depend>rospy</build_depend>", 54: "  <build_depend>message_generation</build_depend>",
    55: "  <build_export_depend>roscpp</build_export_depend>",
    56: "  <build_export_depend>rospy</build_export_depend>", 57: "  <exec_depend>roscpp</exec_depend>",
    58: "  <exec_depend>rospy</exec_depend>", 59: "  <exec_depend>message_runtime</exec_depend>",
}  # fmt: skip
"""Lines of the edited files, by line number in the figure."""


def make_workspace_and_package(terminal: Terminal) -> None:
    """Carry out section 4.1, with the commands of figure 2."""
    for line in (
        "mkdir feature",
        "cd feature",
        "mkdir buse_nur_emir_07042023",
        "cd buse_nur_emir_07042023",
        "mkdir catkin_ws",
        "cd catkin_ws",
        "mkdir src",
        "catkin_make",
        SOURCE,
        "cd src",
    ):
        _do(terminal, line)
    assert _do(terminal, "ls ..").split() == ["build", "devel", "src"]
    _do(terminal, "catkin_create_pkg composiv_tryouts rospy roscpp")
    assert _do(terminal, "ls composiv_tryouts").split() == ["CMakeLists.txt", "include", "package.xml", "src"]
    _do(terminal, "cd ..")
    _do(terminal, "catkin_make")


def create_message(terminal: Terminal, package: Path) -> None:
    """Carry out section 4.2, with the edits of figures 3 and 4."""
    _do(terminal, f"cd ~/{WORKSPACE}/src/composiv_tryouts")
    _do(terminal, "mkdir msg")
    _do(terminal, "echo 'string battery' > msg/BatteryLevel.msg")
    edit(
        package / "CMakeLists.txt",
        [
            ("  rospy\n)", "  rospy\n  message_generation\n)"),
            ("# add_message_files(", "add_message_files(FILES BatteryLevel.msg)"),
            ("# generate_messages(", "generate_messages()"),
            ("catkin_package(\n", "catkin_package(CATKIN_DEPENDS message_runtime\n"),
        ],
        FIGURE_3,
    )
    build, run = "<build_depend>{}</build_depend>\n", "<exec_depend>{}</exec_depend>\n"
    added = [(build, "message_generation"), (run, "message_runtime")]
    edit(
        package / "package.xml",
        [
            (f"  {kind.format('rospy')}", f"  {kind.format('rospy')}  {kind.format(name)}")
            for kind, name in added
        ],
        FIGURE_4,
    )
    _do(terminal, f"cd ~/{WORKSPACE}")
    assert "composiv_tryouts: 1 messages, 0 services" in _do(terminal, "catkin_make")
    _do(terminal, SOURCE)


def write_nodes_test_and_launch_file(terminal: Terminal, package: Path) -> None:
    """Create the files of sections 4.3, 4.4 and 4.5, and build the workspace."""
    _do(terminal, f"cd ~/{WORKSPACE}/src/composiv_tryouts")
    for folder, files in {
        "scripts": ("composiv_talker.py", "composiv_listener.py"),
        "test": ("test_talker.py",),
        "launch": ("composiv_tryout.launch",),
    }.items():
        _do(terminal, f"mkdir {folder}")
        for file in files:
            (package / folder / file).write_text((EXAMPLES / "composiv_tryouts" / folder / file).read_text())
    _do(terminal, "cd scripts")
    _do(terminal, "chmod +x composiv_talker.py")
    _do(terminal, "chmod +x composiv_listener.py")
    _do(terminal, "cd ../test")
    _do(terminal, "chmod +x test_talker.py")
    _do(terminal, f"cd ~/{WORKSPACE}")
    _do(terminal, "catkin_make")


def look_at_the_graph(look: Terminal) -> None:
    """See the nodes and the topic of figure 1, while talker and listener run."""
    assert look.run("rosnode list") == (0, "/listener_node\n/rosout\n/talker_node\n")
    assert look.run("rostopic list") == (0, "/battery_topic\n/rosout\n/rosout_agg\n")
    code, info = look.run("rostopic info /battery_topic")
    assert code == 0
    assert re.fullmatch(
        r"Type: composiv_tryouts/BatteryLevel\n\nPublishers: \n \* /talker_node \(http://[^ ]+:\d+/\)\n\n"
        r"Subscribers: \n \* /listener_node \(http://[^ ]+:\d+/\)\n\n\n?",
        info,
    ), info
    assert look.run("rostopic echo -n 1 /battery_topic") == (0, 'battery: "%25"\n---\n')
    code, params = look.run("rosparam list")
    assert re.fullmatch(r"/rosdistro\n/roslaunch/uris/host_\w+\n/rosversion\n/run_id\n", params), params


def edit(file: Path, changes: list[tuple[str, str]], figure: dict[int, str]) -> None:
    """Replace texts in a generated file, each of which must occur once. The result must match the figure."""
    text = file.read_text()
    for before, after in changes:
        assert text.count(before) == 1, f"{before!r} stands {text.count(before)} times in {file}:\n{text}"
        text = text.replace(before, after)
    file.write_text(text)
    lines = text.splitlines()
    assert {number: lines[number - 1] for number in figure} == figure


def _do(terminal: Terminal, line: str) -> str:
    code, output = terminal.run(line)
    assert code == 0, f"{line} ended with {code}:\n{output}"
    return output
