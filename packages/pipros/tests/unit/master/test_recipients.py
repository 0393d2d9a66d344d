from __future__ import annotations

import asyncio
from typing import Any

import pytest

from pipros.basics.errors import Unreachable
from pipros.master.liveness import Liveness
from pipros.master.registry import MASTER_ID, Notice, Registry
from pipros.master.server import RegisteredNodes

A, B = "http://a:1/", "http://b:2/"


class Case:
    """A node `/n` at A that a successor at B has replaced. `answers` has the names of APIs."""

    def __init__(self) -> None:
        self.answers: dict[str, str] = {}
        self.registry = Registry()
        self.registry.register_subscriber("/n", "/t", "*", A)
        [self.shutdown] = self.registry.register_subscriber("/n", "/t", "*", B)
        self.liveness = Liveness(self.registry, lambda *_: None, ask=self.ask)
        self.nodes = RegisteredNodes(self.registry, self.liveness)

    async def ask(self, api: str, _method: str, _timeout_s: float) -> Any:
        if api not in self.answers:
            raise Unreachable(api, "no response in time")
        return self.answers[api]


def update(api: str) -> Notice:
    return Notice("/n", api, "publisherUpdate", (MASTER_ID, "/t", []))


@pytest.fixture
def case() -> Case:
    return Case()


def test_only_the_present_api_of_a_node_is_current(case: Case) -> None:
    assert case.nodes.is_current(update(B))
    assert not case.nodes.is_current(update(A))


@pytest.mark.parametrize(("answer", "may"), [({A: "/n"}, True), ({A: "/other"}, False), ({}, False)])
def test_a_replaced_process_may_be_shut_down_while_its_address_is_its_own(
    case: Case, answer: dict[str, str], may: bool
) -> None:
    case.answers = answer
    assert asyncio.run(case.nodes.may_shut_down(case.shutdown)) is may


def test_a_delivered_notification_proves_that_a_node_is_alive(case: Case) -> None:
    case.nodes.on_delivered(update(B))
    assert case.liveness.met_count == 1


def test_only_the_failure_of_the_present_api_makes_a_node_suspect(case: Case) -> None:
    async def fail(api: str) -> bool:
        case.nodes.on_failed(update(api), Unreachable(api, "Connection refused"))
        return "/n" in case.liveness.suspects

    assert not asyncio.run(fail(A))
    assert asyncio.run(fail(B))


def test_a_replaced_process_counts_as_one_until_its_shutdown_is_finished(case: Case) -> None:
    assert case.registry.replaced == {("/n", A)}
    case.nodes.on_finished(case.shutdown)
    assert case.registry.replaced == set()
