"""Responses of nodes to valid and invalid XML-RPC calls, and to topic and service connections."""

import re
import socket
import struct
from typing import Any
from xmlrpc.client import ServerProxy

from pipros.master.master import Master
from pipros.wire.header import decode_header, encode_header
from tests.support.ros import RosSystem, Side
from tests.support.waiting import wait_until

NODE = """
import rospy
from std_msgs.msg import String
from std_srvs.srv import Trigger
rospy.init_node("answering", disable_rosout=True)
rospy.Publisher("chat", String, queue_size=1)
rospy.Subscriber("chat", String)
rospy.Service("ask", Trigger, lambda _: 5)
print("up", flush=True)
rospy.spin()
"""

TOPIC = {"md5sum": "992ce8a1687cec8c8bd883ec73ca41d1", "callerid": "/me", "type": "std_msgs/String"}
SERVICE = {"md5sum": "937c9679a518e3a18d831e57125ea522", "callerid": "/me", "type": "std_srvs/Trigger"}

CALLS: list[tuple[str, list[Any]]] = [
    ("getUri", ["/me"]), ("getUri", []), ("getName", ["/me"]),
    *(
        ("publisherUpdate", ["/master", "/chat", publishers])
        for publishers in ("http://h:1", [5], ["x"], ["http://h:1", "y"], [""], ["http://h"], [])
    ),
    ("publisherUpdate", ["/master", "/nobody", []]), ("requestTopic", ["/me", "/none", [["TCPROS"]]]),
    ("requestTopic", ["/me", "/chat", [["UDPROS"]]]), ("requestTopic", ["/me", "/chat", []]), ("getPid", []),
    ("nonsense", ["/me"]),
]  # fmt: skip

HEADERS: list[dict[str, str]] = [
    {**TOPIC, "topic": "/none"}, {**TOPIC, "topic": "/chat", "md5sum": "0" * 32},
    {**TOPIC, "topic": "/chat", "type": "std_msgs/Int32"}, {"topic": "/chat", "callerid": "/me"},
    {**SERVICE, "service": "/nobody"}, {**SERVICE, "service": "/ask", "md5sum": "0" * 32},
    {"service": "/ask", "callerid": "/me"}, {},
]  # fmt: skip


def links(uri: str) -> list[list[object]]:
    """Direction, protocol and topic of each link that names port and socket."""
    # Genuine rospy does not report the socket of a subscriber.
    pattern = r"TCPROS connection on port \d+ to \[.* on socket (\d+|None)\]"
    with ServerProxy(uri) as slave:
        described: Any = slave.getBusInfo("/me")
    return sorted(link[2:5] for link in described[2] if re.fullmatch(pattern, link[6]))


def slave_answers(uri: str) -> list[object]:
    """Return code and value of each response, and the text of a refusal."""
    answers: list[object] = []
    with ServerProxy(uri) as slave:
        for method, arguments in CALLS:
            try:
                code, words, value = getattr(slave, method)(*arguments)
            except Exception as error:
                answers.append((method, type(error).__name__))
            else:
                answers.append((method, code, plain(words) if code == -1 else "", plain(str(value))))
    return answers


def plain(text: str) -> str:
    """Replace port numbers, and texts that differ by those of pipros."""
    text = re.sub(r"\d{2,}", "N", text.replace("]. Dropping connection.", "] Dropping connection."))
    return text.replace("is not a provider of  [", "does not provide the service [")


def connect(uri: str) -> socket.socket:
    with ServerProxy(uri) as slave:
        answer: Any = slave.requestTopic("/me", "/chat", [["TCPROS"]])
    _, host, port = answer[2]
    return socket.create_connection((host, port), timeout=30)


def received(connection: socket.socket) -> bytes:
    """Return all bytes until the peer closes the connection or its response ends."""
    with connection:
        connection.shutdown(socket.SHUT_WR)
        return b"".join(iter(lambda: connection.recv(4096), b""))


def refusals(uri: str) -> list[str]:
    """Return the response to each header: the names of its fields and the text of a refusal."""
    answers = []
    for header in HEADERS:
        connection = connect(uri)
        connection.sendall(encode_header(header))
        data = received(connection)
        fields = decode_header(data[4:]) if data else {}
        answers.append(plain(fields.get("error", str(sorted(fields)))))
    return answers


def called(uri: str) -> tuple[dict[str, str], str]:
    """Return the header of a service response, and the error about a handler that returned garbage."""
    with connect(uri) as connection:
        connection.sendall(encode_header({**SERVICE, "service": "/ask"}))
        stream = connection.makefile("rb")
        header = decode_header(stream.read(struct.unpack("<I", stream.read(4))[0]))
        connection.sendall(struct.pack("<I", 0))
        assert stream.read(1) == b"\0"
        words = stream.read(struct.unpack("<I", stream.read(4))[0]).decode()
    return {name: header[name] for name in ("callerid", "md5sum", "service", "type")}, words


def outcomes(ros: RosSystem, side: Side) -> dict[str, object]:
    with Master(port=ros.port) as master:
        python = "/usr/bin/python3" if side is ros.genuine else "python3"
        node = side.start(python, "-c", NODE, PIPROS_LOCAL="off")  # which is reported under another name
        node.wait_for("^up$")
        uri = uri_of(master.uri)
        wait_until(lambda: len(links(uri)) == 2)
        found: dict[str, object] = {
            "links": links(uri), "called": called(uri), "refusals": refusals(uri),
            "slave": slave_answers(uri),
        }  # fmt: skip
        node.press_ctrl_c()
        node.wait()
    return found


def uri_of(master_uri: str) -> str:
    with ServerProxy(master_uri) as master:
        answer: Any = master.lookupNode("/me", "/answering")
    return str(answer[2])


def test_a_node_responds_like_a_genuine_one(ros: RosSystem) -> None:
    genuine, ours = outcomes(ros, ros.genuine), outcomes(ros, ros.pipros)
    assert ours == genuine
