"""How much a browser requests before it shows something: one bundle; three.js comes with a scene."""

from __future__ import annotations

from typing import Any
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Page as Tab
from playwright.sync_api import expect

from tests.browser.chromium import OpenTab
from tests.support import page_bundle
from tests.support.npm import INSTALL
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until


class Transfers:
    """The files that a tab has received, and their sizes as transferred, heads included."""

    def __init__(self, tab: Tab) -> None:
        self.bytes = 0
        self.paths: list[str] = []
        session = tab.context.new_cdp_session(tab)
        session.on("Network.requestWillBeSent", self._note_request)
        session.on("Network.loadingFinished", self._note_bytes)
        session.send("Network.enable")

    def _note_request(self, event: dict[str, Any]) -> None:
        self.paths.append(urlsplit(event["request"]["url"]).path)

    def _note_bytes(self, event: dict[str, Any]) -> None:
        self.bytes += event["encodedDataLength"]


def test_a_graph_needs_few_requests_and_a_scene_one_library_more(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    page = Page(ros)
    tab = open_tab(page, "graph")
    tab.goto("about:blank")
    transfers = Transfers(tab)
    tab.goto(page.url_of("graph"))
    expect(tab.locator(".tab-graph")).to_contain_text("Nothing to show")
    assert len(transfers.paths) + 1 <= 12, transfers.paths  # and the WebSocket
    assert transfers.bytes <= 150_000
    assert not any("three" in path for path in transfers.paths)
    tab.goto(page.url_of("scene"))
    expect(tab.locator(".tab-scene canvas").first).to_be_visible()
    wait_until(lambda: tab.evaluate("!!document.querySelector('.tab-scene').scene"), 60, "the scene")
    assert "/bundle/three.js" in transfers.paths
    assert len(transfers.paths) + 1 <= 12, transfers.paths
    assert transfers.bytes <= 600_000


def test_developers_get_the_modules_themselves(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    page = Page(ros)
    tab = open_tab(page, "graph")
    tab.goto("about:blank")
    transfers = Transfers(tab)
    tab.goto(page.url_of("graph").replace("/#", "/index.html#"))
    expect(tab.locator(".tab-graph")).to_contain_text("Nothing to show")
    assert "/tabs/graph.js" in transfers.paths
    assert "/bundle/app.js" not in transfers.paths


def test_the_bundle_is_what_esbuild_makes_of_the_sources() -> None:
    if not page_bundle.ESBUILD.exists():
        pytest.skip(f"esbuild is not on this machine: {INSTALL}")
    assert page_bundle.differences() == []
