#!/usr/bin/env python3
"""The speed of the servers for browsers and for Foxglove.

    script/bench bridges [--only images,clients,encodings,rosbridge] [--rounds 3] [--seconds 5] [--quick]

images: a node publishes images of 1 MB as fast as it can, and one client of `pipros foxglove` reads them.
clients: the server's share of one processor while many clients (--clients 100) receive an Imu 100 times a
second, without and with one more client that never reads. If a client receives clearly fewer, this is an
error. rosbridge: the same over rosbridge, with JSON.
encodings: the time to encode a message for rosbridge, which happens once however many clients receive it.
Nothing else should be running.
"""

import json
import random
import selectors
import socket
import struct
import time

import psutil
from programs import Programs
from table import Row, free_port, heed_interrupts, markdown, options_of, wait_for_port, write_json

SUBPROTOCOL = "foxglove.sdk.v1"

CAMERA = """
import rospy
from sensor_msgs.msg import Image
rospy.init_node("camera")
images = rospy.Publisher("image", Image, queue_size=None)
image = Image(width=1000, height=333, step=3000, encoding="rgb8", data=bytes(999000))
while not rospy.is_shutdown():
    if images.get_num_connections():
        images.publish(image)
    else:
        rospy.sleep(0.01)
"""
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
    """A Foxglove client that only counts messages, so that it is faster than every server."""

    HEADER = f"Sec-WebSocket-Protocol: {SUBPROTOCOL}\r\n"
    OPCODE = 2

    def __init__(self, port, topic):
        self.messages = 0
        self.sock = socket.create_connection(("127.0.0.1", port))
        self.sock.sendall(
            f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n"
            f"{self.HEADER}\r\n".encode()
        )
        self._buffer = bytearray()
        self._left = 0  # number of bytes of a large message that have not arrived yet
        self._chunk = memoryview(bytearray(1 << 20))
        while b"\r\n\r\n" not in self._buffer:
            self._receive()
        del self._buffer[: self._buffer.index(b"\r\n\r\n") + 4]
        self._subscribe(topic)

    def _subscribe(self, topic):
        while True:
            for opcode, payload in self._frames():
                if opcode != 1:
                    continue
                for channel in json.loads(payload).get("channels", ()):
                    if channel["topic"] == topic:
                        wanted = [{"id": 1, "channelId": channel["id"]}]
                        self._send(json.dumps({"op": "subscribe", "subscriptions": wanted}).encode())
                        return
            self._receive()

    def _receive(self):
        received = self.sock.recv(65536)
        if not received:
            raise ConnectionError("the server has closed the connection")
        self._buffer += received

    def _send(self, text):
        self.sock.sendall(struct.pack("!BBH4x", 0x81, 0x80 | 126, len(text)) + text)  # a mask of zeros

    def read(self):
        """Receive the available data, and count the messages in it."""
        count = self.sock.recv_into(self._chunk)
        if not count:
            raise ConnectionError("the server has closed the connection")
        if self._left >= count:
            self._left -= count
            self.messages += self._left == 0
            return
        if self._left:
            self.messages += 1
        self._buffer += self._chunk[self._left : count]
        self._left = 0
        for opcode, payload in self._frames(partial=True):
            if opcode == 9:
                self.sock.sendall(struct.pack("!BB4x", 0x8A, 0x80 | len(payload)) + payload)
            elif opcode == self.OPCODE:
                self.messages += 1

    def _frames(self, partial=False):
        """Remove complete frames from the buffer, and yield them.

        With `partial`, the data of a large frame is discarded as it arrives, and only its size is tracked.
        """
        buffer = self._buffer
        while len(buffer) >= 2:
            size, head = buffer[1] & 0x7F, 2
            if size == 126:
                size, head = int.from_bytes(buffer[2:4], "big"), 4
            elif size == 127:
                size, head = int.from_bytes(buffer[2:10], "big"), 10
            if len(buffer) < head + size:
                if partial and size > 100_000 and len(buffer) > head and buffer[0] & 15 == 2:
                    self._left = head + size - len(buffer)
                    buffer.clear()
                return
            opcode, payload = buffer[0] & 15, bytes(buffer[head : head + size])
            del buffer[: head + size]
            yield opcode, payload


class RosbridgeClient(Client):
    """A rosbridge client that receives JSON."""

    HEADER = ""
    OPCODE = 1

    def _subscribe(self, topic):
        self._send(json.dumps({"op": "subscribe", "topic": topic}).encode())


def images_a_second(port, seconds):
    client = Client(port, "/image")
    client.sock.settimeout(30)
    while not client.messages:
        client.read()
    begin, before = time.monotonic(), client.messages
    while (passed := time.monotonic() - begin) < seconds:
        client.read()
    client.sock.close()
    return (client.messages - before) / passed


def images(options):
    figures = []
    for _ in range(options.rounds):
        with Programs() as system:
            system.run(CAMERA)
            figures.append(images_a_second(serve(system, FOXGLOVE)[1], options.seconds))
    return [Row("Foxglove: images of 1 MB a second", {"pipros": figures}, more_is_better=True)]


def processor_percent(options, command, client_class, *, is_one_stuck):
    """Return the share of a processor that the server of many clients uses."""
    with Programs() as system, selectors.DefaultSelector() as selector:
        system.run(IMU)
        process, port = serve(system, command)
        clients = [client_class(port, "/imu") for _ in range(options.clients)]
        stuck = [client_class(port, "/imu")] if is_one_stuck else []
        for client in clients:
            selector.register(client.sock, selectors.EVENT_READ, client)

        def read_for(duration):
            end_s = time.monotonic() + duration
            while time.monotonic() < end_s:
                for key, _ in selector.select(0.1):
                    key.data.read()

        read_for(1.0)
        for client in clients:
            client.messages = 0
        used, begin = psutil.Process(process.pid).cpu_times(), time.monotonic()
        read_for(options.seconds)
        passed, after = time.monotonic() - begin, psutil.Process(process.pid).cpu_times()
        least = min(client.messages for client in clients) / passed
        for client in (*clients, *stuck):
            client.sock.close()
    if least < LEAST_HZ:
        raise SystemExit(f"a client received only {least:.0f} messages/s")
    return 100 * (after.user + after.system - used.user - used.system) / passed


def clients(options, name="Foxglove", command=FOXGLOVE, client_class=Client):
    """Measure the costs of many clients of one topic, without and with one more client that never reads."""
    label, rows = f"{name}: {options.clients} clients of a 100 Hz Imu", []
    for more in ("", " and one that does not read"):
        percent = processor_percent(options, command, client_class, is_one_stuck=bool(more))
        rows.append(Row(f"{label}{more}, processor %", {"pipros": [percent]}))
    return rows


def rosbridge(options):
    return clients(options, "rosbridge JSON", ROSBRIDGE, RosbridgeClient)


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
    from pipros.bridges.rosbridge.encoding import Encoder, WireEncoding
    from pipros.bridges.shared_topics import TopicMessage

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


BENCHMARKS = {"images": images, "clients": clients, "encodings": encodings, "rosbridge": rosbridge}


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
