"""The tabs of the page with a running robot: displayed data and permitted changes."""

import asyncio
import gc
import hashlib
import http.client
import json
import re
import shlex
import ssl
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import psutil
import pytest
from websockets import Origin
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus

from tests.support import documents
from tests.support.environments import file_of_tests
from tests.support.page import LivePage, Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

ROBOT = file_of_tests("browser/programs/robot_program.py")


def first(values: Iterator[Any], condition: Callable[[Any], object]) -> Any:
    return next(value for value in values if condition(value))


@pytest.fixture(scope="module")
def robot(shared_ros: RosSystem) -> RosSystem:
    """`roscore`, with /rosout, and the node `/robot`."""
    shared_ros.pipros.start_master()
    shared_ros.pipros.start(sys.executable, ROBOT, "robot")
    shared_ros.wait_for_publisher("/imu")
    return shared_ros


@pytest.fixture(scope="module")
def page(robot: RosSystem) -> Page:
    """The page of the robot without options, for tests that only look at it."""
    return Page(robot)


@pytest.fixture
def browser(page: Page) -> Iterator[LivePage]:
    with page.connect() as browser:
        yield browser


def test_a_curve_of_numbers(browser: LivePage) -> None:
    curve = browser.watch("plot", field="/imu/angular_velocity/x")
    data = first(curve, lambda value: value.get("samples"))
    assert all(-1.0 <= number <= 1.0 for _, number in data["samples"])
    assert data["lost"] == 0


def test_a_curve_waits_for_its_topic_and_names_fields_that_are_not_numbers(browser: LivePage) -> None:
    assert "is not published yet" in next(browser.watch("plot", field="/nothing/x"))["error"]
    data = first(browser.watch("plot", field="/imu/header"), lambda value: value.get("error"))
    assert "/imu/header must be a number" in data["error"]


STAMPED = """
import rospy
from geometry_msgs.msg import PointStamped
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Header
rospy.init_node("stamped", log_level=rospy.FATAL)
clock = rospy.Publisher("/clock", Clock, queue_size=1)
points = rospy.Publisher("/point", PointStamped, queue_size=10)
count = 0
while not rospy.is_shutdown():
    count += 1
    clock.publish(rospy.Time(500))
    point = PointStamped(header=Header(stamp=rospy.Time(100 + count)))
    point.point.x = count
    points.publish(point)
    rospy.rostime.wallsleep(0.02)
"""


def test_the_time_axis_of_curves(ros: RosSystem) -> None:
    ros.serve_master()
    ros.pipros.start(sys.executable, "-c", STAMPED)
    ros.wait_for_publisher("/point")
    page = Page(ros)
    with page.connect() as browser:
        stamped = first(
            browser.watch("plot", field="/point/point/x", axis="stamp"), lambda data: data.get("samples")
        )
        assert all(time == 100 + value for time, value in stamped["samples"])
        in_ros_time = browser.watch("plot", field="/point=m.point.x * 2", axis="ros")
        data = first(in_ros_time, lambda data: any(time == 500 for time, _ in data.get("samples", [])))
        assert all(value % 2 == 0 for _, value in data["samples"])
        refused = first(
            browser.watch("plot", field="/clock/clock", axis="stamp"), lambda data: data.get("error")
        )
        assert "have no header; choose another x axis" in refused["error"]
        slow = "/point=len([1 for a in range(1000) for b in range(1000) for c in range(1000)])"
        ended = first(browser.watch("plot", field=slow), lambda data: data.get("error"))
        # a fast processor reaches the evaluator's limit before the time limit
        assert re.search("a sample takes|does too much work", ended["error"])
        assert "axis must be one of" in next(browser.watch("plot", field="/point", axis="moon"))["error"]


def test_warnings_and_errors_are_marks_of_curves(browser: LivePage) -> None:
    marks = next(browser.watch("log_marks"))["marks"]
    assert all(level >= 4 for _, level, _ in marks)
    assert marks[0][2].startswith("/robot: ")


def test_the_log_with_levels_and_places(browser: LivePage) -> None:
    data = first(browser.watch("console"), lambda value: any(row[0] == 4 for row in value["entries"]))
    row = next(row for row in data["entries"] if row[0] == 4)
    _, node, text, stamp, file, line, _ = row
    assert node == "/robot"
    assert text.startswith("wheel slips: ")
    assert stamp > 1e9
    assert file.endswith("robot_program.py")
    assert line > 0


