"""`rosgraph`, its library, `roscore` and `rosmaster` compared with the genuine ones."""

import re
from pathlib import Path

import pytest

from pipros.basics.errors import PiprosError
from pipros.net.master_client import MasterClient
from tests.support.ros import RosSystem, Side
from tests.support.waiting import wait_until


@pytest.mark.parametrize("arguments", [[], ["-h"], ["--help"], ["-x"], ["one"]])
def test_without_a_master_and_with_arguments_it_says_the_same(ros: RosSystem, arguments: list[str]) -> None:
    ours, genuine = (side.run("rosgraph", *arguments) for side in (ros.pipros, ros.genuine))
    assert (ours.returncode, ours.stdout, ours.stderr) == (genuine.returncode, genuine.stdout, genuine.stderr)


@pytest.mark.parametrize("package", ["rostopic", "rosservice", "rosgraph"])
def test_tools_are_programs_of_their_packages(ros: RosSystem, package: str) -> None:
    ours, genuine = (side.run("rosrun", package, package, "--nonsense") for side in (ros.pipros, ros.genuine))
    assert (ours.returncode, ours.output) == (genuine.returncode, genuine.output)


def test_the_package_roslaunch_has_the_launch_files_of_the_genuine_one(ros: RosSystem) -> None:
    for name in ("example.launch", "example-min.launch", "example-include.launch"):
        for side in (ros.pipros, ros.genuine):
            listed = side.run("roslaunch", "--files", "roslaunch", name)
            assert listed.returncode == 0, listed.output
            assert any(file.endswith(f"roslaunch/resources/{name}") for file in listed.stdout)


@pytest.mark.parametrize("arguments", [["example-args.launch", "who:=me"], ["example-min.launch"]])
def test_genuine_roslaunch_reads_our_examples_as_we_do(ros: RosSystem, arguments: list[str]) -> None:
    """The files without `$(find roslaunch)`, which is the genuine folder in genuine ROS."""
    folder = ros.pipros.run("rospack", "find", "roslaunch").stdout[0]
    file, *rest = arguments
    path = f"{folder}/resources/{file}"
    ours, genuine = (
        side.run("roslaunch", "--dump-params", path, *rest) for side in (ros.pipros, ros.genuine)
    )
    assert ours.returncode == genuine.returncode == 0, ours.output
    assert sorted(ours.stdout) == sorted(genuine.stdout)


@pytest.mark.parametrize(
    ("arguments", "parameters"),
    [
        (["example.launch"], 8), (["example-pass_all_args.launch", "who:=me"], 2),
        (["example-params.launch"], 9),
    ],
)  # fmt: skip
def test_the_other_examples_load(ros: RosSystem, arguments: list[str], parameters: int) -> None:
    dumped = ros.pipros.run("roslaunch", "--dump-params", "roslaunch", *arguments)
    assert dumped.returncode == 0, dumped.output
    assert len([line for line in dumped.stdout if line.startswith("/")]) >= parameters - 1


# rosgraph.impl.graph, the library behind rqt_graph, has the same results as genuine rosgraph.
SCRIPT = Path(__file__).parent / "programs" / "examine_graph.py"


def test_both_find_the_same_graph(ros: RosSystem) -> None:
    ros.serve_master()
    ros.pipros.start("rosrun", "composiv_tryouts", "composiv_talker.py")
    for name in ("one", "two"):
        program = ("rosrun", "composiv_tryouts", "composiv_listener.py", f"__name:={name}")
        (ros.pipros if name == "one" else ros.genuine).start(*program)
    ros.genuine.start(
        "rosrun", "cpp_battery", "battery_listener", "__ns:=/far", "battery_topic:=/battery_topic"
    )
    ros.wait_for_publisher("/battery_topic")
    wait_until(lambda: len(ros.subscribers("/battery_topic")) == 3, 60)
    with_nobody = MasterClient(ros.master_uri, "/ghost", timeout_s=60)
    with_nobody.register_publisher("/unheard", "std_msgs/String", "http://127.0.0.1:9/")

    [talker] = ros.publishers("/battery_topic")
    wanted = {
        f"nn_edges '{talker}' -> '{listener}' [/battery_topic] {talker}->{listener}"
        for listener in ("/one", "/two", "/far/cpp_listener")
    }
    graphs: list[list[str]] = []

    def are_the_same() -> bool:
        graphs[:] = _graph(ros, "python"), _graph(ros, "/usr/bin/python3")
        return graphs[0] == graphs[1] and wanted <= set(graphs[0])

    # Links, also those to /rosout, are made while nodes start, so two looks at them may differ.
    wait_until(are_the_same, 60, lambda: str(graphs))

    found = graphs[0]
    assert f"nt_edges '{talker}' -> ' /battery_topic' [] {talker}-> /battery_topic" in found
    assert "bad /ghost True" in found


