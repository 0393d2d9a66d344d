"""Which nodes are dead, which unreachable, and which still own their address."""

import asyncio
from collections.abc import Callable
from typing import Any

import pytest

from pipros.basics.errors import ProtocolError, Unreachable
from pipros.master.liveness import CONFIRMATIONS, PROBES_AT_A_TIME, Liveness, find_live_nodes
from pipros.master.options import Probing
from pipros.master.registry import MASTER_ID, Notice, Registry
from pipros.master.server import RegisteredNodes
from pipros.net.this_machine import ThisMachineCaller
from pipros.wire.xmlrpc import Fault

API, OTHER = "http://n:1/", "http://other:2/"


HANGS = object()


def refused() -> Unreachable:
    error = Unreachable(API, "Connection refused")
    error.__cause__ = ConnectionRefusedError()
    return error


def silent() -> Unreachable:
    return Unreachable(API, "no response in time")


class Case:
    """Fake nodes. `answers` has for API and method a value, an error, or a list to be taken one by one."""

    def __init__(self) -> None:
        self.answers: dict[tuple[str, str], Any] = {}
        self.asked: list[tuple[str, str]] = []
        self.gone: list[tuple[str, str]] = []
        self.registry = Registry()
        self.liveness = Liveness(
            self.registry, lambda node, api: self.gone.append((node, api)),
            Probing(round_s=0.01, newcomers_s=0, confirmation_pause_s=0), ask=self.ask,
        )  # fmt: skip

    async def ask(self, api: str, method: str, _timeout_s: float) -> Any:
        self.asked.append((api, method))
        answer = self.answers.get((api, method))
        if isinstance(answer, list):
            answer = answer.pop(0) if len(answer) > 1 else answer[0]
        if answer is HANGS:
            await asyncio.Event().wait()
        if isinstance(answer, Exception):
            raise answer
        return answer

    def register(self, node: str = "/n", api: str = API, *, is_met: bool = True) -> None:
        self.registry.register_publisher(node, "/t", "x/Y", api)
        if is_met:
            self.liveness.note_reached(node)

    def suspect_answering(self, answer: Any) -> None:
        self.register()
        self.answers[API, "getPid"] = answer
        self.suspect()

    def suspect(self, node: str = "/n") -> None:
        async def until_sure() -> None:
            self.liveness.suspect(node)
            self.liveness.suspect(node)  # once is enough
            while self.liveness.suspects:
                await asyncio.sleep(0)

        asyncio.run(asyncio.wait_for(until_sure(), 30))


@pytest.fixture
def case() -> Case:
    return Case()


def test_a_node_that_responds_stays_registered(case: Case) -> None:
    case.suspect_answering(7)
    assert (case.gone, case.asked) == ([], [(API, "getPid")])


def test_a_node_that_always_refuses_is_removed(case: Case) -> None:
    case.suspect_answering(refused())
    assert (case.gone, len(case.asked)) == ([("/n", API)], CONFIRMATIONS)


def test_a_node_that_never_responded_is_unreachable_and_stays(case: Case) -> None:
    """For example in a container, whose address is valid only there."""
    case.register(is_met=False)
    case.answers[API, "getPid"] = refused()
    case.suspect()
    assert (case.gone, case.liveness.unreachable) == ([], ["/n"])
    case.answers[API, "getPid"] = [7, refused()]
    case.suspect()
    case.suspect()
    assert case.gone == [("/n", API)]


@pytest.mark.parametrize("answer", [silent(), [refused(), silent()]])
def test_a_node_that_is_silent_is_unreachable_and_stays(case: Case, answer: Any) -> None:
    case.suspect_answering(answer)
    assert (case.gone, case.liveness.unreachable) == ([], ["/n"])
    case.liveness.note_reached("/n")
    assert case.liveness.unreachable == []


@pytest.mark.parametrize(("answer", "gone"), [
    ([refused(), refused(), 7], []), (Fault(1, "no such method"), []), (None, []), ("seven", []), (-1, []),
    (ProtocolError("it speaks SSH"), [("/n", API)]),
], ids=["temporarily refused", "fault", "nothing", "no number", "no pid", "another server"])  # fmt: skip
def test_only_a_node_that_is_surely_not_at_its_address_is_removed(case: Case, answer: Any, gone: Any) -> None:
    case.suspect_answering(answer)
    assert case.gone == gone


def test_another_process_at_its_address_means_that_the_node_is_gone(case: Case) -> None:
    case.suspect_answering([7, 8])
    assert case.gone == []
    case.suspect()
    assert case.gone == [("/n", API)]


def test_a_node_that_was_started_again_on_its_old_port_stays(case: Case) -> None:
    case.suspect_answering([7, 8])
    case.register()
    case.suspect()
    case.suspect()
    assert case.gone == []


def test_hung_nodes_do_not_prevent_polling_others(case: Case) -> None:
    for number in range(PROBES_AT_A_TIME):
        case.register(f"/hanging_{number}", f"http://hanging:{number}/")
        case.answers[f"http://hanging:{number}/", "getPid"] = HANGS
    case.answers[API, "getPid"] = refused()

    async def until_it_is_gone() -> None:
        case.liveness.start()
        while len(case.asked) < PROBES_AT_A_TIME:
            await asyncio.sleep(0)
        case.register()
        while not case.gone:
            await asyncio.sleep(0)
        case.liveness.stop()

    asyncio.run(asyncio.wait_for(until_it_is_gone(), 30))
    assert case.gone == [("/n", API)]


