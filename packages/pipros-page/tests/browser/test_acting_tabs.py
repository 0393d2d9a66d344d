"""Actions, steering and expressions: the tabs that make a robot move, and stop it."""

import itertools
import json
import re
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from playwright.sync_api import Page as Tab
from playwright.sync_api import WebSocketRoute, expect

from pipros_libraries.actions.status import Status
from pipros_server.approvals import Approvals, Question
from pipros_server.policy.model import ActRefused
from tests.browser.chromium import OpenTab, go_to, keep_screenshots
from tests.support.genuine import missing_packages
from tests.support.page import LivePage, Page
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

ROBOT = Path(__file__).parent / "programs" / "robot_program.py"
SESSION = {"session": "test", "linear": 0.5, "angular": 1.0}


LISTENER = """
import rospy
from geometry_msgs.msg import Twist
rospy.init_node("turtle")
rospy.Subscriber("/turtle1/cmd_vel", Twist, lambda _: None)
rospy.spin()
"""


@pytest.fixture
def system(ros: RosSystem) -> RosSystem:
    ros.serve_master()
    return ros


@pytest.fixture
def fibonacci(system: RosSystem) -> RosSystem:
    system.pipros.start("rosrun", "actionlib_tutorials", "fibonacci_server")
    system.wait_for_publisher("/fibonacci/status")
    return system


@pytest.fixture
def speeds(system: RosSystem) -> Process:
    """Print the velocity commands."""
    return system.pipros.start("rostopic", "echo", "-p", "/cmd_vel")


def speeds_of(process: Process) -> list[float]:
    """Return the commanded speeds so far."""
    rows = [row.split(",") for row in process.output.splitlines() if row[:1].isdigit()]
    return [float(row[1]) for row in rows]


def test_a_goal_is_sent_followed_and_cancelled(fibonacci: RosSystem, open_tab: OpenTab) -> None:
    tab = open_tab(Page(fibonacci, "--control"), "actions//fibonacci")
    row = tab.locator("tr[data-name='/fibonacci']")
    expect(row).to_contain_text("actionlib_tutorials/FibonacciAction")
    goal = tab.get_by_label("Goal in YAML")
    expect(goal).to_have_value("order: 0")
    for part in ("status", "feedback", "result"):
        fibonacci.wait_for_links(f"/fibonacci/{part}")
    goal.fill("order: 3")
    tab.get_by_role("button", name="Send goal").click()
    side = tab.get_by_role("complementary", name="Action")
    expect(side).to_contain_text("sequence: [0, 1, 1")
    expect(side.locator(".state-succeeded")).to_be_visible()
    expect(side).to_contain_text(re.compile(r"Newest result.*sequence: \[0, 1, 1, 2\]"))
    goal.fill("order: 300")
    tab.get_by_role("button", name="Send goal").click()
    expect(side.locator(".state-open")).to_have_text("active")
    keep_screenshots(tab, "actions")
    tab.get_by_role("button", name="Cancel /").click()
    expect(side.locator(".state-preempted")).to_be_visible()


def limited(system: RosSystem, folder: Path) -> Page:
    """Serve a page with a policy that sets a time limit for goals."""
    policy = folder / "policy.yaml"
    policy.write_text(
        "actions:\n"
        "  /fibonacci: {type: actionlib_tutorials/FibonacciAction, fields: any, time_limit_s: 600}\n"
    )
    return Page(system, "--control", "--policy", str(policy))


def echo(system: RosSystem, part: str) -> Process:
    """Print one line for each message on a topic of the action, from now on."""
    process = system.pipros.start("rostopic", "echo", "-p", f"/fibonacci/{part}/status/status")
    system.wait_for_links(f"/fibonacci/{part}")
    return process


