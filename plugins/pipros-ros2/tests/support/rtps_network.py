"""RTPS participants in one process, with a simulated network, packet loss and time."""

import random
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from pipros.basics.limits import Limits
from pipros_ros2.rtps.announcements import EndpointData, ParticipantData
from pipros_ros2.rtps.events import (
    EndpointChanged,
    Event,
    Matched,
    Mismatched,
    OverLimit,
    PeerChanged,
    ReceivedSample,
    RtpsSettings,
)
from pipros_ros2.rtps.identity import OWN_VENDOR
from pipros_ros2.rtps.parameters import Address
from pipros_ros2.rtps.participant_core import ParticipantCore
from pipros_ros2.rtps.qos import QosPolicy

STRING = "std_msgs::msg::dds_::String_"
ADDRESSES = tuple(Address("127.0.0.1", 7410 + 2 * index) for index in range(4))


@dataclass
class Host:
    """An engine, with its address and the events that it has reported."""

    engine: ParticipantCore
    address: Address
    events: list[Event] = field(default_factory=list)

    def payloads(self, entity: bytes) -> list[bytes]:
        """Return the payloads of the samples that a reader has received."""
        samples = [each for each in self.events if isinstance(each, ReceivedSample)]
        return [each.sample.payload for each in samples if each.entity == entity]

    def matches(self) -> list[bool]:
        return [each.is_matched for each in self.events if isinstance(each, Matched)]

    def policies(self) -> list[QosPolicy | None]:
        return [each.policy for each in self.events if isinstance(each, Mismatched)]

    def peers(self) -> list[bool]:
        return [each.is_present for each in self.events if isinstance(each, PeerChanged)]

    def endpoints(self) -> list[EndpointData]:
        return [each.remote for each in self.events if isinstance(each, EndpointChanged) and each.is_present]

    def refused(self) -> int:
        return sum(isinstance(each, OverLimit) for each in self.events)


class SimulatedNetwork:
    """Delivers datagrams without delay, except those for which `drops` returns True."""

    def __init__(self, seed: int = 1, loss: float = 0.0) -> None:
        self.now = 1000.0
        self.hosts: dict[Address, Host] = {}
        self.drops: Callable[[bytes], bool] = lambda _: self._random.random() < loss
        self.sent: list[tuple[Address, bytes]] = []
        self._random = random.Random(seed)  # noqa: S311
        self._on_the_way: deque[tuple[Address, bytes, Address]] = deque()

    def host(self, limits: Limits | None = None, lease_s: float = 10.0, vendor: bytes = OWN_VENDOR) -> Host:
        """Add a participant, and return it. At most four are possible."""
        address = ADDRESSES[len(self.hosts)]
        prefix = bytes([0, 0, 0, 0, *bytes(7), len(self.hosts) + 1])
        me = ParticipantData(prefix, vendor, lease_s, discovery=(address,), data=(address,))
        others = tuple(each for each in ADDRESSES if each != address)
        engine = ParticipantCore(RtpsSettings(me, others, frozenset()), limits or Limits(), self.now)
        host = self.hosts[address] = Host(engine, address)
        return host

    def stop(self, host: Host) -> None:
        """Remove a participant without notifying the others."""
        del self.hosts[host.address]

    def flush(self) -> None:
        """Deliver datagrams until no participant sends any, then collect the events."""
        for _ in range(10_000):
            for host in self.hosts.values():
                for outgoing in host.engine.take_outgoing():
                    datagram = b"".join(outgoing.parts)
                    self.sent.append((outgoing.address, datagram))
                    if not self.drops(datagram):
                        self._on_the_way.append((outgoing.address, datagram, host.address))
            if not self._on_the_way:
                break
            while self._on_the_way:
                address, datagram, source = self._on_the_way.popleft()
                if (to := self.hosts.get(address)) is not None:
                    to.engine.receive(datagram, source.host, self.now)
        for host in self.hosts.values():
            host.events += host.engine.take_events()

    def run(self, seconds: float) -> None:
        """Advance the simulated time, from one deadline to the next."""
        end = self.now + seconds
        while self.now < end:
            self.flush()
            soonest = min((host.engine.deadline for host in self.hosts.values()), default=end)
            self.now = min(end, max(soonest, self.now + 1e-5))
            for host in self.hosts.values():
                host.engine.poll(self.now)
        self.flush()

    def run_until(self, condition: Callable[[], bool], seconds: float = 20.0) -> None:
        """Advance the simulated time until `condition` is true, by at most `seconds`."""
        end = self.now + seconds
        while not condition():
            assert self.now < end, f"not within {seconds} simulated seconds"
            self.run(0.01)
