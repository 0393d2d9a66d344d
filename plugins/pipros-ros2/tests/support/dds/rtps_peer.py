"""A peer on pipros for tests. Its command line is that of fast_peer.cpp, but with a discovery range:

rtps_peer.py DOMAIN LOCALHOST|SUBNET[,loss=0.05] pub TOPIC TYPE COUNT SIZE PERIOD_US reliable|latched
"""

import os
import random
import socket
import sys
import threading
import time
from struct import Struct, pack, unpack_from

from pipros_ros2 import action_messages as messages
from pipros_ros2.action_messages import CancelCode, GoalInfo, Ros2Status
from pipros_ros2.rtps.domain import Discovery, DiscoveryRange
from pipros_ros2.rtps.outbox import Outgoing
from pipros_ros2.rtps.participant import Participant
from pipros_ros2.rtps.qos import DurabilityKind, Qos
from pipros_ros2.rtps.service_client import RtpsClient
from pipros_ros2.rtps.service_styles import PIPROS_MARK
from pipros_ros2.rtps.services import RtpsServer
from pipros_ros2.rtps.sockets import RtpsSockets
from pipros_ros2.rtps.writer_proxy import RtpsSample

CDR = b"\0\1\0\0"
_MESSAGE = Struct("<II")
_SUM = Struct("<q")
_ADD = Struct("<qq")

LIMIT_S = 60.0


class LossySocket(socket.socket):
    """Drops the fraction `loss` of the received datagrams."""

    def recvfrom(self, *arguments: int) -> tuple[bytes, tuple[str, int]]:
        while True:
            received = super().recvfrom(*arguments)
            if not is_lost():
                return received


class LossySockets(RtpsSockets):
    """Drops the fraction `loss` of the sent and of the received datagrams."""

    def __init__(self, where: Discovery) -> None:
        super().__init__(where)
        self.receiving = [LossySocket(fileno=os.dup(each.fileno())) for each in self.receiving]

    def send(self, datagrams: list[Outgoing]) -> None:  # type: ignore[override]
        super().send(each for each in datagrams if not is_lost())


LOSS = random.Random(1)  # noqa: S311
loss = 0.0


def is_lost() -> bool:
    return LOSS.random() < loss


def qos_of(word: str) -> Qos:
    latched = Qos(durability=DurabilityKind.TRANSIENT_LOCAL, depth=1)
    return latched if word == "latched" else Qos(depth=2000)


def wait_for_end() -> None:
    sys.stdin.read()


def report(sample: RtpsSample) -> None:
    number, size = _MESSAGE.unpack_from(sample.payload, 4)
    right = sample.payload[12 : 12 + size] == bytes([number % 256]) * size
    print("got" if right else "wrong", number, size, flush=True)


def add(payload: bytes) -> bytes:
    a, b = _ADD.unpack_from(payload, 4)
    return CDR + _SUM.pack(a + b)


STATUSES = "action_msgs::msg::dds_::GoalStatusArray_"
ENDLESS = 40
"""Goals with at least this order run until they are cancelled."""


def say(*words: object) -> None:
    """Print a line with a single `write`, because `print` could mix the lines of two threads."""
    sys.stdout.write(" ".join(map(str, words)) + "\n")
    sys.stdout.flush()


def numbers(order: int) -> bytes:
    """Return Fibonacci numbers as a CDR sequence of 32-bit integers."""
    found = [0, 1]
    while len(found) < order:
        found.append(found[-1] + found[-2])
    count = min(max(0, order), ENDLESS)
    return pack(f"<{count + 1}i", count, *found[:count])


def names_of(action: str, type_name: str, part: str) -> tuple[str, str, str]:
    """Return the name of a service of an action, and the types of its requests and replies."""
    whole = "".join(word.capitalize() for word in part.split("_"))
    dds_type = "action_msgs::srv::dds_::CancelGoal" if part == "cancel_goal" else f"{type_name}_{whole}"
    return f"{action}/_action/{part}", f"{dds_type}_Request_", f"{dds_type}_Response_"


class ActionServer:
    def __init__(self, participant: Participant, action: str, type_name: str) -> None:
        self._goals: dict[bytes, tuple[int, Ros2Status]] = {}
        self._changed = threading.Condition()
        topic = f"rt{action}/_action"
        self._feedback = participant.add_writer(f"{topic}/feedback", f"{type_name}_FeedbackMessage_", Qos())
        self._status = participant.add_writer(f"{topic}/status", STATUSES, qos_of("latched"))
        for handle in (self.send_goal, self.cancel_goal, self.get_result):
            RtpsServer(participant, *names_of(action, type_name, handle.__name__), handle)

    def _set(self, goal: bytes, order: int, status: Ros2Status) -> None:
        with self._changed:
            self._goals[goal] = order, status
            statuses = [(GoalInfo(each), found) for each, (_, found) in self._goals.items()]
            self._status.write(messages.status_array(statuses))
            self._changed.notify_all()

    def send_goal(self, request: bytes) -> bytes:
        goal, body = messages.split_id(request)
        (order,) = unpack_from("<i", body, 4)
        say("goal", order)
        if order >= 0:
            threading.Thread(target=self._run, args=(goal, order), daemon=True).start()
        return messages.accepted_reply(0, is_accepted=order >= 0)

    def _run(self, goal: bytes, order: int) -> None:
        self._set(goal, order, Ros2Status.EXECUTING)
        for length in range(1, min(order, ENDLESS) + 1):
            self._feedback.write(CDR + goal + numbers(length))
        if order < ENDLESS:
            self._set(goal, order, Ros2Status.SUCCEEDED)

    def cancel_goal(self, request: bytes) -> bytes:
        info = messages.parse_cancel_request(request)
        order, status = self._goals.get(info.goal, (0, Ros2Status.UNKNOWN))
        if status is not Ros2Status.EXECUTING:
            return messages.cancel_reply(CancelCode.UNKNOWN_GOAL, [])
        self._set(info.goal, order, Ros2Status.CANCELED)
        return messages.cancel_reply(CancelCode.NONE, [info])

    def get_result(self, request: bytes) -> bytes:
        goal = request[4:20]
        with self._changed:
            self._changed.wait_for(lambda: goal in self._goals and self._goals[goal][1].has_ended, LIMIT_S)
            order, status = self._goals[goal]
        return CDR + bytes([status, 0, 0, 0]) + numbers(order if status is Ros2Status.SUCCEEDED else 0)