def test_parameters_and_their_changes(robot: RosSystem, browser: LivePage) -> None:
    values = browser.watch("params")
    assert first(values, lambda value: "/robot/wheel_radius" in value["params"])
    robot.pipros.run("rosparam", "set", "/robot/wheel_radius", "0.25")
    first(values, lambda value: value["params"].get("/robot/wheel_radius") == "0.25")
    robot.pipros.run("rosparam", "set", "/odd", "[.nan, -.inf, nan, 1]")
    first(values, lambda value: value["params"].get("/odd") == '[.nan, -.inf, "nan", 1]')
    robot.pipros.run("rosparam", "set", "/long", str([7] * 41))
    first(values, lambda value: value["params"].get("/long") == f"[{'7, ' * 40}…] (41 elements)")


def test_processor_and_memory_use_of_nodes(browser: LivePage) -> None:
    data = first(
        browser.watch("processes"),
        lambda value: any(row["name"] == "/robot" and row.get("pid") for row in value["nodes"]),
    )
    row = next(row for row in data["nodes"] if row["name"] == "/robot")
    assert row["memory"] > 1_000_000
    assert row["threads"] >= 1


def test_images(page: Page) -> None:
    with page.connect() as browser:
        head, _, pixels = next(browser.watch("image", name="/camera/image_raw")).partition(b"\n")
        assert json.loads(head)["full"] == [8, 4]
        assert pixels == b"\xff\x00\x00" * 32
    with page.connect() as browser:
        assert "topic type must be sensor_msgs/Image" in next(browser.watch("image", name="/imu"))["error"]


def test_frames(browser: LivePage) -> None:
    data = first(browser.watch("frames"), lambda value: value["frames"] and value["frames"][0]["rate"])
    frame = data["frames"][0]
    assert (frame["frame"], frame["parent"], frame["authority"]) == ("base_link", "map", "/robot")


def test_diagnostics(browser: LivePage) -> None:
    data = first(browser.watch("diagnostics"), lambda value: value["components"])
    component = data["components"][0]
    assert (component["name"], component["level"], component["message"]) == ("/Motors/left", 1, "warm")
    assert component["values"][0] == ["current", "2.1 A"]


def test_services_and_loggers(browser: LivePage) -> None:
    data = first(browser.watch("services"), lambda value: value["services"])
    assert ["/robot/get_loggers", "/robot"] in data["services"]
    service = browser.act("service", name="/robot/set_logger_level")
    assert service["type"] == "roscpp/SetLoggerLevel"
    assert service["request"] == {"logger": "", "level": ""}
    assert {"name": "rosout", "level": "INFO"} in browser.act("loggers", name="/robot")


CHANGES = {
    "kill_node": {"name": "/nothing"}, "set_param": {"name": "/robot/x", "value": "1"},
    "delete_param": {"name": "/robot/wheel_radius"},
    "set_logger_level": {"name": "/robot", "logger": "rosout", "level": "debug"},
    "call_service": {"name": "/robot/get_loggers", "request": ""},
    "set_reconfigured": {"name": "/robot", "changes": {"gain": 1}},
    "send_goal": {"name": "/robot", "type": "actionlib/TestActionGoal", "goal": ""},
    "cancel_goal": {"name": "/robot"}, "steer": {"session": "x", "linear": 0, "angular": 0},
    "restart_launched": {"launch": "0", "node": "driver"}, "stop_launched": {"launch": "0", "node": "driver"},
    "record": {"topics": ["/imu"]}, "stop_recording": {},
}  # fmt: skip


def test_a_read_only_page_cannot_change_anything(robot: RosSystem, browser: LivePage) -> None:
    for action, arguments in CHANGES.items():
        assert "start it with --control" in browser.act(action, **arguments)["error"]
    view = browser.watch("publishing", name="/x", type="std_msgs/String", message="data: y", rate=0)
    assert "start it with --control" in next(view)["error"]
    assert robot.publishers("/x") == []


def test_a_page_with_control_changes_parameters_loggers_and_calls(robot: RosSystem) -> None:
    with Page(robot, "--control").connect() as browser:
        assert browser.act("about")["control"] is True
        assert browser.act("set_param", name="/robot/x", value="{a: 7}") is True
        assert robot.pipros.run("rosparam", "get", "/robot/x/a").stdout == ["7"]
        assert browser.act("delete_param", name="/robot/x") is True
        assert "is not set" in browser.act("delete_param", name="/robot/x")["error"]
        assert browser.act("set_logger_level", name="/robot", logger="rosout", level="debug") is True
        assert {"name": "rosout", "level": "DEBUG"} in browser.act("loggers", name="/robot")
        answer = browser.act("call_service", name="/robot/get_loggers", request="")
        assert answer["response"]["loggers"]
        assert (
            "Incompatible arguments"
            in browser.act("call_service", name="/robot/get_loggers", request="x: 1")["error"]
        )
        assert (
            "level must be one of"
            in browser.act("set_logger_level", name="/robot", logger="rosout", level="loud")["error"]
        )


