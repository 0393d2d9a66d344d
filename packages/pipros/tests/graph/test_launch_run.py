"""roslaunch and roscore: processes, Ctrl-C, SIGKILL, respawn, required, terminals, other machines."""

import os
import re
import signal
import socket
import threading
from contextlib import closing
from pathlib import Path
from typing import Any
from xmlrpc.client import ServerProxy

import pytest

import pipros
from pipros.basics.env import Environment
from pipros.master.master import Master
from pipros.master.options import MasterOptions
from pipros.net.master_client import MasterClient
from pipros_tools.launch.console import Console
from pipros_tools.launch.session_master import SessionMaster
from tests.support.processes import Process
from tests.support.programs import make_programs
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

# roslaunch and roscore on the command line: processes, Ctrl-C, SIGKILL, respawn, required.


PROGRAMS = {
    "sleeper": "#!/bin/sh\necho ready $$\nexec sleep 1000\n",
    "stubborn": "#!/bin/sh\ntrap '' INT TERM\necho ready $$\nwhile :; do sleep 0.05; done\n",
    "with_child": "#!/bin/sh\nsleep 1000 &\necho ready $!\nwait\n",
    "leaves_child": "#!/bin/sh\nsleep 1000 &\necho ready $!\n",
    "escapes": "#!/usr/bin/env python3\nimport os, time\nif os.fork() == 0:\n  os.setsid()\n"
    "  print('ready', os.getpid(), flush=True)\n  time.sleep(1000)\nos.wait()\n",
    "fails": "#!/bin/sh\necho first\necho the reason\nexit 3\n",
    "ends": "#!/bin/sh\nexit 0\n",
    "without_interpreter": "#!/nope\n",
    "from_windows": "#!/usr/bin/env python3\r\n",
    "fails_once": '#!/bin/sh\n[ -e "$1" ] && { echo ready again; exec sleep 1000; }\ntouch "$1"\nexit 1\n',
    "printenv": '#!/bin/sh\nenv\npwd\nfor word; do echo "arg $word"; done\n',
}


@pytest.fixture
def package(ros: RosSystem) -> Path:
    """The folder of a package `programs` with the scripts above."""
    return make_programs(ros.home / "src" / "programs", PROGRAMS)


def launch(ros: RosSystem, package: Path, content: str, *options: str, **more: str) -> Process:
    file = package / "x.launch"
    file.write_text(f"<launch>{content}</launch>")
    return ros.pipros.start("roslaunch", *options, file, ROS_PACKAGE_PATH=str(package.parent), **more)


def node(type_name: str, name: str = "n", **attributes: str) -> str:
    more = "".join(f' {key}="{value}"' for key, value in attributes.items())
    return f'<node pkg="programs" type="{type_name}" name="{name}" output="screen"{more}/>'


def is_running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def printed_pids(running: Process, count: int = 1) -> list[int]:
    """Return the process ids that this number of nodes print."""
    wait_until(lambda: running.output.count("ready ") == count)
    return [int(pid) for pid in re.findall(r"ready (\d+)", running.output)]


def param(ros: RosSystem, key: str) -> Any:
    with ServerProxy(ros.master_uri) as master:
        code, _, value = master.getParam("/test", key)  # type: ignore[misc]
    return value if code == 1 else None


def test_ctrl_c_ends_every_node_and_roslaunch_with_status_0(ros: RosSystem, package: Path) -> None:
    running = launch(ros, package, node("sleeper", "a") + node("with_child", "b"))
    running.wait_for(r"process\[b-3\]: started")
    pids = printed_pids(running, 2)
    running.press_ctrl_c(code=0)
    wait_until(lambda: not any(map(is_running, pids)))
    end = running.stdout[running.stdout.index("[b-3] killing on exit") :]
    assert end == [
        "[b-3] killing on exit", "[a-2] killing on exit", "[rosout-1] killing on exit",
        "[master] killing on exit", "shutting down processing monitor...",
        "... shutting down processing monitor complete", "\033[1mdone\033[0m",
    ]  # fmt: skip


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_other_signals_end_it_in_order_too(ros: RosSystem, package: Path, number: int) -> None:
    running = launch(ros, package, node("sleeper"))
    (pid,) = printed_pids(running)
    running.send_signal(number, code=0)
    assert not is_running(pid)