def test_a_goal_with_a_time_limit_goes_on_until_the_page_leaves_the_action(
    fibonacci: RosSystem, open_tab: OpenTab, tmp_path: Path
) -> None:
    results = echo(fibonacci, "result")
    page = limited(fibonacci, tmp_path)
    tab = open_tab(page, "actions//fibonacci")
    side = tab.get_by_role("complementary", name="Action")
    for order, state in (("3", "succeeded"), ("300", "open")):
        tab.get_by_label("Goal in YAML").fill(f"order: {order}")
        tab.get_by_role("button", name="Send goal").click()
        expect(side.locator(f".state-{state}")).to_be_visible()
    other = open_tab(page, "actions//fibonacci")
    expect(other.locator(".state-open")).to_have_text("active")
    tab.close()
    expect(other.get_by_role("button", name="Send goal")).to_be_enabled()
    expect(other.locator(".state-open")).to_have_text("active")
    assert Status.PREEMPTED not in statuses(results)
    other.goto("about:blank")
    wait_until(lambda: len(statuses(results)) == 2, 60, "the end of the goal")  # listed by the server for 5 s
    assert statuses(results) == [Status.SUCCEEDED, Status.PREEMPTED]


def statuses(process: Process) -> list[int]:
    """Return the goal statuses that `echo` has printed."""
    return [int(line.split(",")[1]) for line in process.output.splitlines() if line[:1].isdigit()]


def test_a_page_that_learns_the_type_of_its_action_loses_neither_goal_nor_text(
    fibonacci: RosSystem, open_tab: OpenTab, tmp_path: Path
) -> None:
    release: list[Callable[[], object]] = []

    def forward(socket: WebSocketRoute) -> None:
        """Forward all requests but that of the list of actions, as if the first observation never ended."""
        server = socket.connect_to_server()

        def pass_on(text: str | bytes) -> None:
            if '"actions"' in str(text):
                release.append(lambda: server.send(text))
            else:
                server.send(text)

        socket.on_message(pass_on)

    feedback = echo(fibonacci, "feedback")
    page = limited(fibonacci, tmp_path)
    with page.connect() as first:
        next(first.watch("action", name="/fibonacci"))
        kind = "actionlib_tutorials/FibonacciActionGoal"
        assert "id" in first.act("send_goal", name="/fibonacci", type=kind, goal="order: 300")
        tab = open_tab(page, "topics")
        tab.route_web_socket("**/live", forward)
        tab.reload()
        tab.evaluate("location.hash = 'actions//fibonacci'")
        expect(tab.locator(".state-open")).to_have_text("active")
        expect(tab.get_by_role("button", name="Send goal")).to_be_disabled()
        tab.get_by_label("Goal in YAML").fill("order: 7")
        first.socket.send(json.dumps({"id": 1, "stop": True}))
        first.act("message", type="actionlib_tutorials/FibonacciGoal")  # answered after the stop
        release.pop()()
        expect(tab.get_by_role("button", name="Send goal")).to_be_enabled()
    so_far = len(statuses(feedback))
    wait_until(lambda: len(statuses(feedback)) >= so_far + 4, 60, "the feedback of a goal that goes on")
    expect(tab.locator(".state-open")).to_have_text("active")
    expect(tab.get_by_label("Goal in YAML")).to_have_value("order: 7")


SERVER = """
import actionlib, rospy
from actionlib.msg import TestAction, TestFeedback, TestResult

def run(goal):
    server.publish_feedback(TestFeedback(feedback=goal.goal + 1))
    rate = rospy.Rate(20)
    while not server.is_preempt_requested() and not rospy.is_shutdown():
        rate.sleep()
    server.set_preempted(TestResult(result=goal.goal + 2))

rospy.init_node("gripper")
server = actionlib.SimpleActionServer("grip", TestAction, run, auto_start=False)
server.start()
rospy.spin()
"""


