"""Section 4.3.3 of the case study: roscore and two nodes, each in its own terminal."""

from tests.support.case_study import look_at_the_graph
from tests.support.environments import EXAMPLES
from tests.support.ros import RosSystem
from tests.support.terminal import Terminal
from tests.tutorial.words import HEARD, LISTENER, SAID, TALKER


def test_the_outputs_show_that_both_nodes_work_fine(ros: RosSystem, core: Terminal) -> None:
    talker, listener = ros.pipros.open_terminal(), ros.pipros.open_terminal()

    talker.type(TALKER)
    talker.wait_for(rf"{SAID}\n{SAID}\n")
    listener.type(LISTENER)
    listener.wait_for(rf"{HEARD}\n{HEARD}\n")

    for terminal in (listener, talker, core):
        terminal.press_ctrl_c()
        assert terminal.wait_for_prompt() == 0
        assert "Traceback" not in terminal.output


def test_the_warning_about_a_missing_queue_size_names_the_line(ros: RosSystem, core: Terminal) -> None:
    talker = ros.pipros.open_terminal()

    talker.type(TALKER)
    talker.wait_for(SAID)

    script = EXAMPLES / "composiv_tryouts/scripts/composiv_talker.py"
    assert talker.output.startswith(
        f"{script}:8: SyntaxWarning: The publisher should be created with an explicit keyword argument "
        "'queue_size'. Please see http://wiki.ros.org/rospy/Overview/Publishers%20and%20Subscribers for more "
        'information.\n  pub = rospy.Publisher("battery_topic", BatteryLevel)\n'
    )


def test_a_fourth_terminal_shows_the_graph_of_figure_1(ros: RosSystem, core: Terminal) -> None:
    for command, line in ((TALKER, SAID), (LISTENER, HEARD)):
        node = ros.pipros.open_terminal()
        node.type(command)
        node.wait_for(line)
    look_at_the_graph(ros.pipros.open_terminal())


def test_a_second_talker_replaces_the_first(ros: RosSystem, core: Terminal) -> None:
    first, second = ros.pipros.open_terminal(), ros.pipros.open_terminal()
    first.type(TALKER)
    first.wait_for(SAID)

    second.type(TALKER)

    assert first.wait_for_prompt() == 0
    assert "shutdown request: [/talker_node] Reason: new node registered with same name" in first.output
    second.wait_for(SAID)


def test_the_command_line_renames_and_remaps_nodes(ros: RosSystem, core: Terminal) -> None:
    talker = ros.pipros.open_terminal()

    talker.type(f"{TALKER} __name:=loud __ns:=/robot battery_topic:=level")
    talker.wait_for(SAID)

    look = ros.pipros.open_terminal()
    assert look.run("rosnode list") == (0, "/robot/loud\n/rosout\n")
    assert look.run("rostopic list") == (0, "/robot/level\n/rosout\n/rosout_agg\n")
