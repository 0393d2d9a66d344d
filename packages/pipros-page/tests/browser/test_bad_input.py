"""The page while the system misbehaves: it reports the fault, stays alive, and recovers."""

import re
import socket
import sys
from pathlib import Path
from xmlrpc.client import MultiCall, ServerProxy

from playwright.sync_api import expect

from tests.browser.chromium import OpenTab
from tests.support.page import Page
from tests.support.ros import RosSystem

TOPICS = 10_000
LARGE = """
import rospy
from std_msgs.msg import UInt8MultiArray
rospy.init_node("large")
publisher = rospy.Publisher("/large", UInt8MultiArray, queue_size=1, latch=True)
message = UInt8MultiArray(data=bytes(range(250)) * 400_000)
rate = rospy.Rate(2)
while not rospy.is_shutdown():
    publisher.publish(message)
    rate.sleep()
"""
MARKUP = "<img src=x onerror=document.title=1><b>bold</b>"
HOSTILE = f"""
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import Image
from tf2_msgs.msg import TFMessage
evil = "{MARKUP}"
rospy.init_node("evil")
images = rospy.Publisher("/evil/image", Image, queue_size=1)
frames = rospy.Publisher("/tf", TFMessage, queue_size=1)
diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=1)
rospy.set_param("/evil", {{"text": evil, "inner": {{evil: evil}}}})
image = Image(width=1, height=1, step=3, encoding="rgb8", data=b"abc")
image.header.frame_id = evil
frame = TransformStamped(child_frame_id=evil)
frame.header.frame_id = "map" + evil
frame.transform.rotation.w = 1.0
status = DiagnosticStatus(name=evil, message=evil, hardware_id=evil, values=[KeyValue(evil, evil)])
rate = rospy.Rate(5)
while not rospy.is_shutdown():
    images.publish(image)
    frames.publish(TFMessage([frame]))
    diagnostics.publish(DiagnosticArray(status=[status]))
    rospy.logwarn(evil)
    rate.sleep()
"""


def test_a_vanished_master_is_reported_and_found_again(ros: RosSystem, open_tab: OpenTab) -> None:
    core = ros.pipros.start_bare_master()
    page = Page(ros)
    graph, topics = open_tab(page, "graph"), open_tab(page, "topics")
    words = "The master does not answer"
    for tab in (graph, topics):
        expect(tab.locator("#system")).to_contain_text("read-only")
    core.kill()
    core.wait()
    for tab in (graph, topics):
        expect(tab.locator(".error[role=alert]")).to_contain_text(words)
    ros.serve_master()
    ros.pipros.start("rostopic", "pub", "-r", "5", "/level", "std_msgs/String", "x", "__name:=talker")
    ros.pipros.start("rostopic", "echo", "/level", "__name:=listener")
    for tab in (graph, topics):
        expect(tab.locator(".error[role=alert]")).to_be_hidden()
        expect(tab.locator("#system [role=alert]")).to_have_count(0)
    expect(topics.locator("tr[data-name='/level']")).to_contain_text("/talker")
    expect(graph.locator('[data-key="topic:/level"]')).to_be_visible()


def test_a_topic_of_an_unknown_type_is_shown(ros: RosSystem, open_tab: OpenTab, tmp_path: Path) -> None:
    ros.serve_master()
    package = tmp_path / "far" / "far_msgs"
    (package / "msg").mkdir(parents=True)
    (package / "package.xml").write_text(
        "<package><name>far_msgs</name><version>1.0.0</version><description>x</description>"
        "<maintainer email='a@b.org'>a</maintainer><license>x</license></package>"
    )
    (package / "msg" / "Wheel.msg").write_text("float64[] speeds\nstring name\n")
    ros.pipros.start(
        *("rostopic", "pub", "-r", "10", "/wheel", "far_msgs/Wheel", "{speeds: [0.5, 1.5], name: left}"),
        ROS_PACKAGE_PATH=str(tmp_path / "far"),
    )
    ros.wait_for_publisher("/wheel")
    tab = open_tab(Page(ros), "topics/%2Fwheel")
    expect(tab.locator("aside .message")).to_contain_text('speeds: [0.5, 1.5]name: "left"')
    expect(tab.locator("aside dl")).to_contain_text("far_msgs/Wheel")


