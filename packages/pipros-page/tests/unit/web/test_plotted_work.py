"""The plots of one browser may not use up the threads that receive messages for all browsers."""

from __future__ import annotations

import time
from contextvars import copy_context
from types import SimpleNamespace
from typing import Any

import pytest
from std_msgs.msg import Float64

from pipros_page.curve_samples import Axis, find_field
from pipros_page.views import plot
from pipros_server.browser_share import set_current_browser


def test_plots_of_a_browser_share_the_time_for_computing(monkeypatch: pytest.MonkeyPatch) -> None:
    now_s = 100.0
    monkeypatch.setattr(time, "thread_time", lambda: now_s)
    monkeypatch.setattr(time, "monotonic", lambda: 7.0)
    decoded = []

    def decode(message: Any) -> Any:
        nonlocal now_s
        now_s += 0.1
        decoded.append(message)
        return message

    def curve() -> Any:
        watch: Any = SimpleNamespace(decode=decode, topic="/a")
        field: Any = find_field("/a/data", {"/a": ""})
        return plot._Curve(watch, field, Axis.RECEIVED, plot._RosTime())

    greedy, other = copy_context(), copy_context()
    greedy.run(set_current_browser)
    other.run(set_current_browser)
    for each in [greedy.run(curve) for _ in range(50)]:
        each.add(Float64(1.0), 1.0)
    assert len(decoded) == 6
    other.run(curve).add(Float64(2.0), 1.0)
    assert decoded[-1].data == 2.0