def test_a_node_that_keeps_asking_is_rarely_probed(case: Case) -> None:
    case.register()
    case.register("/other", OTHER)
    connection = ThisMachineCaller("10.0.0.5", 4711)

    async def until_probed(api: str, *, is_asking: bool) -> None:
        while case.asked.count((api, "getPid")) < 9:
            if is_asking:
                case.liveness.note_asking("/n", API, connection)
            await asyncio.sleep(0)

    async def stop_asking() -> None:
        case.liveness.start()
        await until_probed(OTHER, is_asking=True)
        assert case.asked.count((API, "getPid")) < 5  # more than 0 if this test was held up
        await until_probed(API, is_asking=False)
        case.answers[API, "getPid"] = refused()
        while not case.gone:  # another peer asks in its name
            case.liveness.note_asking("/n", API, connection)
            await asyncio.sleep(0)
        case.liveness.stop()

    asyncio.run(asyncio.wait_for(stop_asking(), 30))


def test_a_node_that_moves_during_a_check_stays_registered(case: Case) -> None:
    case.register()
    case.answers[API, "getPid"] = refused()

    async def move_meanwhile() -> None:
        case.liveness.suspect("/n")
        case.register(api=OTHER)
        while case.liveness.suspects:
            await asyncio.sleep(0)

    asyncio.run(asyncio.wait_for(move_meanwhile(), 30))
    assert case.gone == []


@pytest.mark.parametrize(("name", "pid", "is_there"), [
    ("/n", 7, True), ("/somebody", 7, False), (Fault(1, "roscpp has no such method"), 7, True),
    (Fault(1, "roscpp has no such method"), refused(), False), (None, 7, True), (refused(), 7, False),
    (silent(), 7, False),
])  # fmt: skip
def test_an_address_belongs_to_a_node_while_it_responds_there(
    case: Case, name: Any, pid: Any, is_there: bool
) -> None:
    case.answers = {(API, "getName"): name, (API, "getPid"): pid}
    assert asyncio.run(case.liveness.is_at("/n", API)) is is_there


def test_an_address_that_another_node_has_registered_belongs_to_that_one(case: Case) -> None:
    case.register("/other", API)
    assert not asyncio.run(case.liveness.is_at("/n", API))
    assert case.asked == []


@pytest.mark.parametrize(("answer", "kept"), [
    (lambda: "/n", {"/n": True}), (lambda: "", {"/n": True}), (lambda: None, {"/n": True}),
    (lambda: Fault(1, "roscpp has no such method"), {"/n": True}), (silent, {"/n": False}), (refused, {}),
    (lambda: "/somebody", {}), (lambda: ProtocolError("it speaks SSH"), {}),
])  # fmt: skip
def test_after_a_crash_nodes_that_respond_or_may_be_slow_are_kept(
    case: Case, answer: Callable[[], Any], kept: dict[str, bool]
) -> None:
    case.answers[API, "getName"] = answer()
    assert asyncio.run(find_live_nodes({"/n": API}, timeout_s=5, ask=case.ask)) == kept


# Recipients


class Replaced:
    """A node `/n` at API that a successor at OTHER has replaced. `answers` has the names of APIs."""

    def __init__(self) -> None:
        self.answers: dict[str, str] = {}
        self.registry = Registry()
        self.registry.register_subscriber("/n", "/t", "*", API)
        [self.shutdown] = self.registry.register_subscriber("/n", "/t", "*", OTHER)
        self.liveness = Liveness(self.registry, lambda *_: None, ask=self.ask)
        self.nodes = RegisteredNodes(self.registry, self.liveness)

    async def ask(self, api: str, _method: str, _timeout_s: float) -> Any:
        if api not in self.answers:
            raise Unreachable(api, "no response in time")
        return self.answers[api]


def update(api: str) -> Notice:
    return Notice("/n", api, "publisherUpdate", (MASTER_ID, "/t", []))


@pytest.fixture
def replaced() -> Replaced:
    return Replaced()


def test_only_the_present_api_of_a_node_is_current(replaced: Replaced) -> None:
    assert replaced.nodes.is_current(update(OTHER))
    assert not replaced.nodes.is_current(update(API))


@pytest.mark.parametrize(("answer", "may"), [({API: "/n"}, True), ({API: "/other"}, False), ({}, False)])
def test_a_replaced_process_may_be_shut_down_while_its_address_is_its_own(
    replaced: Replaced, answer: dict[str, str], may: bool
) -> None:
    replaced.answers = answer
    assert asyncio.run(replaced.nodes.may_shut_down(replaced.shutdown)) is may


def test_a_delivered_notification_proves_that_a_node_is_alive(replaced: Replaced) -> None:
    replaced.nodes.on_delivered(update(OTHER))
    assert replaced.liveness.met_count == 1


def test_only_the_failure_of_the_present_api_makes_a_node_suspect(replaced: Replaced) -> None:
    async def fail(api: str) -> bool:
        replaced.nodes.on_failed(update(api), Unreachable(api, "Connection refused"))
        return "/n" in replaced.liveness.suspects

    assert not asyncio.run(fail(API))
    assert asyncio.run(fail(OTHER))


def test_a_replaced_process_counts_as_one_until_its_shutdown_is_finished(replaced: Replaced) -> None:
    assert replaced.registry.replaced == {("/n", API)}
    replaced.nodes.on_finished(replaced.shutdown)
    assert replaced.registry.replaced == set()