def _graph(ros: RosSystem, python: str) -> list[str]:
    side = ros.pipros if python == "python" else ros.genuine
    return side.run(python, str(SCRIPT), "/ghost").stdout


# roscore and rosmaster compared with the genuine ones: parameters and topics after the start, log, options.
API = "http://127.0.0.1:9/"
CALLS = [
    ("/s", "registerSubscriber", "t", "x/Y", API), ("/p", "registerPublisher", "t", "x/Y", API),
    ("/p", "registerService", "~srv", "rosrpc://h:1", API), ("/p", "setParam", "a/b", 1),
    ("/p", "setParam", "a", {"c": 2}), ("/s", "subscribeParam", API, "a"), ("/p", "setParam", "/a//c/", 3),
    ("/p", "deleteParam", "a/c"), ("/s", "unsubscribeParam", API, "a"),
    ("/p", "unregisterService", "~srv", "rosrpc://h:1"), ("/p", "unregisterPublisher", "t", API),
    ("/s", "unregisterSubscriber", "t", API),
]  # fmt: skip


def _changes(ros: RosSystem, side: Side, log: Path) -> list[str]:
    """Return the lines about calls in a master's log, which begin with a plus or a minus."""
    master = side.start("rosmaster", "--core", "-p", str(ros.port), f"__log:={log}")
    for caller, method, *params in CALLS:
        client = MasterClient(ros.master_uri, caller, timeout_s=30)
        wait_until(lambda found=client: _is_up(found), 60)
        client.call(method, *params)
        client.close()
    master.press_ctrl_c()
    assert master.wait() == 0
    lines = log.read_text().splitlines()
    return [line for line in lines if re.search(r"\]\[INFO\] [-0-9 :,]{23}: [+-]", line)]


def _is_up(client: MasterClient) -> bool:
    try:
        return client.get_pid() > 0
    except PiprosError:
        return False


def test_master_log_has_the_same_lines(ros: RosSystem, tmp_path: Path) -> None:
    ours, genuine = (
        [re.sub(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d,\d{3}", "TIME", line) for line in _changes(ros, side, log)]
        for side, log in ((ros.pipros, tmp_path / "ours.log"), (ros.genuine, tmp_path / "genuine.log"))
    )
    assert len(ours) == len(CALLS)
    assert ours == genuine


QUESTIONS = (
    "rosnode list", "rosservice list", "rostopic list -v", "rosparam list",
    "rosservice uri /rosout/get_loggers",
)  # fmt: skip


def test_a_new_roscore_gives_tools_the_same_answers(ros: RosSystem) -> None:
    answers = []
    for side in (ros.pipros, ros.genuine):
        core = side.start_master()
        ros.wait_for_publisher("/rosout_agg")
        ros.wait_for_subscriber("/rosout")  # the process was started, and may not be registered yet
        found = {question: ros.genuine.run(*question.split()) for question in QUESTIONS}
        assert [question for question, answer in found.items() if answer.returncode] == []
        answers.append({question: re.sub(r"\d{4,5}", "NUMBER", found[question].output) for question in found})
        core.press_ctrl_c()
        assert core.wait(60) == 0
    assert answers[0] == answers[1]


@pytest.mark.parametrize("command", ["roscore", "rosmaster"])
def test_every_option_of_the_genuine_command_is_there(ros: RosSystem, command: str) -> None:
    ours, genuine = (
        set(re.findall(r"(?<!\w)--?[a-z][a-z-]*", side.run(command, "--help").output))
        for side in (ros.pipros, ros.genuine)
    )
    assert genuine <= ours