@pytest.mark.parametrize(
    ("nodes", "count"), [(node("stubborn", "a") + node("with_child", "b"), 2), (node("escapes"), 1)],
    ids=["nodes", "a process outside its group"],
)  # fmt: skip
def test_no_process_outlives_a_roslaunch_that_is_killed(ros, package: Path, nodes: str, count: int) -> None:
    running = launch(ros, package, nodes)
    pids = printed_pids(running, count)
    running.kill()
    wait_until(lambda: not any(map(is_running, pids)))


def test_a_node_that_ignores_signals_is_killed_after_the_timeouts(ros: RosSystem, package: Path) -> None:
    running = launch(ros, package, node("stubborn"), "--sigint-timeout=0.2", "--sigterm-timeout=0.2")
    running.wait_for("ready")
    running.press_ctrl_c(code=0)
    for name in ("SIGTERM", "SIGKILL"):
        assert f"\033[31m[n-2] escalating to {name}\033[0m" in running.stderr
    assert any("required SIGKILL" in line for line in running.stderr)


def test_a_second_ctrl_c_ends_the_wait(ros: RosSystem, package: Path) -> None:
    running = launch(ros, package, node("stubborn"), "--sigint-timeout=1000", "--sigterm-timeout=1000")
    running.wait_for("ready")
    for expected in ("killing on exit", "escalating to SIGTERM", "escalating to SIGKILL"):
        running.press_ctrl_c()
        running.wait_for(expected)
    assert running.wait() == 0


def test_a_dead_node_is_reported_with_its_last_lines_and_others_stay(ros: RosSystem, package: Path) -> None:
    failing = node("fails", "bad").replace('output="screen"', "")
    running = launch(ros, package, failing + node("sleeper", "good"))
    running.wait_for(r"\[bad-2\] process has died \[pid \d+, exit code 3, cmd .*/fails __name:=bad __log:=")
    running.wait_for(r"\[bad-2\]   the reason")
    running.wait_for("ready")
    assert running.is_running


def test_the_end_of_a_required_node_ends_all_with_status_0(ros: RosSystem, package: Path) -> None:
    running = launch(ros, package, node("sleeper", "a") + node("ends", "b", required="true"))
    running.check(0, "REQUIRED process [b-3] has died!")
    assert "[a-2] killing on exit" in running.stdout


def test_a_respawning_node_is_restarted(ros: RosSystem, package: Path) -> None:
    mark = ros.home / "mark"
    running = launch(ros, package, node("fails_once", args=str(mark), respawn="true", respawn_delay="0.1"))
    running.wait_for(r"\[n-2\] restarting process")
    running.wait_for("ready again")


def test_roslaunch_ends_with_its_nodes_when_the_master_is_not_its_own(ros: RosSystem, package: Path) -> None:
    ros.serve_master()
    running = launch(ros, package, node("ends"))
    running.check(0, "all processes on machine have died, roslaunch will exit")
    assert not any("auto-starting" in line for line in running.stdout)


def test_background_processes_of_a_script_are_ended(ros: RosSystem, package: Path) -> None:
    running = launch(ros, package, node("leaves_child"))
    pid = int(running.wait_for(r"ready (\d+)")[1])
    running.wait_for("process has finished cleanly")
    assert is_running(pid)
    running.press_ctrl_c(code=0)
    wait_until(lambda: not is_running(pid))


def test_a_node_gets_the_arguments_and_variables_of_noetic(ros: RosSystem, package: Path) -> None:
    content = (
        '<env name="OUTER" value="1"/><remap from="a" to="b"/><group ns="g">'
        + node("printenv", args="one 'two three'", cwd="node").replace(
            "/>", '><remap from="c" to="/d"/><env name="INNER" value="2"/></node>'
        )
        + "</group>"
    )
    running = launch(ros, package, content)
    running.wait_for("process has finished cleanly")
    run_id = param(ros, "/run_id")
    log = f"{ros.pipros.environment['ROS_HOME']}/log/{run_id}/g-n-2.log"
    words = [line[4:] for line in running.stdout if line.startswith("arg ")]
    assert words == ["one", "two three", "a:=b", "c:=/d", "__name:=n", f"__log:={log}"]
    for line in ("OUTER=1", "INNER=2", "ROS_NAMESPACE=/g", f"ROS_MASTER_URI={ros.master_uri}", str(package)):
        assert line in running.stdout


