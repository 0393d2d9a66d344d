#!/usr/bin/env python3
"""Costs of rqt_graph's page, with many browsers that show fast topics and large images.

    script/bench page [--browsers 20] [--seconds 10] [--quick]

A publisher sends a number 1,000 times and images of 1 MB 30 times a second. There are four runs: without a
page; with a page but no browser; with browsers that show the number, its curve, the image and the graph; and
with one more browser that has stopped reading. Each row has the publisher's rate and processor usage, the
number of images that each browser received, and the server's processor time and memory.
`--quick` takes 3 seconds per run. Nothing else should be running.
"""

import asyncio
import contextlib
import json
import subprocess
import threading
import time
from urllib.parse import urlsplit

import psutil
from programs import Programs
from table import options_of
from websockets.asyncio.client import connect

PUBLISHER = """
import sys, time
import rospy
from sensor_msgs.msg import Image
from std_msgs.msg import Float64
rospy.init_node("camera")
numbers = rospy.Publisher("number", Float64, queue_size=100)
images = rospy.Publisher("image", Image, queue_size=2)
image = Image(width=1000, height=333, step=3000, encoding="rgb8", data=bytes(999000))
begin = told = time.monotonic()
count = seen = 0
while not rospy.is_shutdown():
    numbers.publish(float(count % 100))
    if count % 33 == 0:
        images.publish(image)
    count += 1
    now = time.monotonic()
    if now - told >= 1.0:
        print((count - seen) / (now - told), flush=True)
        told, seen = now, count
    time.sleep(max(0.0, begin + count / 1000 - now))
"""


VIEWS = (
    ("topic", {"name": "/number"}),
    ("plot", {"field": "/number/data"}),
    ("image", {"name": "/image"}),
    ("graph", {}),
)
IMAGE, IMAGE_IN_PARTS, LAST_OF_BYTES = 2, (1 << 31) + 2, 2  # see server/view_server.py


def main():
    options = options_of(__doc__, browsers=20, seconds=10.0, quick=False)
    seconds = 3.0 if options.quick else options.seconds
    titles = f"{'publisher':>9} {'its CPU':>8} {'images each':>12} {'server CPU':>11} {'server memory':>14}"
    print(f"{'':28} {titles}")
    rows = [("no page", None, False), ("a page, no browser", 0, False)]
    rows += [(f"{options.browsers} browsers", options.browsers, False)]
    rows += [(f"{options.browsers} browsers, one stuck", options.browsers, True)]
    for name, browsers, is_stuck in rows:
        print(row(name, browsers, is_stuck, seconds), flush=True)


def publishing(programs):
    """Start the publisher, and wait until it publishes."""
    publisher = programs.run(PUBLISHER, stdout=subprocess.PIPE)
    publisher.stdout.readline()
    return publisher


def drain(stream):
    """Read a stream in a thread, so that its program is never blocked by a full pipe."""
    threading.Thread(target=lambda: [None for _ in stream], daemon=True).start()


def row(name, browsers, is_stuck, seconds):
    with Programs() as programs:
        publisher = publishing(programs)
        received, cpu, memory = 0, 0.0, 0
        own = psutil.Process(publisher.pid)
        own.cpu_percent()
        if browsers is not None:
            server, url = programs.page("rqt_graph")
            drain(server.stderr)
            process = psutil.Process(server.pid)
            received, cpu, memory = asyncio.run(look(url, process, browsers, is_stuck, seconds))
        else:
            time.sleep(seconds)
        own_cpu = own.cpu_percent()
        publisher.send_signal(2)
        rates = [float(line) for line in publisher.communicate(timeout=20)[0].split()][-int(seconds) + 1 :]
        images = f"{received / browsers / seconds:.1f}/s" if browsers else ""
        use = f"{cpu:10.0f}% {memory / 1e6:11.1f} MB" if browsers is not None else ""
        return f"{name:28} {sum(rates) / len(rates):6.0f} Hz {own_cpu:7.0f}% {images:>12} {use}"


async def look(url, process, browsers, is_stuck, seconds):
    """Return the number of images that all browsers received, and the server's processor usage (%) and
    maximum memory.
    """
    counts = [0] * browsers
    tasks = [asyncio.create_task(browse(url, counts, index)) for index in range(browsers)]
    if is_stuck:
        tasks.append(asyncio.create_task(get_stuck(url)))
    await asyncio.sleep(2.0)
    counts[:] = [0] * browsers
    process.cpu_percent()
    memory = 0
    for _ in range(int(seconds * 5)):
        await asyncio.sleep(0.2)
        memory = max(memory, process.memory_info().rss)
    found = sum(counts), process.cpu_percent(), memory
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
    return found


async def browse(url, counts, index):
    async with connected(url) as socket:
        async for message in socket:
            if isinstance(message, bytes):
                number, end = int.from_bytes(message[:4], "big"), message[4]
                counts[index] += number == IMAGE or (number == IMAGE_IN_PARTS and end == LAST_OF_BYTES)


async def get_stuck(url):
    async with connected(url) as socket:
        socket.transport.pause_reading()
        await asyncio.Event().wait()


@contextlib.asynccontextmanager
async def connected(url):
    """Connect as a browser that shows the views."""
    parts = urlsplit(url)
    token = parts.fragment.partition("/")[0].removeprefix("token=")
    async with connect(
        f"ws://{parts.netloc}/live",
        origin=f"http://{parts.netloc}",
        max_size=None,
        proxy=None,
        compression=None,
    ) as socket:
        await socket.send(json.dumps({"token": token}))
        for number, (view, args) in enumerate(VIEWS):
            await socket.send(json.dumps({"id": number, "view": view, "args": args}))
        yield socket


if __name__ == "__main__":
    main()
