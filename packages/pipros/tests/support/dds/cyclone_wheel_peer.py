# mypy: ignore-errors
"""A peer on the Cyclone DDS wheel, for tests. It has the command line of cyclone_peer.c, without actions."""

# There is no `from __future__ import annotations`, because cyclonedds does not resolve postponed annotations.
import select
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import int64, sequence, uint8, uint32, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration


@final
@dataclass
class Blob(IdlStruct, typename="example_interfaces::msg::dds_::Blob_"):
    number: uint32
    data: sequence[uint8]


@final
@dataclass
class Request(IdlStruct, typename="example_interfaces::srv::dds_::AddTwoInts_Request_"):
    client: uint64
    sequence_number: int64
    a: int64
    b: int64


@final
@dataclass
class Response(IdlStruct, typename="example_interfaces::srv::dds_::AddTwoInts_Response_"):
    client: uint64
    sequence_number: int64
    sum: int64


def qos_of(how: str, depth: int = 2000, user_data: bytes | None = None) -> Qos:
    latched = how == "latched"
    policies = [
        Policy.Reliability.Reliable(duration(infinite=True)),
        Policy.Durability.TransientLocal if latched else Policy.Durability.Volatile,
        Policy.History.KeepLast(1 if latched else depth),
    ]
    return Qos(*policies, *([Policy.Userdata(user_data)] if user_data else []))


def wait_until(condition: Callable[[], object]) -> None:
    while not condition():
        time.sleep(0.002)


def has_input_ended(timeout_s: float) -> bool:
    return bool(select.select([sys.stdin], [], [], timeout_s)[0])


def main(domain: str, mode: str, name: str, *words: str) -> None:
    participant = DomainParticipant(int(domain))
    service = qos_of("reliable", 10, b"serviceid=01.02.03.04.05.06.07.08.09.0a.0b.0c.0d.0e.0f.11;")
    caller = qos_of("reliable", 10, b"clientid=21.12.13.14.15.16.17.18.19.1a.1b.1c.1d.1e.1f.20;")
    if mode == "pub":
        count, size, period_us, how = words
        writer = DataWriter(participant, Topic(participant, name, Blob), qos_of(how))
        print("ready", flush=True)
        if how != "latched":
            wait_until(writer.get_matched_subscriptions)
        for number in range(int(count)):
            writer.write(Blob(number, [number % 256] * int(size)))
            time.sleep(int(period_us) / 1e6)
        print("published", flush=True)
        sys.stdin.read()
    elif mode == "sub":
        reader = DataReader(participant, Topic(participant, name, Blob), qos_of(words[0]))
        print("ready", flush=True)
        while not has_input_ended(0.002):
            # When a writer ends, its reader takes a sample without data.
            for blob in (each for each in reader.take(100) if isinstance(each, Blob)):
                is_right = all(octet == blob.number % 256 for octet in blob.data)
                print("got" if is_right else "wrong", blob.number, len(blob.data), flush=True)
    elif mode == "server":
        replies = DataWriter(participant, Topic(participant, f"rr{name}Reply", Response), service)
        requests = DataReader(participant, Topic(participant, f"rq{name}Request", Request), service)
        print("ready", flush=True)
        while not has_input_ended(0.0005):
            for request in requests.take(100):
                total = request.a + request.b
                wait_until(replies.get_matched_subscriptions)  # otherwise the reply would be lost
                replies.write(Response(request.client, request.sequence_number, total))
    elif mode == "client":
        answers = DataReader(participant, Topic(participant, f"rr{name}Reply", Response), caller)
        asking = DataWriter(participant, Topic(participant, f"rq{name}Request", Request), caller)
        wait_until(lambda: asking.get_matched_subscriptions() and answers.get_matched_publications())
        right = 0
        for number in range(1, int(words[0]) + 1):
            asking.write(Request(4712, number, number, 1000))
            found: list[Response] = []
            deadline = time.monotonic() + 60
            while not found and time.monotonic() < deadline:
                found = list(answers.take(1))
                time.sleep(0.0005)
            right += [(each.client, each.sum) for each in found] == [(4712, number + 1000)]
        print("right", right, flush=True)
        sys.stdin.read()


if __name__ == "__main__":
    main(*sys.argv[1:])
