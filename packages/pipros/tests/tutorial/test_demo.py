"""script/demo runs the case study live with one command."""

import re
import socket

import pytest

from tests.support.environments import REPOSITORY
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until
from tests.tutorial.words import CORE_IS_UP, HEARD, SAID

DEMO = str(REPOSITORY / "script" / "demo")


def test_it_shows_both_nodes_and_ends_by_itself(ros: RosSystem) -> None:
    demo = ros.pipros.run(DEMO, "--seconds", "20", timeout_s=90)

    assert demo.returncode == 0, demo.output
    assert re.search(SAID, demo.output)
    assert re.search(HEARD, demo.output)
    assert re.search(r"rqt_graph: http://localhost:\d+/", demo.output)
    assert "Traceback" not in demo.output


def test_the_first_line_says_how_to_inspect_the_demo(ros: RosSystem) -> None:
    demo, second = ros.pipros.open_terminal(), ros.pipros.open_terminal()
    demo.type(DEMO)
    demo.wait_for(HEARD)

    line = demo.output.splitlines()[0]
    assert line == (
        "A talker publishes a battery level and a listener shows it; Ctrl-C ends both. To look from a second "
        f"terminal, in {REPOSITORY}: . .venv/bin/activate && export ROS_MASTER_URI={ros.master_uri} && "
        "rostopic echo /battery_topic"
    )
    second.run(f"unset ROS_MASTER_URI ROS_PACKAGE_PATH; cd {REPOSITORY}")
    second.type(line.rpartition(": ")[2])
    second.wait_for(r'battery: "%25"\n---\n')
    second.press_ctrl_c()
    assert second.wait_for_prompt() == 0


def test_ctrl_c_ends_it_with_nothing_left(ros: RosSystem) -> None:
    demo = ros.pipros.open_terminal()
    demo.type(DEMO)
    demo.wait_for(HEARD)

    demo.press_ctrl_c()

    assert demo.wait_for_prompt() == 0
    assert "Traceback" not in demo.output
    demo.close()
    ros.pipros.processes.assert_nothing_left()


def test_ctrl_c_during_the_start_ends_it(ros: RosSystem) -> None:
    demo = ros.pipros.open_terminal()
    demo.type(DEMO)
    demo.wait_for("A talker publishes")

    demo.press_ctrl_c()

    demo.wait_for_prompt()
    demo.close()
    ros.pipros.processes.assert_nothing_left()


def test_a_running_master_is_used_and_left_running(ros: RosSystem) -> None:
    core, look = ros.pipros.open_terminal(), ros.pipros.open_terminal()
    core.type("roscore")
    core.wait_for(CORE_IS_UP)
    ros.wait_for_publisher("/rosout_agg")

    demo = ros.pipros.start(DEMO)
    demo.wait_for(HEARD)
    demo.press_ctrl_c(code=0)
    assert (
        f"A ROS master already runs at {ros.master_uri}: the demo joins it, and leaves it running."
        in demo.stdout
    )
    wait_until(lambda: look.run("rosnode list") == (0, "/rosout\n"), what=lambda: look.output)


@pytest.mark.parametrize("answer", [b"", b"HTTP/1.1 404 Not Found\r\ncontent-length: 0\r\n\r\n"])
def test_a_port_that_another_program_uses_is_named_with_a_way_out(ros: RosSystem, answer: bytes) -> None:
    with socket.create_server(("127.0.0.1", ros.port)) as other:
        demo = ros.pipros.start(DEMO)
        for _ in range(2):  # one connection to check that the port is open, one to identify the program
            with other.accept()[0] as connection:
                connection.sendall(answer)
        assert demo.wait() == 1

    assert demo.output.splitlines()[-1] == (
        f"script/demo: port {ros.port} is in use by a program that is not a ROS master. End that program, or "
        f"take another port: ROS_MASTER_URI=http://localhost:{ros.port + 1} script/demo"
    )


def test_an_invalid_master_uri_is_refused(ros: RosSystem) -> None:
    demo = ros.pipros.run(DEMO, ROS_MASTER_URI="localhost:11311")

    demo.check(1, "ROS_MASTER_URI [localhost:11311] must have the form http://HOST:PORT")