def test_parameters_are_set_before_the_first_node_starts(ros: RosSystem, package: Path) -> None:
    content = '<param name="p" value="7"/><group ns="g"><rosparam>{a: {b: [1, x]}}</rosparam></group>'
    running = launch(ros, package, content + node("sleeper"))
    running.wait_for("ready")
    assert (param(ros, "/p"), param(ros, "/g")) == (7, {"a": {"b": [1, "x"]}})
    assert param(ros, "/rosdistro") == "noetic\n"
    assert any("host_127_0_0_1__" in key for key in param(ros, "/roslaunch/uris"))


def test_the_standard_output_is_written_to_a_log_file_without_screen(ros: RosSystem, package: Path) -> None:
    running = launch(ros, package, node("fails").replace('output="screen"', ""))
    running.wait_for("process has died")
    log = Path(ros.pipros.environment["ROS_HOME"]) / "log" / "latest" / "n-2-stdout.log"
    assert log.read_text() == "first\nthe reason\n"
    assert "first" not in running.stdout


@pytest.mark.parametrize(("program", "error"), [
    ("nope", r"cannot launch node of type \[programs/nope\]: Cannot locate node of type"),
    ("from_windows", "Unable to launch .*has Windows line endings"),
])  # fmt: skip
def test_a_program_that_is_missing_or_wrong_does_not_stop_others(ros, package, program, error: str) -> None:
    running = launch(ros, package, node(program, "a") + node("sleeper", "b"))
    running.wait_for(f"ERROR: {error}")
    running.wait_for("ready")


@pytest.mark.parametrize(
    ("program", "reason"),
    [
        (node("sleeper", "b").replace("/>", ' launch-prefix="nope"/>'), "nope: No such file or directory"),
        (node("without_interpreter", "b"), "needs the interpreter /nope, which does not exist"),
    ],
)
def test_programs_that_cannot_start_end_all(ros: RosSystem, package: Path, program: str, reason: str) -> None:
    running = launch(ros, package, node("sleeper", "a") + program)
    running.check(1, "RLException: Unable to launch [", reason)
    assert "[a-2] killing on exit" in running.stdout


def test_a_launch_without_nodes_ends_at_once_on_the_master_of_others(ros: RosSystem, package: Path) -> None:
    ros.serve_master()
    running = launch(ros, package, "")
    running.check(0, "\033[1mNo processes to monitor\033[0m")


def test_verbose_prints_the_files_parameters_and_nodes(ros: RosSystem, package: Path) -> None:
    ros.serve_master()
    running = launch(ros, package, '<param name="p" value="1"/>' + node("ends"), "-v", "--wait", "--local")
    running.check(
        0, "master has started, initiating launch", f"... loading XML file [{package}/x.launch]",
        "Added parameter [/p]", "Added node of type [programs/ends] in namespace [/]",
        "local only launch specified, will not launch remote nodes",
    )  # fmt: skip


def test_fifty_nodes_are_started_and_ended(ros: RosSystem, package: Path) -> None:
    running = launch(ros, package, "".join(node("sleeper", f"n{i}") for i in range(50)))
    pids = printed_pids(running, 50)
    running.press_ctrl_c()
    assert running.wait(timeout_s=60) == 0, running.stderr
    assert not any(map(is_running, pids))


def test_an_invalid_file_prevents_the_launch_and_is_named_with_a_line(ros: RosSystem, package: Path) -> None:
    running = launch(ros, package, '\n  <node pkg="" type="t" name="n"/>\n')
    running.check(
        1, "RLException: Invalid <node> tag: package must be non-empty.",
        f"in {package}/x.launch:2:3: <node pkg=",
    )  # fmt: skip
    assert "auto-starting" not in running.output


@pytest.mark.parametrize(
    "uri", ["http://localhost", "http://localhost:x", "localhost:11311", "ftp://localhost:1"]
)
def test_an_invalid_master_uri_is_refused(ros: RosSystem, package: Path, uri: str) -> None:
    running = launch(ros, package, node("sleeper"), ROS_MASTER_URI=uri)
    running.check(1, f"ROS_MASTER_URI [{uri}]")


