import threading
from types import SimpleNamespace
from typing import Any

from pipros_libraries.nodelets.hosting import SAMPLES, InputWatch
from tests.support.nodes import listening_log
from tests.support.waiting import wait_until


def watched(statistics: dict[str, int], period_s: float) -> tuple[InputWatch, list[str], list[Any]]:
    """Return a watch of one nodelet, its log, and the list of nodelets."""
    log, lines = listening_log()
    subscriber = SimpleNamespace(topic="/scan", statistics=lambda: dict(statistics))
    node = SimpleNamespace(name="/slow", subscribers=[subscriber])
    nodelets: list[Any] = []
    is_loaded = threading.Event()

    def wait_for_shutdown(period_s: float) -> bool:
        return period_s > 1 or not is_loaded.wait(60) or len(lines) > 0

    host: Any = SimpleNamespace(name="/host", log=log, wait_for_shutdown=wait_for_shutdown)
    watch = InputWatch(host, lambda: nodelets, period_s)
    nodelets.append((node, "a/Slow"))
    is_loaded.set()
    return watch, lines, nodelets


def test_a_nodelet_that_drops_messages_is_named_after_a_minute() -> None:
    _, lines, _ = watched({"frames": 30, "dropped": 10}, 0.0)
    wait_until(lambda: bool(lines))
    assert lines[0].startswith("nodelet /slow is slower than its input: /scan ")
    assert lines[0].endswith("10 of 40 dropped")
    assert SAMPLES == 12


def test_rates_start_again_with_a_new_subscription() -> None:
    statistics = {"frames": 100, "dropped": 0}
    watch, _, nodelets = watched(statistics, 1000.0)
    (state,) = watch.states()
    assert (state.nodelet, state.topic, state.received, state.dropped) == ("/slow", "/scan", 100, 0)
    assert state.rate_hz > 0
    nodelets.clear()
    assert watch.states() == []
