"""rosgraph.impl.graph, the library behind rqt_graph, has the same results as genuine rosgraph.

rqt_graph itself is not packaged by Debian; `examine_graph.py` reads the same parts.
"""

from __future__ import annotations

from pathlib import Path

from pipros.net.master_client import MasterClient
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

SCRIPT = Path(__file__).parent / "programs" / "examine_graph.py"


def test_both_find_the_same_graph(ros: RosSystem) -> None:
    ros.pipros.start_master()
    ros.pipros.start("rosrun", "composiv_tryouts", "composiv_talker.py")
    for name in ("one", "two"):
        program = ("rosrun", "composiv_tryouts", "composiv_listener.py", f"__name:={name}")
        (ros.pipros if name == "one" else ros.genuine).start(*program)
    ros.genuine.start(
        "rosrun", "cpp_battery", "battery_listener", "__ns:=/far", "battery_topic:=/battery_topic"
    )
    ros.wait_for_publisher("/battery_topic")
    wait_until(lambda: len(ros.subscribers("/battery_topic")) == 3, 60)
    with_nobody = MasterClient(ros.master_uri, "/ghost", timeout_s=60)
    with_nobody.register_publisher("/unheard", "std_msgs/String", "http://127.0.0.1:9/")

    [talker] = ros.publishers("/battery_topic")
    wanted = {
        f"nn_edges '{talker}' -> '{listener}' [/battery_topic] {talker}->{listener}"
        for listener in ("/one", "/two", "/far/cpp_listener")
    }
    graphs: list[list[str]] = []

    def are_the_same() -> bool:
        graphs[:] = _graph(ros, "python"), _graph(ros, "/usr/bin/python3")
        return graphs[0] == graphs[1] and wanted <= set(graphs[0])

    # Links, also those to /rosout, are made while nodes start, so two looks at them may differ.
    wait_until(are_the_same, 60, lambda: str(graphs))

    found = graphs[0]
    assert f"nt_edges '{talker}' -> ' /battery_topic' [] {talker}-> /battery_topic" in found
    assert "bad /ghost True" in found


def _graph(ros: RosSystem, python: str) -> list[str]:
    side = ros.pipros if python == "python" else ros.genuine
    return side.run(python, str(SCRIPT), "/ghost").stdout
