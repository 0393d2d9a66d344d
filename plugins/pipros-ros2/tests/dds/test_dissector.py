"""Wireshark's dissector reads what pipros sends, as an independent oracle."""

import subprocess
from functools import cache
from pathlib import Path
from struct import pack

from pipros_ros2.rtps.decoding import read_datagram
from pipros_ros2.rtps.parameters import SampleIdentity
from pipros_ros2.rtps.qos import DurabilityKind, Qos
from pipros_ros2.rtps.submessages import AckNack, Gap, Heartbeat, Submessage
from tests.support.rtps_network import STRING, SimulatedNetwork

LATCHED = Qos(durability=DurabilityKind.TRANSIENT_LOCAL, depth=20)
TALKER, LISTENER = (bytes(11) + bytes([number]) for number in (1, 2))
"""The prefixes of the first two participants of a simulated network."""
NAMES = {
    "0x06": "ACKNACK", "0x07": "HEARTBEAT", "0x08": "GAP", "0x0e": "INFO_DST", "0x12": "NACK_FRAG",
    "0x15": "DATA", "0x16": "DATA_FRAG",
}  # fmt: skip


def write_capture(file: Path, datagrams: list[bytes]) -> None:
    """Write a capture file in which each datagram is an IPv4 packet to the discovery port of domain 0."""
    records = [pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65_535, 101)]
    for number, datagram in enumerate(datagrams):
        udp = pack(">HHHH", 7412, 7410, 8 + len(datagram), 0) + datagram
        ip = pack(">BBHHHBBH4s4s", 0x45, 0, 20 + len(udp), 0, 0, 64, 17, 0, b"\x7f\0\0\1", b"\x7f\0\0\1")
        packet = ip + udp
        records.append(pack("<IIII", number, 0, len(packet), len(packet)) + packet)
    file.write_bytes(b"".join(records))


def dissect(file: Path, *arguments: str) -> str:
    done = subprocess.run(["tshark", "-r", file, *arguments], capture_output=True, text=True, check=True)
    return done.stdout


@cache
def conversation() -> list[bytes]:
    """The datagrams of two participants, with every kind of submessage. Some datagrams are lost."""
    network = SimulatedNetwork(seed=11, loss=0.2)
    talker, listener = network.host(), network.host()
    writer = talker.engine.add_writer("rt/chatter", STRING, LATCHED, network.now, b"typehash=RIHS01_00;")
    reader = listener.engine.add_reader("rt/chatter", STRING, LATCHED, network.now)
    network.run_until(lambda: bool(talker.matches() and listener.matches()))
    network.run(1.0)
    identity = SampleIdentity(listener.engine.prefix + reader, 77)
    for number in range(15):
        talker.engine.write(writer, b"\0\1\0\0" + bytes([number]) * 20, network.now)
        talker.engine.write(writer, b"\0\1\0\0", network.now, recipients=frozenset([bytes(16)]))
        talker.engine.write(writer, b"\0\1\0\0" + bytes(60_000 * (number % 3)), network.now, identity)
        network.run(0.01)
    network.run(2.0)
    talker.engine.remove(writer, network.now)
    network.run(1.0)
    talker.engine.close()
    network.flush()
    return [datagram for _, datagram in network.sent]


def test_the_dissector_understands_every_datagram(tmp_path: Path) -> None:
    datagrams = conversation()
    capture = tmp_path / "rtps.pcap"
    write_capture(capture, datagrams)
    is_rtps = dissect(capture, "-T", "fields", "-e", "rtps.version").split()
    found = dissect(capture, "-T", "fields", "-e", "rtps.sm.id").replace(",", "\n").split()

    assert len(is_rtps) == len(datagrams)
    assert {NAMES[each] for each in found} == set(NAMES.values())
    assert dissect(capture, "-Y", "_ws.malformed || rtps.sm.id == 0") == ""


def test_the_dissector_reads_the_values_that_were_written(tmp_path: Path) -> None:
    capture = tmp_path / "rtps.pcap"
    write_capture(capture, conversation())
    whole = dissect(capture, "-V")

    for text in (
        "topic: rt/chatter",
        f"typeName: {STRING}",
        "Durability: TRANSIENT_LOCAL_DURABILITY_QOS",
        "Kind: RELIABLE_RELIABILITY_QOS",
        "parameterId: PID_STATUS_INFO",
        f"parameterData: {LISTENER.hex()}00000104000000004d000000",  # the reader and number of a request
    ):
        assert text in whole, text


def sequences(submessage: Submessage) -> list[int]:
    """The sequence numbers of a submessage, in the order of the dissector."""
    match submessage:
        case Heartbeat():
            return [submessage.first, submessage.last]
        case AckNack():
            return [submessage.base]
        case Gap():
            return [submessage.start, submessage.base]
    return [submessage.sequence]


def test_the_dissector_reads_the_same_numbers_as_pipros(tmp_path: Path) -> None:
    datagrams = conversation()
    capture = tmp_path / "rtps.pcap"
    write_capture(capture, datagrams)
    found = dissect(capture, "-T", "fields", "-e", "rtps.sm.seqNumber").splitlines()

    for datagram, numbers in zip(datagrams, found, strict=True):
        read = read_datagram(datagram, LISTENER if datagram[8:20] == TALKER else TALKER)
        assert read is not None
        assert not read.is_malformed
        own = [number for submessage in read.submessages for number in sequences(submessage)]
        assert numbers == ",".join(map(str, own))