def test_a_goal_of_genuine_actionlib_is_followed_and_cancelled(system: RosSystem, open_tab: OpenTab) -> None:
    if missing_packages():
        system.pipros.start(sys.executable, "-c", SERVER)
    else:
        system.genuine.start("/usr/bin/python3", "-c", SERVER)
    system.wait_for_publisher("/grip/status")
    tab = open_tab(Page(system, "--control"), "actions//grip")
    goal = tab.get_by_label("Goal in YAML")
    expect(goal).to_have_value("goal: 0")
    for part in ("status", "feedback", "result"):
        system.wait_for_links(f"/grip/{part}")
    goal.fill("goal: 40")
    tab.get_by_role("button", name="Send goal").click()
    side = tab.get_by_role("complementary", name="Action")
    expect(side).to_contain_text("feedback: 41")
    tab.get_by_role("button", name="Cancel all").click()
    expect(side.locator(".state-preempted")).to_be_visible()
    expect(side).to_contain_text("result: 42")


def test_goals_need_control_and_a_server(fibonacci: RosSystem, open_tab: OpenTab) -> None:
    page = Page(fibonacci)
    tab = open_tab(page, "actions//fibonacci")
    expect(tab.get_by_role("button", name="Send goal")).to_be_disabled()
    with page.connect() as browser:
        for action in ("send_goal", "cancel_goal"):
            assert "read-only" in browser.act(action, name="/fibonacci")["error"]
    kind = "actionlib_tutorials/FibonacciActionGoal"
    with Page(fibonacci, "--control").connect() as browser:
        answer = browser.act("send_goal", name="/nobody", type=kind, goal="order: 1")
        assert "no action server subscribed to /nobody/goal" in answer["error"]
        answer = browser.act("send_goal", name="/fibonacci", type=kind, goal="disorder: 1")
        assert "disorder" in answer["error"]


def test_the_keys_steer_and_letting_go_stops(system: RosSystem, speeds: Process, open_tab: OpenTab) -> None:
    tab = open_tab(Page(system, "--control"), "teleop")
    tab.get_by_label("Highest speed in m/s").fill("0.25")
    tab.get_by_role("button", name="Start").click()
    expect(tab.locator(".figures")).to_contain_text("1 subscriber")
    tab.keyboard.down("ArrowUp")
    wait_until(lambda: 0.25 in speeds_of(speeds), 30, "the commanded speed")
    keep_screenshots(tab, "teleop")
    tab.keyboard.up("ArrowUp")
    wait_until(lambda: speeds_of(speeds)[-1] == 0.0, 30, "the command that stops the robot")
    assert set(speeds_of(speeds)) == {0.25, 0.0}


def test_the_stick_steers_under_a_finger(system: RosSystem, speeds: Process, open_tab: OpenTab) -> None:
    tab = open_tab(Page(system, "--control"), "teleop", size=(390, 800))
    tab.get_by_role("button", name="Start").click()
    expect(tab.locator(".figures")).to_contain_text("1 subscriber")
    box = tab.locator(".stick").bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    session = tab.context.new_cdp_session(tab)
    for kind, at in (("touchStart", y), ("touchMove", y - 10), ("touchMove", box["y"])):
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x, "y": at}]})
    wait_until(lambda: 0.5 in speeds_of(speeds), 30, "the highest speed")
    session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    wait_until(lambda: speeds_of(speeds)[-1] == 0.0, 30, "the command that stops the robot")


def test_leaving_the_tab_stops_the_robot(system: RosSystem, speeds: Process, open_tab: OpenTab) -> None:
    tab = open_tab(Page(system, "--control"), "teleop")
    tab.get_by_role("button", name="Start").click()
    expect(tab.locator(".figures")).to_contain_text("1 subscriber")
    tab.keyboard.down("w")
    wait_until(lambda: 0.5 in speeds_of(speeds), 30, "the commanded speed")
    go_to(tab, "Console")
    wait_until(lambda: speeds_of(speeds)[-1] == 0.0, 30, "the command that stops the robot")
    go_to(tab, "Teleop")
    expect(tab.get_by_role("button", name="Start")).to_be_visible()


def steer_until(browser: LivePage, process: Process, wanted: float, commanded: float) -> None:
    """Steer until the robot gets a speed: a server that stalls does not publish an old command."""

    def is_commanded() -> bool:
        assert browser.act("steer", session="test", linear=wanted, angular=0.0) == {}
        return commanded in speeds_of(process)

    wait_until(is_commanded, 30, f"the speed {commanded}")