def call_action(participant: Participant, action: str, type_name: str, order: str, end: str) -> None:
    goal = os.urandom(16)
    seen: list[Ros2Status] = []

    def on_feedback(sample: RtpsSample) -> None:
        if sample.payload[4:20] == goal:
            say("feedback", *unpack_from("<I", sample.payload, 20))

    def on_status(sample: RtpsSample) -> None:
        for info, status in messages.parse_status_array(sample.payload, 100):
            if info.goal == goal and status not in seen:
                seen.append(status)
                say("status", int(status))

    topic = f"rt{action}/_action"
    deep = Qos(depth=2000)
    feedback = participant.add_reader(f"{topic}/feedback", f"{type_name}_FeedbackMessage_", deep, on_feedback)
    statuses = participant.add_reader(f"{topic}/status", STATUSES, qos_of("latched"), on_status)
    parts = ("send_goal", "cancel_goal", "get_result")
    send, cancel, get = (RtpsClient(participant, *names_of(action, type_name, part)) for part in parts)
    assert all(each.wait_for_server(LIMIT_S) for each in (send, cancel, get))
    assert all(each.wait_for_writers(timeout_s=LIMIT_S) for each in (feedback, statuses))
    is_accepted = messages.is_accepted(send.call(CDR + goal + pack("<i", int(order)), LIMIT_S))
    say("accepted", int(is_accepted))
    if is_accepted and end == "cancel":
        reply = cancel.call(messages.cancel_request(GoalInfo(goal)), LIMIT_S)
        say("cancelling", reply[4], "of", *unpack_from("<I", reply, 8))
    if is_accepted:
        result = get.call(CDR + goal, LIMIT_S)
        (count,) = unpack_from("<I", result, 8)
        say(f"result {result[4]}:", *unpack_from(f"<{count}i", result, 12))
    wait_for_end()


def main(domain: str, options: str, mode: str, name: str, *words: str) -> None:
    global loss
    where, _, part = options.partition(",loss=")
    loss = float(part or 0)
    discovery = Discovery(int(domain), DiscoveryRange(where))
    sockets = (LossySockets if loss else RtpsSockets)(discovery)
    with Participant(discovery, f"enclave=/;{PIPROS_MARK}=test;".encode(), sockets=sockets) as participant:
        if mode == "pub":
            type_name, count, size, period_us, kind = words
            writer = participant.add_writer(name, type_name, qos_of(kind))
            print("ready", flush=True)
            if kind != "latched":
                assert writer.wait_for_readers(timeout_s=LIMIT_S)
            pause = threading.Event()
            for number in range(int(count)):
                body = bytes([number % 256]) * int(size)
                writer.write(CDR + _MESSAGE.pack(number, int(size)) + body)
                if int(period_us):
                    pause.wait(int(period_us) / 1e6)
            print("published", flush=True)
            wait_for_end()
        elif mode == "sub":
            type_name, kind = words
            participant.add_reader(name, type_name, qos_of(kind), report)
            print("ready", flush=True)
            wait_for_end()
        elif mode == "server":
            RtpsServer(participant, name, words[0] + "_Request_", words[0] + "_Response_", add)
            print("ready", flush=True)
            wait_for_end()
        elif mode == "client":
            client = RtpsClient(participant, name, words[0] + "_Request_", words[0] + "_Response_")
            assert client.wait_for_server(LIMIT_S)
            right, began = 0, time.monotonic()
            for number in range(int(words[1])):
                reply = client.call(CDR + _ADD.pack(number, 1000), LIMIT_S)
                right += _SUM.unpack_from(reply, 4)[0] == number + 1000
            print("right", right, flush=True)
            print(f"{(time.monotonic() - began) / int(words[1]) * 1e6:.0f} us per call", flush=True)
            wait_for_end()
        elif mode == "action-server":
            ActionServer(participant, name, words[0])
            print("ready", flush=True)
            wait_for_end()
        elif mode == "action-client":
            call_action(participant, name, *words)


if __name__ == "__main__":
    main(*sys.argv[1:])