def test_a_port_with_another_program_on_it_is_explained(ros: RosSystem, package: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        threading.Thread(target=answer_like_a_web_server, args=(server,), daemon=True).start()
        port = server.getsockname()[1]
        running = launch(ros, package, node("sleeper"), ROS_MASTER_URI=f"http://127.0.0.1:{port}")
        assert running.wait() == 1
    assert "is not a ROS master" in running.output


def answer_like_a_web_server(server: socket.socket) -> None:
    connection, _ = server.accept()
    with connection:
        connection.recv(65536)
        connection.sendall(b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n")


def test_a_second_roscore_on_the_port_is_refused(ros: RosSystem) -> None:
    ros.pipros.start_master()
    second = ros.pipros.run("roscore", "-p", str(ros.port))
    assert second.returncode == 1
    assert second.stderr == [
        "\033[31mRLException: roscore cannot run as another roscore/master is already running. ",
        "Please kill other roscore/master processes before relaunching.",
        f"The ROS_MASTER_URI is {ros.master_uri}/\033[0m",
        "\033[31mThe traceback for the exception was written to the log file\033[0m",
    ]


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--bind", "192.0.2.1"], "--bind must be an address of this computer"),
        (["--allow", "nonsense"], "an allowed network must be like 10.0.0.0/8 or 10.0.0.7, got [nonsense]"),
    ],
)
def test_roscore_names_a_bad_address_in_one_line(words: list[str], complaint: str, ros: RosSystem) -> None:
    ended = ros.pipros.run("roscore", "-p", str(ros.port), *words)
    assert ended.returncode == 1
    assert len(ended.stderr) == 2, ended.output
    assert ended.stderr[0].startswith("\033[31mRLException: cannot start a master")
    assert complaint in ended.stderr[0]
    assert "Another program" not in ended.stderr[0]


def test_roscore_prints_noetics_lines_and_the_allowed_networks(ros: RosSystem) -> None:
    core = ros.pipros.start_master()
    pid = core.pid
    core.press_ctrl_c(code=0)
    run_id = re.search(r"setting /run_id to (\S+)\033", core.output)
    server = re.search(r"started roslaunch server (\S+)\033", core.output)
    log = f"{ros.pipros.environment['ROS_HOME']}/log/{run_id[1]}/roslaunch-{os.uname().nodename}-{pid}.log"
    assert core.stdout == [
        f"... logging to {log}", "Checking log directory for disk usage. This may take a while.",
        "Press Ctrl-C to interrupt", "Done checking log file disk usage. Usage is <1GB.",
        "\033]2;roscore\007", f"\033[1mstarted roslaunch server {server[1]}\033[0m",
        "ros_comm version 1.15.15", f"pipros version {pipros.__version__}", "", "", "SUMMARY", "========", "",
        "PARAMETERS", " * /rosdistro: noetic", " * /rosversion: 1.15.15", "", "NODES", "",
        "auto-starting new master", f"\033[1mprocess[master]: started with pid [{pid}]\033[0m",
        f"\033[1mROS_MASTER_URI={ros.master_uri}/\033[0m", f"\033]2;roscore {ros.master_uri}/\007",
        "master listens on 127.0.0.1, for this computer only",
        f"\033[1msetting /run_id to {run_id[1]}\033[0m",
        f"\033[1mprocess[rosout-1]: started with pid [{pid}]\033[0m", "started core service [/rosout]",
        "[rosout-1] killing on exit", "[master] killing on exit", "shutting down processing monitor...",
        "... shutting down processing monitor complete", "\033[1mdone\033[0m",
    ]  # fmt: skip
    assert Path(log).is_file()


def test_a_master_can_be_opened_to_the_network_on_purpose(ros: RosSystem) -> None:
    open_to_all = "0.0.0.0"  # noqa: S104
    core = ros.pipros.start("roscore", "-p", str(ros.port), "--bind", open_to_all, ROS_HOSTNAME="localhost")
    core.wait_for("master listens on 0.0.0.0, open to all programs that can reach this computer")