def test_a_silent_browser_stops_the_robot_once(system: RosSystem, speeds: Process) -> None:
    with Page(system, "--control").connect() as browser:
        state = browser.watch("teleop", name="/cmd_vel", **SESSION)
        wait_until(lambda: next(state)["listeners"] == 1, 30, "the subscribers")
        steer_until(browser, speeds, 9.0, 0.5)  # the limit of the session
        wait_until(lambda: speeds_of(speeds)[-1] == 0.0, 30, "the command that stops the robot")
        steer_until(browser, speeds, 0.2, 0.2)
    wait_until(lambda: speeds_of(speeds)[-1] == 0.0, 30, "the command after the end of the connection")
    found = speeds_of(speeds)
    assert (0.0, 0.0) not in itertools.pairwise(found)
    assert max(found) == 0.5


def test_the_end_of_the_server_stops_the_robot(system: RosSystem, speeds: Process) -> None:
    page = Page(system, "--control")
    with page.connect() as browser:
        state = browser.watch("teleop", name="/cmd_vel", **SESSION)
        wait_until(lambda: next(state)["listeners"] == 1, 30, "the subscribers")
        steer_until(browser, speeds, 0.4, 0.4)
        page.process.press_ctrl_c()
    wait_until(lambda: speeds_of(speeds)[-1] == 0.0, 30, "the command that stops the robot")


def test_a_camera_is_shown_beside_the_stick(system: RosSystem, open_tab: OpenTab) -> None:
    tab = open_tab(Page(system, "--control"), "teleop")
    expect(tab.locator(".tab-teleop")).to_contain_text("No camera to show beside the stick.")
    system.pipros.start(sys.executable, ROBOT, "robot")
    expect(tab.get_by_role("img", name="Camera")).to_be_visible()
    stick, picture = tab.locator(".stick").bounding_box(), tab.locator(".beside").bounding_box()
    assert stick is not None
    assert picture is not None
    assert stick["x"] + stick["width"] <= picture["x"]
    assert picture["x"] + picture["width"] == pytest.approx(1200, abs=1)


def test_steering_needs_control_and_a_session(system: RosSystem, open_tab: OpenTab) -> None:
    page = Page(system)
    tab = open_tab(page, "teleop")
    expect(tab.get_by_role("button", name="Start")).to_be_disabled()
    expect(tab.get_by_label("Topic", exact=True)).to_have_value("/cmd_vel")
    system.pipros.start(sys.executable, "-c", LISTENER)
    expect(tab.get_by_label("Topic", exact=True)).to_have_value("/turtle1/cmd_vel")
    with page.connect() as browser:
        assert "read-only" in browser.act("steer", session="x", linear=1, angular=0)["error"]
        assert "read-only" in next(browser.watch("teleop", name="/cmd_vel", **SESSION))["error"]
    with Page(system, "--control").connect() as browser:
        assert "has ended" in browser.act("steer", session="x", linear=1, angular=0)["error"]
        endless = next(browser.watch("teleop", name="/cmd_vel", session="x", linear="1", angular=0))
        assert "linear must be a finite number" in endless["error"]


def publish(tab: Tab, text: str) -> None:
    tab.get_by_label("Topic", exact=True).fill("/wave")
    tab.get_by_label("Type", exact=True).fill("std_msgs/Float64")
    tab.get_by_label("Type", exact=True).press("Tab")
    message = tab.get_by_label("Message in YAML")
    expect(message).to_have_value("data: 0")
    message.fill(text)
    tab.get_by_label("Rate in hertz").fill("2")
    tab.get_by_role("button", name="Publish", exact=True).click()


