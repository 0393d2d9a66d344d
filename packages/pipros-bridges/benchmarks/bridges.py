#!/usr/bin/env python3
"""The speed of the servers for browsers and for Foxglove.

    script/bench bridges [--only clients,encodings,rosbridge] [--rounds 3] [--seconds 5] [--quick]

clients: the server's share of one processor while many clients (--clients 100) receive an Imu 100 times a
second, without and with one more client that never reads. If a client receives clearly fewer, this is an
error. rosbridge: the same over rosbridge, with JSON.
encodings: the time to encode a message for rosbridge, which happens once however many clients receive it.
"""

import json
import random
import selectors
import socket
import time

from programs import Programs, cpu_s
from table import Row, free_port, heed_interrupts, markdown, options_of, wait_for_port, write_json
from websockets.client import ClientProtocol
from websockets.frames import Opcode
from websockets.uri import parse_uri

SUBPROTOCOL = "foxglove.sdk.v1"

IMU = """
import rospy
from sensor_msgs.msg import Imu
rospy.init_node("imu")
values = rospy.Publisher("imu", Imu, queue_size=10)
rate = rospy.Rate(100)
while not rospy.is_shutdown():
    message = Imu()
    message.header.stamp = rospy.Time.now()
    values.publish(message)
    rate.sleep()
"""
FOXGLOVE = "pipros", "foxglove", "--port", "{}"
ROSBRIDGE = "rosrun", "rosbridge_server", "rosbridge_websocket", "_port:={}"
LEAST_HZ = 90


def serve(system, command):
    """Start a server. Return its process and port."""
    port = free_port()
    process = system.start(*(word.format(port) for word in command))
    wait_for_port(port)
    return process, port


class Client:
    """A client that counts bytes instead of parsing messages, so that it is faster than every server."""

    def __init__(self, port, topic, is_foxglove):
        uri, subprotocols = parse_uri(f"ws://127.0.0.1:{port}/"), [SUBPROTOCOL] if is_foxglove else None
        protocol = ClientProtocol(uri, subprotocols=subprotocols, max_size=None)
        self.sock, self.bytes = socket.create_connection(("127.0.0.1", port)), 0
        self._chunk = memoryview(bytearray(1 << 20))
        protocol.send_request(protocol.connect())
        waiting = {"op": "subscribe", "topic": topic}
        while True:
            self.sock.sendall(b"".join(protocol.data_to_send()))
            protocol.receive_data(self.sock.recv(65536))
            for event in protocol.events_received():
                found = json.loads(event.data) if getattr(event, "opcode", None) is Opcode.TEXT else {}
                ids = [each["id"] for each in found.get("channels", ()) if each["topic"] == topic]
                if ids:
                    wanted = {"op": "subscribe", "subscriptions": [{"id": 1, "channelId": ids[0]}]}
                    protocol.send_text(json.dumps(wanted).encode())
                elif getattr(event, "opcode", None) is Opcode.BINARY or found.get("op") == "publish":
                    self.message_bytes = len(event.data)
                    return
                elif waiting and not is_foxglove:
                    protocol.send_text(json.dumps(waiting).encode())
                    waiting = None

    def read(self):
        """Receive the available data."""
        count = self.sock.recv_into(self._chunk)
        if not count:
            raise ConnectionError("the server has closed the connection")
        self.bytes += count


def processor_percent(options, command, *, is_one_stuck):
    """Return the share of a processor that the server of many clients uses."""
    with Programs() as system, selectors.DefaultSelector() as selector:
        system.run(IMU)
        process, port = serve(system, command)
        clients = [Client(port, "/imu", command is FOXGLOVE) for _ in range(options.clients + is_one_stuck)]
        for client in clients[: options.clients]:
            selector.register(client.sock, selectors.EVENT_READ, client)
        for duration in (1.0, options.seconds):  # the first one is a warm-up
            for client in clients:
                client.bytes = 0
            used, begin = cpu_s(process.pid), time.monotonic()
            while time.monotonic() < begin + duration:
                for key, _ in selector.select(0.1):
                    key.data.read()
            passed, used = time.monotonic() - begin, cpu_s(process.pid) - used
        least = min(each.bytes / each.message_bytes for each in clients[: options.clients]) / passed
        for client in clients:
            client.sock.close()
    if least < LEAST_HZ:
        raise SystemExit(f"a client received only {least:.0f} messages/s")
    return 100 * used / passed