USUAL = {
    "rqt_logger_level": "set_logger_level", "rqt_publisher": "publishing",
    "rqt_reconfigure": "set_reconfigured", "rqt_service_caller": "call_service",
}  # fmt: skip


@pytest.mark.parametrize("command", USUAL)
def test_four_commands_may_make_their_own_kind_of_change(robot: RosSystem, command: str) -> None:
    page = Page(robot, command=command)
    page.process.wait_for(r"The page can [a-z ]+\. With --control, it can make all changes; with --read-only")
    with page.connect() as browser:
        about = browser.act("about")
        assert (about["control"], about["may"]) == (False, [USUAL[command]])
        for action, arguments in CHANGES.items():
            error = browser.act(action, **arguments)
            is_refused = isinstance(error, dict) and "cannot do this" in error.get("error", "")
            assert is_refused == (action != USUAL[command]), (action, error)
        view = browser.watch("publishing", name="/x", type="std_msgs/String", message="data: y", rate=0)
        assert ("error" not in next(view)) == (command == "rqt_publisher")


@pytest.mark.parametrize(("options", "may"), [
    (["--read-only"], []),
    (["--bind", "0.0.0.0"], []),  # noqa: S104 - it must not be able to change anything there
    (["--bind", "localhost"], ["publishing"]),
    (
        ["--control"],
        sorted({*CHANGES, "approve", "publishing", "scene_feedback", "scene_save", "teleop"}),
    ),
])  # fmt: skip
def test_options_decide_what_a_page_may_change(ros: RosSystem, options: list[str], may: list[str]) -> None:
    ros.serve_master()
    with Page(ros, *options, command="rqt_publisher").connect() as browser:
        assert browser.act("about")["may"] == may


@pytest.mark.parametrize(("arguments", "error"), [
    (["--control", "--read-only"], "--control and --read-only cannot be combined"),
    (["-s", "rqt_shell"], "pipros has no rqt plugin [rqt_shell]; the plugins are bag, console, graph, "),
    (["-s"], "-s must be followed by a plugin name"),
    (["--perspective-file", "/missing.json"], "cannot read /missing.json: No such file or directory"),
    (["--perspective", "nothing"], "there is no layout [nothing]"),
])  # fmt: skip
def test_wrong_options_of_rqt_are_explained(ros: RosSystem, arguments: list[str], error: str) -> None:
    ros.serve_master()
    ended = ros.pipros.run("rqt", *arguments)
    assert (ended.returncode, error in ended.output) == (1, True)


@pytest.mark.parametrize(("options", "may_save"), [
    ([], True), (["--read-only"], False),
    (["--bind", "0.0.0.0"], False),  # noqa: S104 - others must not be able to write files there
    (["--bind", "0.0.0.0", "--control"], True),  # noqa: S104
])  # fmt: skip
def test_options_decide_who_may_store_layouts(ros: RosSystem, options: list[str], may_save: bool) -> None:
    ros.serve_master()
    with Page(ros, *options).connect() as browser:
        assert browser.act("layouts") == {"names": [], "may_save": may_save}
        answer = browser.act("save_layout", name="mine", panels="graph")
        assert ("error" not in answer) == may_save
        assert browser.act("layouts")["names"] == (["mine"] if may_save else [])


def test_publishing_stops_when_the_browser_disconnects(ros: RosSystem) -> None:
    ros.serve_master()
    page = Page(ros, "--control")
    with page.connect() as browser:
        bad = browser.watch("publishing", name="/x", type="std_msgs/String", message="wrong: y", rate=0)
        assert "wrong" in next(bad)["error"]
        for rate in (True, -1, "1"):
            bad = browser.watch("publishing", name="/x", type="std_msgs/String", message="data: x", rate=rate)
            assert "rate must be from 0 to" in next(bad)["error"]
    with page.connect() as browser:
        arguments = {"name": "/x", "type": "std_msgs/String", "message": "data: hello", "rate": 50}
        first(browser.watch("publishing", **arguments), lambda value: value["count"] > 1)
        assert ros.pipros.run("rostopic", "echo", "-n1", "/x").stdout[0] == 'data: "hello"'
    wait_until(lambda: ros.publishers("/x") == [], 30.0, "the publisher to end")