def test_expressions_of_count_and_time_are_published(system: RosSystem, open_tab: OpenTab) -> None:
    tab = open_tab(Page(system, "--control"), "publish")
    publish(tab, "data: =2.0 * i")
    rows = system.pipros.run("rostopic", "echo", "-n3", "/wave/data").stdout
    first, second, third = (float(row) for row in rows if row[:1].isdigit())
    assert (second - first, third - second) == (2.0, 2.0)
    tab.get_by_label("Message in YAML").fill("data: =unknown(t)")
    tab.get_by_role("button", name="Publish", exact=True).click()
    expect(tab.locator(".tab-publish .error")).to_contain_text("unknown")


def test_diagnostics_list_errors_first_with_letters(system: RosSystem, open_tab: OpenTab) -> None:
    system.pipros.start(sys.executable, ROBOT, "robot")
    tab = open_tab(Page(system), "diagnostics")
    rows = tab.get_by_role("grid", name="Problems").locator("tbody tr")
    expect(rows).to_have_count(2)
    expect(rows.nth(0)).to_have_attribute("data-name", "/Motors/right")
    expect(rows.nth(0)).to_contain_text("Error")
    expect(rows.nth(0).locator(".dot")).to_have_text("E")
    expect(rows.nth(1).locator(".dot")).to_have_text("W")
    keep_screenshots(tab, "diagnostics")
    rows.nth(1).click()
    expect(tab.get_by_role("complementary", name="Component")).to_contain_text("/Motors/left")


FLEET = """
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
rospy.init_node("agent")
diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=1)
received = 0
while not rospy.is_shutdown():
    received += 10
    values = {"topics received": "3", "messages": str(received), "lost": "7", "malformed": "0"}
    from_robot = [KeyValue(*each) for each in values.items()]
    link = [KeyValue("sent", "0"), KeyValue("dropped", "4")]
    diagnostics.publish(DiagnosticArray(status=[
        DiagnosticStatus(0, "/Fleet/operator", "connected", "", link),
        DiagnosticStatus(1, "/Fleet/operator/robot1", "7 lost recently", "", from_robot),
        DiagnosticStatus(0, "/Motors/left", "fine", "", link),
    ]))
    rospy.sleep(0.2)
"""


def test_the_fleet_has_links_members_rates_and_losses(system: RosSystem, open_tab: OpenTab) -> None:
    tab = open_tab(Page(system), "fleet")
    expect(tab.locator(".tab-fleet .note")).to_contain_text("pipros fleet join")
    system.pipros.start(sys.executable, "-c", FLEET)
    rows = tab.get_by_role("table", name="Fleet").locator("tbody tr:not(.more)")
    expect(rows).to_have_count(2)
    expect(rows.nth(0)).to_have_text(re.compile(r"operator.*connected.*4"))
    expect(rows.nth(1)).to_have_text(re.compile(r"operator.*robot1.*7 lost recently.*3"))
    # messages per second
    expect(rows.nth(1).locator("td").nth(4)).to_have_text(re.compile(r"^[1-9]\d*\.\d$"))
    expect(tab.locator(".tab-fleet .note")).to_be_hidden()


GATEWAY = """
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
rospy.init_node("gateway")
diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=1)
values = [
    KeyValue("topics: to_ros2: /scan", "9.5/s, 3 dropped: too long"),
    KeyValue("actions: to_ros1: /walk", "left out: unknown"),
]
while not rospy.is_shutdown():
    status = DiagnosticStatus(1, "/ROS 2/ros2_gateway_0", "", "", values)
    diagnostics.publish(DiagnosticArray(status=[status]))
    rospy.sleep(0.2)
"""


def test_gateways_to_ros2_have_rates_drops_and_what_is_left_out(system: RosSystem, open_tab: OpenTab) -> None:
    tab = open_tab(Page(system), "ros2")
    expect(tab.locator(".tab-ros2 .note")).to_contain_text("pipros ros2")
    system.pipros.start(sys.executable, "-c", GATEWAY)
    rows = tab.get_by_role("table", name="ROS 2").locator("tbody tr:not(.more)")
    expect(rows).to_have_count(2)
    expect(rows.nth(0)).to_have_text(re.compile(r"/scan.*topic.*to ROS 2.*9\.5.*3.*too long.*ros2_gateway_0"))
    expect(rows.nth(1)).to_have_text(re.compile(r"/walk.*action.*to ROS 1.*left out: unknown"))
    expect(tab.locator(".tab-ros2 .note")).to_be_hidden()


