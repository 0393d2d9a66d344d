from __future__ import annotations

from pipros_tools.graph.system_state import SystemState
from pipros_tools.health.nodelet_checks import services_of_managers, slow_nodelets
from pipros_tools.health.system_report import SystemReport


def test_nodelets_that_drop_messages_are_found() -> None:
    lines = (
        "/a (x/A): /one 10.0 Hz, 0 of 100 dropped; /two 20.5 Hz, 30 of 200 dropped",
        "/b (x/B): no input",
    )
    system = SystemReport("http://m:1", SystemState.from_state([[], [], []]), nodelets=lines)
    (finding,) = slow_nodelets(system)
    assert finding.summary == "The nodelet [/a] dropped 30 of 200 messages of [/two] within a minute"
    assert finding.subjects == ("/a", "/two")


def test_only_managers_in_python_are_asked() -> None:
    services = ["/m/load_nodelet", "/m/inputs", "/genuine/load_nodelet", "/other/inputs"]
    state = SystemState.from_state([[], [], [[name, ["/n"]] for name in services]])
    assert list(services_of_managers(state)) == ["/m/inputs"]
