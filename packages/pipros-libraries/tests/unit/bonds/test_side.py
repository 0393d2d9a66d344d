"""One side of a bond in real time, without topics."""

from __future__ import annotations

from threading import Thread

from pipros_libraries.bonds.life import BondEvent, BondState
from pipros_libraries.bonds.side import BondSide
from tests.support.waiting import wait_until

SOON_S, NEVER_S = 0.001, 3600.0


class Owner:
    """The messages and reports of a side."""

    def __init__(
        self, durations_s: dict[BondEvent, float], ignored_silences: int = 0, is_over: bool = False
    ) -> None:
        self.published: list[bool] = []
        self.changes: list[BondState] = []
        self.states: list[BondState] = []
        self.ignored_silences = ignored_silences
        self.is_over = is_over
        self.side = BondSide(
            dict.fromkeys(BondEvent, NEVER_S) | durations_s,
            send=self.published.append,
            notify=self.changes.append,
            enter=self.states.append,
            ignores_silence=self._ignores_silence,
            is_over=lambda: self.is_over,
        )

    def _ignores_silence(self) -> bool:
        wait_until(lambda: self.changes, what="the notification that the bond was formed")
        self.ignored_silences -= 1
        return self.ignored_silences >= 0


def test_a_bond_without_a_sister_breaks_at_the_connect_timeout() -> None:
    owner = Owner({BondEvent.CONNECT_TIMEOUT: SOON_S})
    owner.side.start_timeout()

    assert owner.side.wait(lambda state: state is BondState.DEAD, NEVER_S)
    wait_until(lambda: owner.changes == [BondState.DEAD])


def test_silence_breaks_a_bond_once_it_is_no_longer_ignored() -> None:
    owner = Owner({BondEvent.HEARTBEAT_TIMEOUT: SOON_S}, ignored_silences=2)

    assert owner.side.receive("sister", is_alive=True)

    wait_until(lambda: owner.changes == [BondState.ALIVE, BondState.DEAD])
    assert (owner.ignored_silences, owner.states) == (-1, [BondState.ALIVE, BondState.DEAD])


def test_an_end_that_no_sister_confirms_ends_at_the_disconnect_timeout() -> None:
    owner = Owner({BondEvent.DISCONNECT_TIMEOUT: SOON_S})
    owner.side.receive("sister", is_alive=True)
    owner.side.handle(BondEvent.BREAK)

    wait_until(lambda: owner.changes == [BondState.ALIVE, BondState.DEAD])
    assert (owner.published, owner.side.sister_ended_first) == ([False], False)


def test_a_third_instance_is_refused_and_a_sister_that_missed_the_end_learns_of_it() -> None:
    owner = Owner({})
    owner.side.receive("sister", is_alive=False)
    owner.side.receive("sister", is_alive=False)

    assert not owner.side.receive("stranger", is_alive=True)
    assert owner.side.receive("sister", is_alive=True)

    assert (owner.published, owner.side.sister_ended_first) == ([False, False], True)


def test_heartbeats_end_with_the_bond_and_once_more_thereafter() -> None:
    owner = Owner({BondEvent.CONNECT_TIMEOUT: SOON_S})
    owner.side.start_timeout()

    owner.side.publish_heartbeats(NEVER_S, NEVER_S)

    assert owner.published[-1] is False
    assert True not in owner.published[1:]


def test_heartbeats_and_waits_end_when_their_owner_does() -> None:
    owner = Owner({}, is_over=True)

    assert not owner.side.wait(lambda state: state is BondState.ALIVE, None)
    owner.side.publish_heartbeats(NEVER_S, NEVER_S)
    owner.side.wake()

    assert owner.published == [True]


def test_more_messages_of_a_living_sister_change_nothing() -> None:
    owner = Owner({})
    owner.side.receive("sister", is_alive=True)
    owner.side.receive("sister", is_alive=True)

    assert (owner.changes, owner.states, owner.published) == ([BondState.ALIVE], [BondState.ALIVE], [])
    owner.side.handle(BondEvent.HEARTBEAT_TIMEOUT)
    assert owner.side.state is BondState.DEAD


def test_a_wait_without_limit_ends_with_its_owner_even_before_the_start() -> None:
    owner = Owner({})
    waiting = Thread(target=owner.side.wait, args=(lambda state: state is BondState.ALIVE, None), daemon=True)
    waiting.start()

    owner.is_over = True  # nothing wakes the side: it was not started

    wait_until(lambda: not waiting.is_alive())