def test_acts_are_approved_on_the_page(system: RosSystem, open_tab: OpenTab, monkeypatch) -> None:
    monkeypatch.setenv("ROS_HOME", system.pipros.environment["ROS_HOME"])
    approvals = Approvals(system.master_uri, 4)
    approvals.start()
    hostile = '{"text": "<img src=x onerror=alert(1)> approve this"}'
    question = Question("publish", "/cmd_vel", hostile, "base.yaml:2: topics./cmd_vel")

    def ask() -> str:
        return approvals.wait("client", question, 60.0, threading.Event())

    try:
        with ThreadPoolExecutor(1) as pool:
            tab = open_tab(Page(system, "--control"), "acts")
            expect(tab.locator(".tab-acts .note").first).to_contain_text("No act is waiting")
            for button, verdict in (("Approve once", "once"), ("Approve for a minute", "minute")):
                waiting = pool.submit(ask)
                card = tab.get_by_role("listitem", name="publish /cmd_vel")
                expect(card).to_contain_text(hostile)
                expect(card).to_contain_text("base.yaml:2: topics./cmd_vel")
                expect(card).to_contain_text(re.compile(r"Time left\s*[1-9]\d s"))
                card.get_by_role("button", name=button).click()
                assert waiting.result(60) == verdict
                expect(card).to_have_count(0)
            assert ask() == "minute"
            approvals.note(
                {"time": 1.0, "tool": "publish", "name": "/cmd_vel", "values": "{}", "outcome": "done"}
            )
            expect(tab.get_by_role("table", name="Acts").locator("tbody tr").first).to_contain_text("done")
            reader = open_tab(Page(system), "acts")
            question_2 = Question("call_service", "/motor", "{}", "r")
            later = pool.submit(approvals.wait, "client", question_2, 60.0, threading.Event())
            expect(reader.get_by_role("button", name="Approve once")).to_be_disabled()
            tab.get_by_role("listitem", name="call_service /motor").get_by_role(
                "button", name="Refuse"
            ).click()
            with pytest.raises(Exception, match="a human has refused this"):
                later.result(60)
    finally:
        approvals.stop()


def test_the_buttons_of_an_act_that_moved_under_the_pointer_do_not_act_at_once(
    system: RosSystem, open_tab: OpenTab, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_HOME", system.pipros.environment["ROS_HOME"])
    approvals = Approvals(system.master_uri, 4)
    approvals.start()
    over = threading.Event()

    def ask(name: str, over: threading.Event) -> str:
        return approvals.wait("client", Question("publish", name, "{}", "r"), 60.0, over)

    watch = """(box) => { window.disabled = null; new MutationObserver(() => {
        window.disabled = [...box.querySelectorAll("button")].map((each) => each.disabled);
    }).observe(box, { childList: true }); }"""
    try:
        with ThreadPoolExecutor(2) as pool:
            tab = open_tab(Page(system, "--control"), "acts")
            first = pool.submit(ask, "/one", over)
            expect(tab.get_by_role("listitem", name="publish /one")).to_be_visible()
            second = pool.submit(ask, "/two", threading.Event())
            card = tab.get_by_role("listitem", name="publish /two")
            button = card.get_by_role("button", name="Approve once")
            expect(button).to_be_enabled()
            tab.locator(".waiting").evaluate(watch)
            over.set()
            with pytest.raises(ActRefused):
                first.result(60)
            expect(tab.get_by_role("listitem", name="publish /one")).to_have_count(0)
            assert tab.locator(".waiting").evaluate("() => window.disabled") == [True, True, True]
            button.click()
            assert second.result(60) == "once"
            expect(tab.locator(".tab-acts").get_by_role("status").last).to_contain_text("publish /two")
    finally:
        approvals.stop()
