"""ros_comm#2369: `rosservice call` with `now` or `auto` failed, because its time was not initialized."""

from __future__ import annotations

import time
from typing import Any

import pytest

from pipros.msg import load_service_class
from pipros_tools.cli.rosservice import main
from tests.support.nodes import MakeNode


@pytest.mark.parametrize("header", ["auto", "{stamp: now, frame_id: map}"])
def test_a_request_can_have_the_current_time(
    make_node: MakeNode, monkeypatch: pytest.MonkeyPatch, header: str
) -> None:
    get_plan: Any = load_service_class("nav_msgs/GetPlan")
    node, stamps = make_node("planner"), []
    monkeypatch.setenv("ROS_MASTER_URI", node.master.uri)

    def plan(request: Any) -> Any:
        stamps.append(request.start.header.stamp.to_sec())
        return get_plan._response_class()

    node.serve("/plan", get_plan, plan)
    before = time.time()
    assert main(["call", "/plan", f"{{start: {{header: {header}}}}}"]) == 0
    assert before - 1 <= stamps[0] <= time.time() + 1