@pytest.mark.parametrize(("command", "place"), [
    (("rqt",), ""), (("rqt", "-s", "reconfigure"), "reconfigure"),
    (("rqt", "--standalone=rqt_plot/Plot", "/imu/x"), "plot/%2Fimu%2Fx"),
    (("rqt", "-s", "rqt_graph"), "graph"), (("rqt_bag",), "bags"), (("rqt_console",), "console"),
    (("rqt_image_view", "camera"), "images/%2Fcamera"),
    (("rqt_logger_level", "/robot"), "console/%2Frobot"),
    (("rqt_plot", "imu/x:y", "/joints/position[1]"), "plot/%2Fimu%2Fx%3Ay%2C%2Fjoints%2Fposition%5B1%5D"),
    (("rqt_publisher",), "publish"), (("rqt_reconfigure", "/robot"), "reconfigure/%2Frobot"),
    (("rqt_robot_monitor",), "diagnostics"), (("rqt_service_caller",), "services"),
    (("rqt_tf_tree",), "tf"), (("rviz",), "scene"), (("rqt_top",), "nodes"), (("rqt_topic",), "topics"),
])  # fmt: skip
def test_each_command_opens_its_tab(ros: RosSystem, command: tuple[str, ...], place: str) -> None:
    page = Page(ros, *command[1:], command=command[0])
    assert page.place == place
    page.process.press_ctrl_c()
    assert page.process.wait() == 0


PLACES = {"rqt_reconfigure": "reconfigure", "rqt_graph": "graph", "rqt_gui": ""}


@pytest.mark.parametrize("package", PLACES)
def test_tools_are_found_in_their_packages(ros: RosSystem, package: str) -> None:
    """Started as in documents, with the arguments that roslaunch adds to a node."""
    tool = ros.pipros.start("rosrun", package, package, "--no-browser", "__name:=tool", "__log:=/tmp/x.log")
    address = tool.wait_for(r"http\S+")[0]
    assert address.partition("#token=")[2].partition("/")[2] == PLACES[package]
    tool.press_ctrl_c()
    assert tool.wait() == 0


LARGE_IMAGES = """
import rospy
from sensor_msgs.msg import Image
rospy.init_node("camera")
images = rospy.Publisher("/image", Image, queue_size=2)
image = Image(width=1000, height=333, step=3000, encoding="rgb8", data=bytes(999000))
rate = rospy.Rate(30)
while not rospy.is_shutdown():
    images.publish(image)
    rate.sleep()
"""


def test_a_stuck_browser_does_not_delay_others_and_costs_little_memory(ros: RosSystem) -> None:
    ros.serve_master()
    ros.pipros.start(sys.executable, "-c", LARGE_IMAGES)
    ros.wait_for_publisher("/image")
    page = Page(ros)
    server = psutil.Process(page.process.pid)
    with page.connect() as stuck, page.connect() as browser:
        for number in range(20):
            stuck.socket.send(json.dumps({"id": number, "view": "image", "args": {"name": "/image"}}))
        images = browser.watch("image", name="/image")
        for _ in range(30):
            next(images)
        memory = server.memory_info().rss
        for _ in range(30):
            assert len(next(images)) > 999_000
        assert server.memory_info().rss < memory + 60e6


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_all_threads_of_the_server_allocate_from_one_arena(page: Page) -> None:
    with page.connect() as browser:
        first(browser.watch("plot", field="/imu/angular_velocity/x"), lambda value: value.get("samples"))
    # glibc reserves 64 MiB for each further arena, on a multiple of it.
    reserved = re.findall(r"(?m)^\w+-(\w+) ---p", Path(f"/proc/{page.process.pid}/maps").read_text())
    assert [end for end in reserved if int(end, 16) % (64 * 1024 * 1024) == 0] == []


# The page on a network: `--bind`, certificates, and messages about them. The network is 127.0.0.2.


CERTIFICATES = file_of_tests("support/certificates")
FINGERPRINT = hashlib.sha256(ssl.PEM_cert_to_DER_cert((CERTIFICATES / "cert.pem").read_text())).hexdigest()
HOST = "127.0.0.2"

pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="127.0.0.2 is an address on Linux only"),
    # Python 3.10 warns about an aborted transport, with which a refused handshake ends.
    pytest.mark.filterwarnings("ignore:unclosed transport <asyncio.sslproto:ResourceWarning"),
]


def trusting(certificate: Path = CERTIFICATES / "cert.pem") -> ssl.SSLContext:
    """Trust a certificate, and check the names in the test's."""
    context = ssl.create_default_context(cafile=str(certificate))
    context.check_hostname = certificate.is_relative_to(CERTIFICATES)
    return context


