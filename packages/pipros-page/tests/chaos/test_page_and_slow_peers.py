"""The page while services or the master do not respond."""

import json
from collections.abc import Iterator

import pytest
from roscpp.srv import GetLoggers

from tests.support.page import LivePage, Page
from tests.support.ros import RosSystem
from tests.support.slaves import HungService, SilentSlave
from tests.support.waiting import wait_until


@pytest.fixture
def hung(ros: RosSystem) -> Iterator[HungService]:
    """A master, and `/hung/get_loggers`, which never responds."""
    ros.serve_master()
    service = HungService(ros.master_uri, "/hung/get_loggers", GetLoggers._type, GetLoggers._md5sum)
    yield service
    service.close()


def ask_for_loggers(browser: LivePage, count: int) -> None:
    for number in range(1000, 1000 + count):
        browser.socket.send(json.dumps({"id": number, "action": "loggers", "args": {"name": "/hung"}}))


def test_a_hung_service_does_not_delay_other_browsers(ros: RosSystem, hung: HungService) -> None:
    page = Page(ros)
    with page.connect() as waiting, page.connect() as browser:
        ask_for_loggers(waiting, 40)
        wait_until(lambda: hung.open_calls)
        assert "params" in next(browser.watch("params"))
        ask_for_loggers(browser, 1)
        wait_until(lambda: hung.open_calls > 4)


def test_calls_above_the_share_of_a_browser_are_refused(ros: RosSystem, hung: HungService) -> None:
    with Page(ros).connect() as browser:
        ask_for_loggers(browser, 5)
        answers = (json.loads(browser.socket.recv(timeout=30)) for _ in range(2))  # the first is the welcome
        assert "4 calls from this browser are pending" in [answer.get("error", "") for answer in answers][1]
        wait_until(lambda: hung.open_calls == 4)


def test_a_call_ends_when_the_browser_stops_it_or_leaves(ros: RosSystem, hung: HungService) -> None:
    page = Page(ros)
    with page.connect() as browser:
        ask_for_loggers(browser, 2)
        wait_until(lambda: hung.open_calls == 2)
        browser.socket.send(json.dumps({"id": 1000, "stop": True}))
        wait_until(lambda: hung.open_calls == 1)
    wait_until(lambda: hung.open_calls == 0)


@pytest.mark.parametrize("action", ["loggers", "call_service"])
def test_ctrl_c_ends_the_page_while_a_call_is_open(ros: RosSystem, hung: HungService, action: str) -> None:
    page = Page(ros, "--control")
    with page.connect() as browser:
        name = "/hung" if action == "loggers" else hung.name
        browser.socket.send(json.dumps({"id": 1, "action": action, "args": {"name": name}}))
        wait_until(lambda: hung.open_calls == 1)
        page.process.press_ctrl_c()
        assert page.process.wait() == 0


@pytest.mark.parametrize("view", ["topic", "params", "publishing", "processes", "console", "node"])
def test_a_silent_master_blocks_no_browser_and_not_ctrl_c(ros: RosSystem, view: str) -> None:
    silent = SilentSlave()
    try:
        page = Page(ros, "--control", ROS_MASTER_URI=silent.api)
        with page.connect() as stuck, page.connect() as browser:
            arguments = {"name": "/level", "type": "std_msgs/String", "message": "data: x"}
            before = len(silent.connections)
            stuck.socket.send(json.dumps({"id": 1, "view": view, "args": arguments}))
            wait_until(lambda: len(silent.connections) > before)
            assert browser.act("about")["control"] is True
            page.process.press_ctrl_c()
            assert page.process.wait() == 0
    finally:
        silent.stop()