def test_a_node_that_never_answers_does_not_delay_the_page(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    with socket.create_server(("127.0.0.1", 0), backlog=200) as silent, ServerProxy(ros.master_uri) as master:
        uri = f"http://127.0.0.1:{silent.getsockname()[1]}/"
        for topic in ("/silent", "/level"):
            master.registerPublisher("/stuck", topic, "std_msgs/String", uri)
        master.registerService("/stuck", "/stuck/call", uri.replace("http", "rosrpc"), uri)
        ros.pipros.start("rostopic", "pub", "-r", "10", "/level", "std_msgs/String", "x", "__name:=talker")
        ros.pipros.start("rostopic", "echo", "/level", "__name:=listener").wait_for("x")
        page = Page(ros)
        graph = open_tab(page, "graph/topic:/level")
        expect(graph.locator("aside .message")).to_contain_text("x")
        expect(graph.locator('[data-key="node:/listener"]')).to_be_visible()
        nodes = open_tab(page, "nodes")
        expect(nodes.locator("tr", has_text="/stuck")).to_contain_text("does not answer")
        expect(nodes.locator("tr", has_text="/talker")).to_contain_text("answers")
        topic = open_tab(page, "topics/%2Fsilent")
        expect(topic.locator("aside .message")).to_contain_text("none received yet")
        service = open_tab(page, "services/%2Fstuck%2Fcall")
        expect(service.locator("aside .error")).not_to_be_empty()
        other = open_tab(page, "topics/%2Flevel")
        expect(other.locator("aside .message")).to_contain_text("x")


def test_a_message_of_100_megabytes_is_shortened(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    ros.pipros.start(sys.executable, "-c", LARGE)
    ros.pipros.start("rostopic", "pub", "-r", "10", "/level", "std_msgs/String", "x")
    for topic in ("/large", "/level"):
        ros.wait_for_publisher(topic)
    page = Page(ros)
    tab = open_tab(page, "topics/%2Flarge")
    expect(tab.locator("aside .message")).to_contain_text("data: 100.0 MB: 00 01 02", timeout=60_000)
    expect(tab.locator("aside dl")).to_contain_text(re.compile(r"Messages([3-9]|\d\d)"), timeout=60_000)
    tab.locator("tr[data-name='/level']").click()
    expect(tab.locator("aside .message")).to_contain_text("x")
    status = Path(f"/proc/{page.process.pid}/status").read_text()
    peak_mb = int(re.findall(r"VmHWM:\s*(\d+) kB", status)[0]) / 1000
    print(f"largest memory of the server: {peak_mb:.0f} MB")
    assert peak_mb < 900


def test_ten_thousand_topics_are_read_and_not_drawn(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    with ServerProxy(ros.master_uri) as master:
        calls = MultiCall(master)
        for number in range(TOPICS):
            calls.registerPublisher(
                f"/n{number % 50}", f"/t{number}", "std_msgs/String", "http://127.0.0.1:9/"
            )
        list(calls())
    page = Page(ros)
    tab = open_tab(page, "graph")
    tab.get_by_label("What is shown").select_option("all")
    tab.get_by_role("button", name="Filters").click()
    for name in ("Dead sinks", "Leaf topics"):
        tab.get_by_label(name).uncheck()
    expect(tab.locator("#view")).to_contain_text("nodes and topics match, and at most 3000 are drawn")
    expect(tab.locator(".corner")).to_contain_text("10000 topics")
    tab.get_by_label("Topics", exact=True).fill("/t7, /t9*, -/t99*")
    tab.get_by_label("Topics", exact=True).press("Enter")
    expect(tab.locator('[data-key="topic:/t7"]')).to_be_attached()
    tab = open_tab(page, "topics")
    expect(tab.locator("tbody")).to_contain_text("9500 more: filter to see them.")
    tab.get_by_label("Filter topics").fill("/t1234")
    expect(tab.locator("tbody tr")).to_have_count(1)


TABS = {
    "topics/%2Fevil%2Fimage": "aside .message", "console": ".log", "params": ".params",
    "images/%2Fevil%2Fimage": ".bar", "tf": "table", "diagnostics": ".params",
}  # fmt: skip


def test_markup_stays_text(ros: RosSystem, open_tab: OpenTab) -> None:
    """All tabs show one system, because starting it takes longer than most of them."""
    ros.pipros.start_master()
    ros.pipros.start(sys.executable, "-c", HOSTILE)
    ros.wait_for_publisher("/evil/image")
    page = Page(ros)
    for place, where in TABS.items():
        tab = open_tab(page, place)
        expect(tab.locator(where).first).to_contain_text(MARKUP)
        if place == "diagnostics":
            tab.locator(".tree button.plain").first.click()
            expect(tab.locator("aside h2")).to_have_text(MARKUP)
        assert tab.locator("#view img, #view b:not(.swatch)").count() == 0, place
        assert tab.title().startswith("pipros: ")
        tab.context.close()


DEEP = """
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
rospy.init_node("deep")
publisher = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=1, latch=True)
names = "a/" * 12000, "plain"
publisher.publish(DiagnosticArray(status=[DiagnosticStatus(name=name) for name in names]))
rospy.spin()
"""


def test_a_diagnostic_name_of_many_parts_leaves_the_others_visible(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    ros.pipros.start(sys.executable, "-c", DEEP)
    ros.wait_for_publisher("/diagnostics")
    tab = open_tab(Page(ros), "diagnostics")
    expect(tab.get_by_role("button", name="plain")).to_be_visible()
    expect(tab.locator(".tree details")).to_have_count(49)


OTHER_DEFINITION = """
import sys
import rospy
from pipros.msg.dynamic import message_classes_from_text
rospy.init_node("liar")
publishers = []
for topic, name in zip(sys.argv[1::2], sys.argv[2::2]):
    cls = message_classes_from_text(name, "string[] transforms\\n")[name]
    publishers.append(rospy.Publisher(topic, cls, queue_size=1))
rate = rospy.Rate(10)
while not rospy.is_shutdown():
    for publisher in publishers:
        publisher.publish(publisher.data_class(["x"]))
    rate.sleep()
"""
LIES = {
    "tf": ("/tf", "tf2_msgs/TFMessage"), "diagnostics": ("/diagnostics", "diagnostic_msgs/DiagnosticArray"),
    "console": ("/rosout_agg", "rosgraph_msgs/Log"), "images/%2Fimage": ("/image", "sensor_msgs/Image"),
}  # fmt: skip
"""Tabs, and the topics that they show, with the names of their types."""


def test_another_definition_is_shown_in_the_tab(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    ros.pipros.start(sys.executable, "-c", OTHER_DEFINITION, *(word for lie in LIES.values() for word in lie))
    for topic, _ in LIES.values():
        ros.wait_for_publisher(topic)
    page = Page(ros)
    for place in LIES:
        tab = open_tab(page, place)
        expect(tab.get_by_role("alert").filter(has_text="/liar publishes").first).to_be_visible()
        tab.context.close()
