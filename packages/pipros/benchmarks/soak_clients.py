"""The clients of `soak_everything.py`: of rosbridge, Foxglove and MCP, and two pages in Chromium.

Each one counts its work in a Counter. An error is printed and counted as a failure, and the client goes on.
Only if a page cannot be opened does its client end, and the run with it.
"""

from __future__ import annotations

import asyncio
import json
import sys
import time
from collections import Counter
from collections.abc import Awaitable, Callable

import httpx2
from mcp import Client
from mcp.client.streamable_http import streamable_http_client
from playwright.async_api import Browser, CDPSession, Page, async_playwright
from playwright.async_api import TimeoutError as NeverShown
from soak_resources import Heap
from websockets.asyncio.client import ClientConnection, connect

from tests.support.browser import find_chromium

LIFE_S = 20.0
"""The time after which a client of a bridge reconnects."""
LIMIT_S = 60.0
CALL_EVERY_S = 0.2
PAGE_SAMPLE_S = 10.0
FOXGLOVE = "foxglove.sdk.v1"
FOXGLOVE_TOPICS = {"/chat", "/cloud", "/image", "/odom", "/scan", "/tf"}
PANELS = "panels/row(column(plot//number/data~images//image)~column(topics//operator/report~console))"
#: Counts the pictures that a page draws with a canvas.
COUNT_PICTURES = """
window.pictures = 0;
const { putImageData } = CanvasRenderingContext2D.prototype;
CanvasRenderingContext2D.prototype.putImageData = function (...args) {
  window.pictures += 1;
  return putImageData.apply(this, args);
};
"""
PANEL_TEXTS = """() => {
  const panels = [...document.querySelectorAll(".panel")];
  return { texts: panels.map((panel) => panel.innerText), pictures: window.pictures };
}"""
#: The toolbar of a panel may be folded.
CLEAR_LOG = (
    "[...document.querySelectorAll('.panel button')].find((each) => each.textContent === 'Clear').click()"
)
SCENE_STATE = """() => {
  const scene = document.querySelector(".tab-scene")?.scene;
  if (!scene?.displays?.length) return null;
  const errors = scene.all().flatMap((display) => (
    [...display.statuses.values()].filter(({ level }) => level === "error").map(({ text }) => text)));
  return {
    pictures: scene.figures.pictures,
    messages: scene.all().map((display) => display.received ?? 0).reduce((sum, each) => sum + each),
    errors,
  };
}"""
IS_SCENE_GOOD = f"() => ({SCENE_STATE})()?.errors.length === 0"
Report = Callable[[str, object], None]


def report_to(counts: Counter[str]) -> Report:
    def report(name: str, error: object) -> None:
        counts["failures"] += 1
        print(f"{name}: {error!r}", file=sys.stderr, flush=True)

    return report


async def retry(name: str, counts: Counter[str], use: Callable[[], Awaitable[None]]) -> None:
    """Call `use` again and again, and count its successes."""
    counts[name] += 0
    while True:
        try:
            await use()
            counts[name] += 1
        except Exception as error:
            report_to(counts)(name, error)
            await asyncio.sleep(1)


async def reconnect(
    name: str,
    counts: Counter[str],
    url: str,
    use: Callable[[ClientConnection], Awaitable[None]],
    **options: object,
) -> None:
    """Connect to a server for `LIFE_S`, again and again, and call `use` with each connection."""

    async def once() -> None:
        async with connect(url, max_size=None, proxy=None, **options) as socket:
            await use(socket)

    await retry(f"{name} connections", counts, once)


async def use_rosbridge(socket: ClientConnection, counts: Counter[str]) -> None:
    """Subscribe, publish what is then received, and call a service, in JSON."""

    async def send(**operation: object) -> None:
        await socket.send(json.dumps(operation))

    counts.update(dict.fromkeys(("rosbridge messages", "rosbridge echoes", "rosbridge calls"), 0))
    for topic in ("/chat", "/odom", "/echo"):
        await send(op="subscribe", topic=topic, **({"throttle_rate": 100} if topic == "/odom" else {}))
    await send(op="advertise", topic="/echo", type="std_msgs/String")
    end, next_call, is_called = time.monotonic() + LIFE_S, 0.0, False
    while (now := time.monotonic()) < end or is_called:
        if not is_called and next_call < now < end:
            next_call, is_called = now + CALL_EVERY_S, True
            await send(op="publish", topic="/echo", msg={"data": str(now)})
            await send(op="call_service", service="/ask", id="ask")
        found = json.loads(await asyncio.wait_for(socket.recv(), LIMIT_S))
        if found["op"] == "publish":
            counts["rosbridge echoes" if found["topic"] == "/echo" else "rosbridge messages"] += 1
        elif found["op"] == "service_response":
            counts["rosbridge calls" if found["values"]["success"] else "failures"] += 1
            is_called = False
        elif found["op"] == "status":
            raise RuntimeError(found["msg"])
        if now > end + LIMIT_S:
            raise TimeoutError("the service call was not answered")


