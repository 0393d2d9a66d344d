"""Values that browsers send are parsed and computed outside of the event loop, because they may be large."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from pipros.basics.errors import PiprosError
from pipros_page.views import actions, calls, params
from pipros_page.views.actions import ActionViews
from pipros_page.views.calls import CallViews
from pipros_page.views.params import ParamViews
from pipros_server.daemon_pool import DaemonPool

POSE = {"name": "/arm", "type": "std_msgs/Float64"}


def first_publishing(system: Any, message: str) -> Any:
    async def run() -> None:
        async for _ in CallViews(system).publishing({**POSE, "message": message}):
            return

    return run()


REQUESTS: dict[str, Callable[[Any], Any]] = {
    "goal": lambda system: ActionViews(system).send_goal({**POSE, "goal": "{a: 1}"}),
    "large message": lambda system: first_publishing(system, "{data: 1" + " " * 20_000 + "}"),
    "expression": lambda system: first_publishing(system, '{data: "=i"}'),
    "parameter": lambda system: ParamViews(system).set_param({**POSE, "value": "1"}),
    "request": lambda system: CallViews(system).call_service({**POSE, "request": "[1]"}),
}


@pytest.mark.parametrize("kind", REQUESTS)
def test_values_are_parsed_in_threads(monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    threads = []

    def noted(function: Callable[..., Any]) -> Callable[..., Any]:
        def run(*args: Any, **kwargs: Any) -> Any:
            threads.append(threading.current_thread())
            return function(*args, **kwargs)

        return run

    for module in (actions, calls, params):
        for name in {"load", "message_from_yaml"} & vars(module).keys():
            monkeypatch.setattr(module, name, noted(vars(module)[name]))

    async def refuse(_: object) -> None:
        raise ConnectionError

    pool = DaemonPool("test", 1)
    gate = SimpleNamespace(check_parameter=lambda *_: 1 / 0, advertise=lambda *_, **__: 1 / 0)
    node = SimpleNamespace(name="/page")
    calls_ = SimpleNamespace(run=refuse)
    system = SimpleNamespace(computations=pool, questions=pool, gate=gate, node=node, calls=calls_)
    with pytest.raises((ZeroDivisionError, ConnectionError, PiprosError)):
        asyncio.run(REQUESTS[kind](system))

    assert threads
    assert threading.main_thread() not in threads
