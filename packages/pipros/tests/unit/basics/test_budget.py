"""Budgets of servers and their clients."""

import random
from concurrent.futures import ThreadPoolExecutor

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipros.basics.budget import Budget, SharedBudget
from pipros.basics.shares import fair_shares
from pipros.basics.turns import Turns


def test_an_amount_is_taken_from_a_budget_and_from_all_its_ancestors() -> None:
    server = Budget(100)
    client = Budget(50, server)
    topic = Budget(20, client)
    assert topic.take(15)
    assert client.take(5)
    assert (topic.used, client.used, server.used) == (15, 20, 20)
    topic.give_back(10)
    assert (topic.used, client.used, server.used) == (5, 10, 10)
    assert (topic.peak, client.peak, server.peak) == (15, 20, 20)


@pytest.mark.parametrize("limits", [(10, 99, 99), (99, 10, 99), (99, 99, 10)])
def test_an_amount_that_does_not_fit_somewhere_is_taken_nowhere(limits: tuple[int, int, int]) -> None:
    server = Budget(limits[0])
    client = Budget(limits[1], server)
    topic = Budget(limits[2], client)
    assert not topic.take(11)
    assert (topic.used, client.used, server.used, topic.left) == (0, 0, 0, 10)
    assert topic.take(10)
    assert topic.left == 0


def test_only_a_client_that_exceeds_its_own_limit_counts_as_refused() -> None:
    server = Budget(10)
    greedy, modest = Budget(9, server), Budget(9, server)
    assert not greedy.take(10)
    assert greedy.take(9)
    assert not greedy.take(1)
    assert greedy.refusals == 2
    assert not modest.take(2)
    assert modest.refusals == 0


def test_closing_a_client_returns_everything_and_later_returns_are_ignored() -> None:
    server = Budget(100)
    client = Budget(100, server)
    topic = Budget(100, client)
    assert client.take(40)
    assert topic.take(40)
    client.close()
    client.close()
    assert server.used == 0
    topic.give_back(40)
    client.give_back(40)
    assert server.used == 0
    assert not client.take(0.5)
    assert not topic.take(1)
    assert client.hold(40, 0)
    assert not client.hold(0, 1)
    assert (client.left, client.refusals) == (0, 0)


def test_greedy_clients_with_a_part_leave_room_for_the_next() -> None:
    server = Budget(1024)
    taken = []
    for _ in range(5):
        client = Budget(1024, server, part=0.5)
        while client.take(1):
            pass
        taken.append(client.used)
        assert client.refusals == 0
    assert taken == [512, 256, 128, 64, 32]


def test_what_a_client_has_of_its_own_cannot_be_used_up_by_others() -> None:
    server = Budget(10)
    greedy, modest = Budget(100, server, own=2), Budget(100, server, part=0.5, own=3)
    assert greedy.take(12)
    assert (server.used, modest.left) == (10, 3)
    assert modest.take(3)
    assert not modest.take(1)
    assert (modest.used, server.used) == (3, 10)
    greedy.give_back(12)
    assert modest.left == 5
    assert modest.take(5)
    assert (modest.used, server.used) == (8, 5)
    modest.close()
    assert server.used == 0


def test_a_charge_is_never_refused_but_leaves_less_for_later() -> None:
    server = Budget(10)
    client = Budget(5, server)
    client.charge(12)
    assert (client.used, server.used, client.left) == (12, 12, 0)
    assert not server.take(1)
    client.give_back(9)
    assert client.take(2)
    client.close()
    client.charge(1)
    assert server.used == 0


def test_an_amount_can_be_replaced_by_another() -> None:
    server = Budget(100)
    client = Budget(50, server)
    assert client.hold(0, 30)
    assert client.hold(30, 50)
    assert not client.hold(50, 51)
    assert client.hold(50, 10)
    assert (client.used, server.used) == (10, 10)


def test_an_amount_that_was_not_taken_cannot_be_returned() -> None:
    budget = Budget(5)
    assert budget.take(2)
    with pytest.raises(ValueError, match="between 0 and 2, got 3"):
        budget.give_back(3)
    with pytest.raises(ValueError, match="got -1"):
        budget.give_back(-1)
    with pytest.raises(ValueError, match="got -1"):
        budget.take(-1)
    assert budget.used == 2