async def use_foxglove(socket: ClientConnection, counts: Counter[str]) -> None:
    """Subscribe to several topics. A message must arrive on each of them."""
    counts["foxglove messages"] += 0
    channels: dict[int, str] = {}
    arrived: set[str] = set()
    end = time.monotonic() + LIFE_S
    while (now := time.monotonic()) < end or arrived < FOXGLOVE_TOPICS:
        if now > end + LIMIT_S:
            raise TimeoutError(f"never arrived: {FOXGLOVE_TOPICS - arrived}")
        data = await asyncio.wait_for(socket.recv(), LIMIT_S)
        if isinstance(data, bytes):
            if data[0] == 1:
                counts["foxglove messages"] += 1
                arrived.add(channels[int.from_bytes(data[1:5], "little")])
            continue
        found = json.loads(data)
        if found["op"] == "advertise":
            new = {
                each["id"]: each["topic"] for each in found["channels"] if each["topic"] in FOXGLOVE_TOPICS
            }
            channels |= new
            wanted = [{"id": number, "channelId": number} for number in new]
            await socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))


async def assist(url: str, token: str, counts: Counter[str]) -> None:
    """Ask for topics, a message and the reason for a silence, with a new connection every `LIFE_S`."""
    counts["answers to assistants"] += 0
    calls = (("list_topics", {}), ("read_topic", {"topic": "/chat"}), ("why_no_data", {"topic": "/image"}))
    headers = {"Authorization": f"Bearer {token}"}

    async def once() -> None:
        async with (
            httpx2.AsyncClient(headers=headers, timeout=LIMIT_S) as connection,
            Client(streamable_http_client(url, http_client=connection)) as client,
        ):
            end = time.monotonic() + LIFE_S
            while time.monotonic() < end:
                for name, arguments in calls:
                    answer = await client.call_tool(name, arguments)
                    counts["failures" if answer.is_error else "answers to assistants"] += 1
                await asyncio.sleep(CALL_EVERY_S * len(calls))

    await retry("assistants", counts, once)


async def view_pages(scene_url: str, panels_url: str, counts: Counter[str], heaps: tuple[Heap, Heap]) -> None:
    """Show the Scene tab and four panels in two windows of Chromium."""
    async with async_playwright() as playwright:
        browser = await playwright.chromium.launch(
            executable_path=find_chromium(),
            args=["--no-sandbox"],
            handle_sigint=False,
            handle_sigterm=False,
        )
        try:
            await asyncio.gather(
                view_scene(browser, scene_url, counts, heaps[0]),
                view_panels(browser, panels_url, counts, heaps[1]),
            )
        finally:
            await browser.close()


async def open_page(
    browser: Browser, url: str, counts: Counter[str], script: str = "", *, size: tuple[int, int] = (500, 400)
) -> Page:
    page = await browser.new_page(viewport={"width": size[0], "height": size[1]})
    report = report_to(counts)
    page.on("pageerror", lambda error: report("page", error))
    page.on("requestfailed", lambda request: report(request.url, request.failure))
    if script:
        await page.add_init_script(script)
    await page.goto(url, wait_until="commit")
    return page


async def collect(session: CDPSession, heap: Heap) -> None:
    """Append the size of a page's heap after garbage collection."""
    await session.send("HeapProfiler.collectGarbage")
    heap.megabytes.append((await session.send("Runtime.getHeapUsage"))["usedSize"] / 1e6)


async def view_scene(browser: Browser, url: str, counts: Counter[str], heap: Heap) -> None:
    counts.update({"scene pictures": 0, "scene messages": 0})
    page = await open_page(browser, url, counts)
    session = await page.context.new_cdp_session(page)

    async def look() -> None:
        await asyncio.sleep(PAGE_SAMPLE_S)
        try:  # messages that wait for their transforms are errors until the next picture
            await page.wait_for_function(IS_SCENE_GOOD, timeout=LIMIT_S * 1000)
        except NeverShown:
            report_to(counts)("scene", await page.evaluate(SCENE_STATE))
            return
        state = await page.evaluate(SCENE_STATE)
        counts["scene pictures"], counts["scene messages"] = state["pictures"], state["messages"]
        await collect(session, heap)

    await retry("looks at the scene", counts, look)


async def view_panels(browser: Browser, url: str, counts: Counter[str], heap: Heap) -> None:
    page = await open_page(browser, url, counts, COUNT_PICTURES, size=(900, 800))  # small ones show no image
    session = await page.context.new_cdp_session(page)
    await page.locator(".picture canvas:visible").wait_for(timeout=LIMIT_S * 1000)
    names, before = ("plot", "images", "topic", "log"), [""] * 4
    counts["images drawn"] += 0

    async def look() -> None:
        nonlocal before
        await asyncio.sleep(PAGE_SAMPLE_S)
        state = await page.evaluate(PANEL_TEXTS)
        counts["images drawn"] = state["pictures"]
        for name, old, new in zip(names, before, state["texts"], strict=True):
            if name != "images":  # its text, the size, stays the same
                counts[f"panel {name} changed"] += old != new
        before = state["texts"]
        await page.evaluate(CLEAR_LOG)  # which keeps 100,000 entries
        await collect(session, heap)

    await retry("looks at the panels", counts, look)
