"""Announce this participant to peers (SPDP), and notify them when it leaves.

The participant is announced periodically, and in response to the announcements of peers.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from pipros_ros2.rtps.announcements import write_key, write_participant
from pipros_ros2.rtps.encoding import data_head, datagram_head
from pipros_ros2.rtps.events import RtpsSettings
from pipros_ros2.rtps.identity import PARTICIPANT_ENTITY, PARTICIPANT_READER, PARTICIPANT_WRITER
from pipros_ros2.rtps.outbox import DatagramOutbox
from pipros_ros2.rtps.parameters import Parameter, ended
from pipros_ros2.rtps.peers import Peer

_FIRST_PAUSES_S: Final = (0.1, 0.2, 0.3, 0.4, 0.5, 1.0)


class ParticipantPresence:
    """Announces a participant: frequently at first, then three times per lease duration.

    Attributes:
        due: time of the next announcement.
    """

    def __init__(self, settings: RtpsSettings, outbox: DatagramOutbox, now: float) -> None:
        self.due = now
        self._settings = settings
        self._outbox = outbox
        self._count = 0

    def announce(self, peers: Iterable[Peer], now: float) -> None:
        """Announce the participant to all known addresses."""
        pauses, index = _FIRST_PAUSES_S, self._count
        self._count += 1
        self.due = now + (pauses[index] if index < len(pauses) else self._settings.me.lease_s / 3)
        self._send(peers, self._datagram(1, write_participant(self._settings.me)))

    def answer(self, peer: Peer) -> None:
        """Announce the participant to one peer."""
        datagram = self._datagram(1, write_participant(self._settings.me))
        self._outbox.send(peer.discovery_address, datagram)

    def end(self, peers: Iterable[Peer]) -> None:
        """Notify the peers that the participant is leaving."""
        guid = self._settings.me.prefix + PARTICIPANT_ENTITY
        payload = write_key(Parameter.PARTICIPANT_GUID, guid)
        self._send(peers, self._datagram(2, payload, ended(guid), is_key=True))

    def _send(self, peers: Iterable[Peer], datagram: bytes) -> None:
        addresses = dict.fromkeys(self._settings.announce_to)
        addresses.update(dict.fromkeys(peer.discovery_address for peer in peers))
        for address in addresses:
            self._outbox.send(address, datagram)

    def _datagram(self, number: int, payload: bytes, inline: bytes = b"", *, is_key: bool = False) -> bytes:
        head = data_head(PARTICIPANT_READER, PARTICIPANT_WRITER, number, len(payload), inline, is_key=is_key)
        return datagram_head(self._settings.me.prefix) + head + payload