async def about(place: str, token: str, scheme: str, trust: ssl.SSLContext, **request: Any) -> Any:
    """Return the answer to a request, over TLS, where the threaded client loses requests."""
    async with connect(
        f"wss://{place}/live", origin=Origin(f"{scheme}://{place}"), ssl=trust, proxy=None, open_timeout=60
    ) as browser:
        await browser.send(json.dumps({"token": token}))
        assert json.loads(await browser.recv()) == {"id": 0, "data": {"token": token}}
        await browser.send(json.dumps({"id": 1, "action": "about", **request}))
        return json.loads(await browser.recv())


@pytest.mark.parametrize("is_one_file", [False, True])
def test_a_certificate_makes_everything_https(ros: RosSystem, tmp_path: Path, is_one_file: bool) -> None:
    ros.serve_master()
    cert, key = CERTIFICATES / "cert.pem", CERTIFICATES / "key.pem"
    files: tuple[str | Path, ...] = ("--cert", cert, "--key", key)
    if is_one_file:
        both = tmp_path / "both.pem"
        both.write_text(key.read_text() + cert.read_text())
        files = ("--cert", both)
    server = ros.pipros.start("rqt_graph", "--no-browser", "--bind", f"{HOST}:0", *files)
    url = urlsplit(server.wait_for(r"https://\S+")[0])
    assert url.hostname == HOST
    server.wait_for("Others on this network can see the system if they have this address.")
    said = server.wait_for("Encrypted with TLS; the certificate's SHA-256 fingerprint is ([0-9A-F:]{95})")[1]
    assert said.replace(":", "").lower() == FINGERPRINT

    connection = http.client.HTTPSConnection(url.netloc, context=trusting(), timeout=30)
    connection.request("GET", "/")
    answer = connection.getresponse()
    assert answer.status == 200
    assert b"app.js" in answer.read()

    token = url.fragment.removeprefix("token=").partition("/")[0]
    told = asyncio.run(about(url.netloc, token, "https", trusting()))["data"]
    assert told["master"] == ros.master_uri
    with pytest.raises(InvalidStatus) as refused:
        asyncio.run(about(url.netloc, token, "http", trusting()))
    assert refused.value.response.status_code == 403
    del refused
    gc.collect()  # collect that transport while its warning is ignored

    plain = http.client.HTTPConnection(url.netloc, timeout=30)
    plain.request("GET", "/")
    with pytest.raises((http.client.HTTPException, OSError)):
        plain.getresponse()
    server.press_ctrl_c()
    assert server.wait() == 0


def test_a_colleague_sees_the_documented_page_and_cannot_change_anything(ros: RosSystem) -> None:
    ros.serve_master()
    certify, serve = re.findall(r"(?m)^(?:openssl|rqt -).*", documents.text_of("how/see-in-a-browser.md"))
    subprocess.run(certify, shell=True, cwd=ros.home, check=True, capture_output=True)  # noqa: S602
    server = ros.pipros.start(*shlex.split(serve.replace("0.0.0.0:8443", f"{HOST}:0")))
    url = urlsplit(server.wait_for(r"https://\S+")[0])
    way = (url.netloc, url.fragment.removeprefix("token="), "https", trusting(ros.home / "cert.pem"))
    assert asyncio.run(about(*way))["data"]["may"] == []
    refused = asyncio.run(about(*way, action="set_param", name="/x", value="1"))
    assert "start it with --control" in refused["error"]


def test_without_a_certificate_it_says_that_nothing_is_encrypted(ros: RosSystem) -> None:
    ros.serve_master()
    server = ros.pipros.start("rqt_graph", "--no-browser", "--control", "--bind", HOST)
    url = urlsplit(server.wait_for(r"http://\S+")[0])
    server.wait_for("Others on this network can see and change the system if they have this address.")
    server.wait_for("The connection is not encrypted; --cert and --key encrypt it.")
    connection = http.client.HTTPConnection(url.netloc, timeout=30)
    connection.request("GET", "/")
    assert connection.getresponse().status == 200


@pytest.mark.parametrize(("key", "text"), [
    ("other.pem", f"cannot use the certificate {CERTIFICATES}/cert.pem"),
    ("/dev/null", "cannot use the key /dev/null: it is not a regular file"),
])  # fmt: skip
def test_a_key_of_another_certificate_is_refused(ros: RosSystem, tmp_path: Path, key: str, text: str) -> None:
    (tmp_path / "other.pem").write_text("")
    ros.serve_master()
    done = ros.pipros.run(
        "rqt_graph", "--no-browser", "--cert", CERTIFICATES / "cert.pem", "--key", tmp_path / key
    )
    assert done.returncode == 1
    assert text in done.output
