"""Service calls mark episodes in a bag, which `pipros dataset` then finds."""

from pathlib import Path
from typing import Any

from pipros.msg import load_message_class, load_service_class
from pipros_data import open_bags
from pipros_data.datasets.config import DatasetConfig
from pipros_data.datasets.episodes import find_episodes
from pipros_data.datasets.marker import EpisodeMarker
from tests.support.bags import bag_bytes
from tests.support.nodes import MakeNode
from tests.support.waiting import wait_until

String: Any = load_message_class("std_msgs/String")
Trigger: Any = load_service_class("std_srvs/Trigger")


def test_calls_of_services_become_episodes(make_node: MakeNode, tmp_path: Path) -> None:
    node, other = make_node("episode_marker"), make_node("operator")
    EpisodeMarker(node, "/episode")
    received: list[Any] = []
    other.subscribe("/episode", String, received.append)
    start, stop = (other.client(f"/episode/{name}", Trigger) for name in ("start", "stop"))

    def call(client: Any) -> str:
        count = len(received)
        answer = client.call(Trigger._request_class())
        assert answer.success
        wait_until(lambda: len(received) > count)
        return str(answer.message)

    assert call(start) == "episode"
    call(stop)
    other.params.set("/episode/task", "open the drawer")
    assert call(start) == "open the drawer"
    call(stop)
    assert [each.data for each in received] == ["episode", "", "open the drawer", ""]

    path = tmp_path / "run.bag"
    path.write_bytes(bag_bytes([("/episode", each, 100 + n, 0) for n, each in enumerate(received)]))
    config = DatasetConfig(10, "skip", "/episode", "", "", (), (), 0.5, "")
    with open_bags(path) as bags:
        found = find_episodes(bags, str(path), config, 4)
    assert [(each.number, each.start / 1e9, each.end / 1e9, each.task) for each in found] == [
        (4, 100, 101, "episode"),
        (5, 102, 103, "open the drawer"),
    ]