@pytest.mark.parametrize(("limit", "part"), [(-1, 1.0), (1, 0.0), (1, 1.1)])
def test_invalid_budgets_are_refused(limit: float, part: float) -> None:
    with pytest.raises(ValueError, match="limit must be >= 0"):
        Budget(limit, part=part)


@pytest.mark.parametrize("seed", range(5))
def test_a_parent_always_holds_the_sum_of_its_children(seed: int) -> None:
    chance = random.Random(seed)  # noqa: S311
    server = Budget(100)
    clients: dict[Budget, int] = {Budget(40, server, part=0.7): 0 for _ in range(6)}
    for _ in range(2_000):
        client = chance.choice(list(clients))
        amount = chance.randrange(30)
        if chance.random() < 0.02:
            client.close()
            del clients[client]
            clients[Budget(40, server, part=0.7)] = 0
        elif chance.random() < 0.5:
            clients[client] += amount if client.take(amount) else 0
        else:
            amount = min(amount, clients[client])
            client.give_back(amount)
            clients[client] -= amount
        assert server.used == sum(clients.values()) <= 100
        assert all(each.used == expected for each, expected in clients.items())


def test_threads_never_take_more_than_the_limit_together() -> None:
    server = Budget(1_000)
    clients = [Budget(1_000, server) for _ in range(8)]

    def work(client: Budget) -> None:
        for _ in range(500):
            if client.take(7):
                client.give_back(7)
        while client.take(1):
            pass

    with ThreadPoolExecutor(len(clients)) as threads:
        list(threads.map(work, clients))
    assert server.used == sum(client.used for client in clients) == server.peak == 1_000


# Fair division of a limit.


@given(st.dictionaries(st.integers(), st.integers(0, 100), max_size=10), st.integers(0, 300))
def test_no_one_gets_less_than_another_who_got_more_than_wanted(wanted: dict[int, int], limit: int) -> None:
    shares = fair_shares(wanted, limit)

    assert shares.keys() == wanted.keys()
    assert sum(shares.values()) == min(limit, sum(wanted.values()))
    for user, share in shares.items():
        assert share <= wanted[user]
        if share < wanted[user]:  # at most one less than any other, by rounding
            assert share >= max(shares.values()) - 1


# Queue that serves its users in turns.


def test_a_user_with_many_items_does_not_delay_another() -> None:
    turns: Turns[str, int] = Turns()
    for number in range(1_000):
        turns.put("greedy", number)
    turns.put("modest", 1)
    turns.put("modest", 2)
    assert [turns.pop() for _ in range(5)] == [
        ("greedy", 0), ("modest", 1), ("greedy", 1), ("modest", 2), ("greedy", 2),
    ]  # fmt: skip
    assert len(turns) == turns.waiting("greedy") == 997
    assert turns.waiting("modest") == 0


def test_the_items_of_a_user_that_has_left_are_removed_at_once() -> None:
    turns: Turns[str, int] = Turns()
    for number in range(3):
        turns.put("a", number)
    turns.put("b", 9)
    assert (turns.forget("a"), turns.forget("a")) == ([0, 1, 2], [])
    assert len(turns) == 1
    assert turns.pop() == ("b", 9)
    with pytest.raises(IndexError, match="empty"):
        turns.pop()


def test_a_user_that_returns_waits_for_the_others() -> None:
    turns: Turns[str, int] = Turns()
    turns.put("a", 1)
    turns.put("b", 2)
    assert turns.pop() == ("a", 1)
    turns.put("a", 3)
    assert [turns.pop(), turns.pop()] == [("b", 2), ("a", 3)]


def test_each_user_of_a_shared_budget_leaves_half_to_others() -> None:
    budget = SharedBudget(64)
    assert sum(budget.take("greedy") for _ in range(64)) == 32
    assert sum(budget.take("other") for _ in range(64)) == 16
    for _ in range(32):
        budget.give_back("greedy")
    assert not budget.take("late", 25)
    assert budget.take("late", 24)
    budget.give_back("late", 24)
    assert budget._users.keys() == {"other"}
