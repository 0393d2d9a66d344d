"""Genuine rospy, roscpp, C++ `rosbag record` and nodes of pipros share a topic over all transports."""

from typing import Any
from xmlrpc.client import ServerProxy

from pipros_tools.bag.reader import BagReader
from tests.support.processes import Process
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

PUBLISH = """
import sys, rospy
from sensor_msgs.msg import Image
rospy.init_node(sys.argv[1])
publisher = rospy.Publisher(sys.argv[2], Image, queue_size=10)
rate, number = rospy.Rate(10), 0
while not rospy.is_shutdown():
    data = bytes([number % 256]) * (300000 if number % 4 else 100)
    publisher.publish(Image(width=number, encoding=sys.argv[1], data=data))
    number += 1
    rate.sleep()
"""

SUBSCRIBE = """
import sys, rospy
from sensor_msgs.msg import Image
rospy.init_node(sys.argv[1])
last, seen = {}, {}
def check(image):
    name = image.encoding
    assert image.width > last.get(name, -1), (name, image.width, last)
    assert bytes(image.data) == bytes([image.width % 256]) * len(image.data), name
    assert len(image.data) == (300000 if image.width % 4 else 100)
    last[name] = image.width
    seen[name] = seen.get(name, 0) + 1
    if seen[name] == 20:
        print("intact", name, flush=True)
def guarded(image):
    try:
        check(image)
    except AssertionError as error:
        print("WRONG", error, flush=True)
options = {"zero_copy": True} if sys.argv[2:] else {}
rospy.Subscriber("images", Image, guarded, **options)
rospy.spin()
"""

PUBLISHERS = ("by_pipros", "by_tcp", "by_rospy", "by_roscpp")


def transports(ros: RosSystem, node: str) -> list[str]:
    """Return the transports of a node's links on the topic, as it reports them."""
    with ServerProxy(ros.master_uri) as opened:
        master: Any = opened
        uri = master.lookupNode("/a_test", node)[2]
    with ServerProxy(uri) as slave:
        rows: Any = slave.getBusInfo("/a_test")
    return sorted(row[3] for row in rows[2] if row[4] == "/images")


def test_all_kinds_of_nodes_get_all_messages_intact_and_in_order(ros: RosSystem) -> None:
    ros.serve_master()
    publish, subscribe = ros.home / "publish.py", ros.home / "subscribe.py"
    publish.write_text(PUBLISH)
    subscribe.write_text(SUBSCRIBE)
    python = "/usr/bin/python3"
    subscribers: list[Process] = [
        ros.pipros.start("python", subscribe, "to_pipros"),
        ros.pipros.start("python", subscribe, "to_views", "zero_copy"),
        ros.pipros.start("python", subscribe, "to_tcp", PIPROS_LOCAL="off"),
        ros.pipros.start("python", subscribe, "to_streams", PIPROS_SHARED_MEMORY="off"),
        ros.genuine.start(python, subscribe, "to_rospy"),
    ]
    recorder = ros.genuine.start(
        "rosbag", "record", "-O", ros.home / "all.bag", "/images", "__name:=recorder"
    )
    ros.genuine.start_node("topic_tools", "relay", "source", "images", "__name:=relay")
    for subscriber in ("/to_pipros", "/to_views", "/to_tcp", "/to_streams", "/to_rospy", "/recorder"):
        wait_until(lambda: subscriber in ros.subscribers("/images"), 60, subscriber)  # noqa: B023
    ros.wait_for_subscriber("/source")
    ros.pipros.start("python", publish, "by_pipros", "images")
    ros.pipros.start("python", publish, "by_tcp", "images", PIPROS_LOCAL="off")
    ros.genuine.start(python, publish, "by_rospy", "images")
    ros.pipros.start("python", publish, "by_roscpp", "source")
    for subscriber in subscribers:
        for name in PUBLISHERS:
            subscriber.wait_for(f"^intact {name}$", timeout_s=120)
        assert "WRONG" not in subscriber.output
    assert transports(ros, "/by_pipros") == 3 * ["PIPROSLOCAL"] + 3 * ["TCPROS"]
    assert transports(ros, "/to_pipros") == ["PIPROSLOCAL", "TCPROS", "TCPROS", "TCPROS"]
    assert transports(ros, "/by_tcp") == 6 * ["TCPROS"]
    info = ros.pipros.run("rosnode", "info", "by_pipros").output
    assert "    * transport: PIPROSLOCAL" in info
    assert "    * shared memory: " in info

    recorder.press_ctrl_c()
    assert recorder.wait() == 0
    recorded: dict[str, list[int]] = {}
    with BagReader(ros.home / "all.bag") as bag:
        for _, image, _, _ in bag.messages():
            assert image.data == bytes([image.width % 256]) * len(image.data)
            recorded.setdefault(image.encoding, []).append(image.width)
    assert set(recorded) == set(PUBLISHERS)
    for widths in recorded.values():
        assert widths == list(range(widths[0], widths[0] + len(widths)))