def test_the_pid_file_exists_while_roscore_runs(ros: RosSystem, package: Path) -> None:
    file = ros.home / "pid"
    running = launch(ros, package, node("sleeper"), f"--pid={file}")
    running.wait_for("ready")
    assert file.read_text() == str(running.pid)
    running.press_ctrl_c()
    running.wait()
    assert not file.exists()


def test_a_link_to_a_device_may_be_the_pid_file_and_stays(ros: RosSystem) -> None:
    (ros.home / "pid").symlink_to(os.devnull)
    (ros.home / "x.launch").write_text("<launch><param name='a' value='1'/></launch>")
    ros.serve_master()
    ros.pipros.run("roslaunch", f"--pid={ros.home / 'pid'}", ros.home / "x.launch").check(0, "done")
    assert os.readlink(ros.home / "pid") == os.devnull


def test_roscore_keeps_a_pid_file_and_a_log_of_its_master(ros: RosSystem) -> None:
    core = ros.pipros.start("roscore", "-p", str(ros.port), "--master-logger-level=debug")
    core.wait_for(r"started core service \[/rosout\]")
    home = Path(ros.pipros.environment["ROS_HOME"])
    file = home / f"roscore-{ros.port}.pid"
    wait_until(lambda: file.exists() and file.read_text() == str(core.pid))
    [log] = home.glob("log/*-*/master.log")
    wait_until(lambda: "+SUB [/rosout] /rosout http://127.0.0.1:" in log.read_text())
    assert f"Master initialized: port[{ros.port}], uri[{ros.master_uri}/]" in log.read_text()
    assert "[DEBUG]" in log.read_text()

    second = ros.pipros.run("roscore", "-p", str(ros.port))
    assert second.returncode == 1
    assert file.read_text() == str(core.pid)
    core.press_ctrl_c()
    core.wait()
    assert not file.exists()


@pytest.mark.parametrize("variable", ["ROS_HOSTNAME", "ROS_IP"])
def test_a_host_name_of_another_computer_is_refused_at_once(ros: RosSystem, variable: str) -> None:
    core = ros.pipros.run("roscore", "-p", str(ros.port), **{variable: "no.such.host.invalid"})
    assert core.returncode == 1
    assert re.search(
        r"RLException: Unable to contact my own server at \[http://no\.such\.host\.invalid:\d+/\]",
        core.output,
    )
    assert "Set ROS_HOSTNAME or ROS_IP to a name" in core.output
    assert "auto-starting new master" not in core.output


@pytest.mark.parametrize("port", ["-1", "65536"])
def test_an_invalid_port_is_refused(ros: RosSystem, port: str) -> None:
    core = ros.pipros.run("roscore", "-p", port)
    core.check(1, f"port must be between 0 and 65535, got {port}")


def test_wait_delays_the_launch_until_a_master_runs(ros: RosSystem, package: Path) -> None:
    running = launch(ros, package, node("sleeper"), "--wait")
    running.wait_for("roscore/master is not yet running, will wait for it to start")
    ros.serve_master()
    running.wait_for("ready")
    assert "auto-starting new master" not in running.stdout


def test_the_masters_shutdown_call_ends_roscore_in_order(ros: RosSystem) -> None:
    core = ros.pipros.start_master()
    with closing(MasterClient(ros.master_uri, "/a_test")) as client:
        client.call("shutdown", "the end of the day")
    assert (core.wait(), core.stdout[-1][-8:]) == (0, "done\x1b[0m")


# roslaunch on a terminal: each line shows its node.


PROGRAM = """\
#!/bin/sh
[ -t 1 ] && echo "$1 has a terminal"
echo "$1 complains" >&2
printf '%s' "$1 asks: "
exec sleep 1000
"""


@pytest.fixture
def file(ros: RosSystem) -> Path:
    folder = make_programs(ros.home / "programs", {"talk": PROGRAM})
    nodes = "".join(
        f'<node pkg="programs" type="talk" name="{name}" args="{name}" output="screen"/>' for name in "ab"
    )
    (folder / "x.launch").write_text(f"<launch>{nodes}</launch>")
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(folder)
    return folder / "x.launch"