def clients(options, name="Foxglove", command=FOXGLOVE):
    """Measure the costs of many clients of one topic, without and with one more client that never reads."""
    label, rows = f"{name}: {options.clients} clients of a 100 Hz Imu", []
    for more in ("", " and one that does not read"):
        percent = processor_percent(options, command, is_one_stuck=bool(more))
        rows.append(Row(f"{label}{more}, processor %", {"pipros": [percent]}))
    return rows


def rosbridge(options):
    return clients(options, "rosbridge JSON", ROSBRIDGE)


def sample_messages():
    """Return messages with random values, by label."""
    from pipros.msg import load_message_class

    generator = random.Random(1)  # noqa: S311 # the same in each run
    imu = load_message_class("sensor_msgs/Imu")()
    for vector in (imu.orientation, imu.angular_velocity, imu.linear_acceleration):
        for name in vector.__slots__:
            setattr(vector, name, generator.gauss(0, 1))
    scan = load_message_class("sensor_msgs/LaserScan")()
    scan.ranges = [round(generator.uniform(0, 30), 3) for _ in range(720)]
    transform = load_message_class("geometry_msgs/TransformStamped")
    transforms = [transform(child_frame_id=f"link_{number}") for number in range(20)]
    for each in transforms:
        each.transform.translation.x = generator.gauss(0, 1)
    image = load_message_class("sensor_msgs/Image")(height=333, width=1000, step=3000, encoding="rgb8")
    image.data = generator.randbytes(999_000)
    frames = load_message_class("tf2_msgs/TFMessage")(transforms)
    return {"an Imu": imu, "a LaserScan (720)": scan, "a TFMessage (20)": frames, "an image of 1 MB": image}


def encodings(options):
    """Measure the time that each encoding takes, in us."""
    from pipros_bridges.rosbridge.encoding import Encoder, WireEncoding
    from pipros_bridges.shared_topics import TopicMessage

    encoders = {each.name.lower().replace("_", "-"): (Encoder(), each) for each in WireEncoding}
    encoders["bson"] = (Encoder(is_bson=True), WireEncoding.JSON)
    rows = []
    for label, message in sample_messages().items():
        header = {"type": message._type, "md5sum": message._md5sum, "message_definition": message._full_text}
        body = b"".join(message._to_buffers())
        for name, (encoder, encoding) in encoders.items():
            rounds = []
            encoder.encoded(TopicMessage("/topic", body, header, 0)).frames(encoding, "/topic")  # compiles
            for _ in range(options.rounds):
                count, begin = 0, time.perf_counter()
                while (passed := time.perf_counter() - begin) < options.seconds / 20:
                    encoder.encoded(TopicMessage("/topic", body, header, 0)).frames(encoding, "/topic")
                    count += 1
                rounds.append(1e6 * passed / count)
            rows.append(Row(f"rosbridge: {label} as {name}, us", {"pipros": rounds}))
    return rows


BENCHMARKS = {"clients": clients, "encodings": encodings, "rosbridge": rosbridge}


def main():
    options = options_of(
        __doc__, only=",".join(BENCHMARKS), rounds=3, seconds=5.0, clients=100, quick=False, json=""
    )
    heed_interrupts()
    if options.quick:
        options.rounds, options.seconds = 1, 2.0
    rows = [row for name in options.only.split(",") for row in BENCHMARKS[name](options)]
    print(markdown(rows))
    if options.json:
        write_json(options.json, rows)


if __name__ == "__main__":
    main()