def test_each_line_starts_with_the_name_of_its_node_in_its_own_colour(ros: RosSystem, file: Path) -> None:
    terminal = ros.pipros.open_terminal()
    terminal.type(f"roslaunch {file}")
    terminal.wait_for(r"\033\[35m\[a-2\]\033\[0m a has a terminal")
    terminal.wait_for(r"\033\[33m\[b-3\]\033\[0m b complains")
    terminal.wait_for(r"\033\[35m\[a-2\]\033\[0m a asks: ")
    terminal.press_ctrl_c()
    assert terminal.wait_for_prompt() == 0


def test_nodes_can_write_to_the_terminal_themselves(ros: RosSystem, file: Path) -> None:
    terminal = ros.pipros.open_terminal()
    terminal.type(f"roslaunch --raw-output {file}")
    terminal.wait_for("b complains")
    assert "[b-3]\033[0m" not in terminal.output
    terminal.press_ctrl_c()
    assert terminal.wait_for_prompt() == 0


def test_without_a_terminal_the_output_has_no_prefix(ros: RosSystem, file: Path) -> None:
    running = ros.pipros.start("roslaunch", file)
    running.wait_for("^b complains$")
    assert "b complains" in running.stderr


# Nodes on other machines. The ssh client of these tests runs the command on this machine.


SSH = """\
#!/bin/sh
for word; do last=$word; done
echo "ssh was called: $*"
exec sh -c "$last"
"""

LOADER = """\
#!/bin/sh
FROM_LOADER=yes
export FROM_LOADER
exec "$@"
"""

FILE = """\
<launch>
  <machine name="far" address="far.example" user="ada" env-loader="{loader}" timeout="3"/>
  <group ns="g">
    <node machine="far" pkg="programs" type="show" name="there" args="one 'two words'" output="screen"/>
  </group>
  <node pkg="programs" type="show" name="here" args="local" output="screen"/>
</launch>
"""

MACHINE_PROGRAM = """\
#!/bin/sh
echo "$1 of $# loader=$FROM_LOADER ns=$ROS_NAMESPACE master=$ROS_MASTER_URI"
exec sleep 1000
"""


@pytest.fixture
def machine_file(ros: RosSystem) -> Path:
    folder = ros.home / "programs"
    tools = ros.home / "tools_of_the_test"
    for path, content in (
        (tools / "ssh", SSH), (folder / "loader", LOADER), (folder / "show", MACHINE_PROGRAM),
        (folder / "package.xml", "<package><name>programs</name></package>"),
        (folder / "x.launch", FILE.format(loader=folder / "loader")),
    ):  # fmt: skip
        path.parent.mkdir(exist_ok=True)
        path.write_text(content)
        path.chmod(0o755)
    ros.pipros.environment["ROS_PACKAGE_PATH"] = str(folder)
    ros.pipros.environment["PATH"] = f"{tools}:{ros.pipros.environment['PATH']}"
    return folder / "x.launch"


def test_a_node_of_another_machine_runs_there_in_its_environment(ros: RosSystem, machine_file: Path) -> None:
    running = ros.pipros.start("roslaunch", machine_file)
    running.wait_for(r"ssh was called: -tt .*ConnectTimeout=3 -p 22 -- ada@far.example ")
    running.wait_for(rf"^one of 3 loader=yes ns=/g master={ros.master_uri}$")
    running.wait_for(r"^local of 3 loader= ns= ")
    running.wait_for("WARNING: nodes on other machines cannot reach the master")
    running.press_ctrl_c(code=0)


def test_local_ignores_other_machines(ros: RosSystem, machine_file: Path) -> None:
    running = ros.pipros.start("roslaunch", "--local", machine_file)
    running.wait_for(r"^local of 3")
    assert "ssh was called" not in running.output
    assert "process[g/there" not in running.output


# A launch that uses a master started by another program.


def test_a_running_master_without_a_run_id_gets_one_and_keeps_it(master: Master, tmp_path: Path) -> None:
    environment = Environment(master_uri=master.uri)

    def found() -> SessionMaster:
        return SessionMaster(
            environment, MasterOptions(), Console(), is_core=False, port=None, on_shutdown=lambda: None
        )

    first, second = found(), found()
    assert first.find() == ""
    first.start("run-1", tmp_path)
    assert (first.sets_run_id, first.is_own) == (True, False)
    assert second.find() == "run-1"
    second.start("run-2", tmp_path)
    assert not second.sets_run_id
    assert found().find() == "run-1"
