#!/usr/bin/env python3
"""Costs of the Scene tab: time to the first picture, time for each picture, clouds, and processor time.

    benchmarks/scene.py [--seconds 8] [--only TEXT]

Needs Chromium and Playwright, which draw in software (SwiftShader) at 1000 x 600 pixels, without
anti-aliasing except where the row says so. A publisher sends 50 frames, a robot of 30 links, a scan, and
clouds of 50,000 and 200,000 points of 32 bytes ten times a second. The first picture includes loading
three.js, whose time is in the second column. In the row of 10 Mbit/s, a forwarder between server and browser
simulates such a link, with a delay. Then come pictures of lines and cubes alone, and of the same ones drawn
with three.js's own LineSegments2 and InstancedMesh (from npm); and viewers without a browser, which receive
data and do not draw: the slowest viewer's messages per second, and the server's processor time. Nothing else
should be running.
"""

import argparse
import asyncio
import contextlib
import functools
import http.server
import json
import os
import re
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import psutil
from playwright.sync_api import sync_playwright
from slow_link import SlowLink
from websockets.asyncio.client import connect

ROOT = os.path.abspath(os.path.join(__file__, "..", "..", "..", ".."))
SCRIPTS = os.path.dirname(sys.executable)
PORT = 13971
PUBLISHER = """
import os
import rospy, tf2_ros
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import LaserScan, PointCloud2, PointField
import struct
rospy.init_node("source")
links = "".join(
    f'<link name="l{n}"><visual><geometry><cylinder radius="0.1" length="0.3"/></geometry></visual>'
    + "</link>"
    + (f'<joint name="j{n}" type="fixed"><parent link="l0"/><child link="l{n}"/></joint>' if n else "")
    for n in range(30))
rospy.set_param("/robot_description", f'<robot name="r">{links}</robot>')
def cloud(count):
    fields = [PointField(name, 4 * n, 7, 1) for n, name in enumerate(("x", "y", "z", "intensity"))]
    made = PointCloud2(height=1, width=count, point_step=32, row_step=32 * count, fields=fields)
    made.header.frame_id = "map"
    made.data = b"".join(struct.pack("<4f16x", n % 100 / 20 - 2, n // 100 % 100 / 20 - 2, n / count, n % 7)
                         for n in range(count))
    return made
clouds = {rospy.Publisher(f"/cloud{n}", PointCloud2, queue_size=1): cloud(n * 1000) for n in (50, 200)}
scans = rospy.Publisher("/scan", LaserScan, queue_size=1)
scan = LaserScan(range_max=9, angle_increment=0.017, ranges=[3.0] * 360)
scan.header.frame_id = "map"
frames = tf2_ros.TransformBroadcaster()
rate = rospy.Rate(10)
while not rospy.is_shutdown():
    now = rospy.Time.now()
    sent = []
    for n in range(50):
        each = TransformStamped(child_frame_id=f"l{n}")
        each.header.frame_id, each.header.stamp = "map", now
        each.transform.translation.x, each.transform.translation.y = n % 10 - 5, n // 10 - 2
        each.transform.rotation.w = 1
        sent.append(each)
    frames.sendTransform(sent)
    scans.publish(scan)
    for publisher, message in clouds.items():
        if publisher.get_num_connections():
            publisher.publish(message)
    rate.sleep()
"""
FILE = """\
Visualization Manager:
  Displays: [{displays}]
  Global Options: {{Fixed Frame: map}}
Window Geometry: {{Hide Left Dock: true}}
"""
ROBOT = (
    "{Class: rviz/Grid, Name: Grid}, {Class: rviz/RobotModel, Name: Robot}, {Class: rviz/TF, Name: TF}, "
    "{Class: rviz/LaserScan, Name: Scan, Topic: /scan}"
)
CLOUD = "{{Class: rviz/PointCloud2, Name: Cloud, Topic: /cloud{0}, Style: Points}}"
SCENES = {
    "robot of 30 links, 50 frames, grid, scan": (ROBOT, "Scan"),
    "the same, anti-aliased": (ROBOT, "Scan"),
    "50,000 points at 10 Hz": (CLOUD.format(50), "Cloud"),
    "200,000 points at 10 Hz": (CLOUD.format(200), "Cloud"),
    "200,000 points over 10 Mbit/s, 50 ms": (CLOUD.format(200), "Cloud"),
}
JAGGED = "--disable-anti-aliasing"
SLOW = 1_250_000, 0.05
"""The slow link: its rate in bytes per second, and its delay in seconds."""
THREE = """() => {
  const own = performance.getEntriesByType("resource").filter(({ name }) => name.includes("/vendor/three/"));
  return Math.max(...own.map((each) => each.responseEnd)) - Math.min(...own.map((each) => each.startTime));
}"""
ALONE = {"5,000 wide lines": "lines", "20,000 cubes": "cubes"}
CLOUD_VIEW = "scene_cloud", {"name": "/cloud200", "limit": 200_000, "fields": ["intensity"]}
SMALL_VIEWS = (
    ("scene_cloud", {"name": "/cloud50", "limit": 5000, "fields": ["intensity"]}),
    ("scene_messages", {"name": "/tf", "queue": 1000}),
)
VIEWERS = {
    "a viewer of 200,000 points at 10 Hz": (1, (CLOUD_VIEW,), False),
    "2 viewers of 200,000 points": (2, (CLOUD_VIEW,), False),
    "20 viewers of 5,000 points, 50 frames": (20, SMALL_VIEWS, False),
    "20 viewers, one stuck": (20, SMALL_VIEWS, True),
}
"""For each row, the number of viewers, the views that each watches, and whether another one stops reading."""
DRAW_ALONE = """async (kind) => {
  const { scene } = document.querySelector(".tab-scene");
  Object.assign(scene.canvas.style, { width: "1000px", height: "600px" });
  const { wideLines } = await import("/scene/shapes.js");
  const { points } = await import("/scene/points.js");
  const count = kind === "lines" ? 10000 : 20000;
  const places = Float32Array.from({ length: count * 3 }, (_, i) => ((Math.sin(i) * 43758.5453) % 1) * 4);
  const made = kind === "lines"
    ? wideLines([...places], 0.03, [1, 0, 0, 1])
    : points("Boxes", places, new Uint8Array(count * 4).fill(200), 0.05);
  scene.objects.add(made);
  const gl = scene.renderer.getContext();
  await new Promise((done) => { setTimeout(done, 2000); });
  const times = [];
  for (let i = 0; i < 30; i += 1) {
    const begin = performance.now();
    scene.draw();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    times.push(performance.now() - begin);
    await new Promise(requestAnimationFrame);
  }
  const { camera } = scene.view;
  return [times.sort((a, b) => a - b)[15], camera.projectionMatrix.elements, camera.matrixWorld.elements];
}"""
BARE_PAGE = """<canvas width="1000" height="600"></canvas><script type="importmap">
{"imports": {"three": "/build/three.module.js", "three/addons/": "/examples/jsm/"}}</script>"""
DRAW_BARE = """async ([kind, projection, world]) => {
  const THREE = await import("three");
  const { LineSegments2 } = await import("three/addons/lines/LineSegments2.js");
  const { LineSegmentsGeometry } = await import("three/addons/lines/LineSegmentsGeometry.js");
  const { LineMaterial } = await import("three/addons/lines/LineMaterial.js");
  const canvas = document.querySelector("canvas");
  const renderer = new THREE.WebGLRenderer({ canvas, preserveDrawingBuffer: true });
  const camera = new THREE.PerspectiveCamera();
  camera.matrixAutoUpdate = false;
  camera.projectionMatrix.fromArray(projection);
  camera.projectionMatrixInverse.copy(camera.projectionMatrix).invert();
  camera.matrix.fromArray(world);
  camera.matrixWorldNeedsUpdate = true;
  const count = kind === "lines" ? 10000 : 20000;
  const places = Float32Array.from({ length: count * 3 }, (_, i) => ((Math.sin(i) * 43758.5453) % 1) * 4);
  let made;
  if (kind === "lines") {
    const material = new LineMaterial({ color: 0xff0000, linewidth: 0.03, worldUnits: true });
    made = new LineSegments2(new LineSegmentsGeometry().setPositions(places), material);
  } else {
    const box = new THREE.BoxGeometry(0.05, 0.05, 0.05);
    made = new THREE.InstancedMesh(box, new THREE.MeshBasicMaterial(), count);
    const matrix = new THREE.Matrix4();
    for (let i = 0; i < count; i += 1) {
      made.setMatrixAt(i, matrix.setPosition(...places.subarray(i * 3, i * 3 + 3)));
    }
  }
  made.frustumCulled = false;
  const scene = new THREE.Scene().add(made);
  const gl = renderer.getContext();
  await new Promise((done) => { setTimeout(done, 2000); });
  const times = [];
  for (let i = 0; i < 30; i += 1) {
    const begin = performance.now();
    renderer.render(scene, camera);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    times.push(performance.now() - begin);
    await new Promise(requestAnimationFrame);
  }
  return times.sort((a, b) => a - b)[15];
}"""
IS_DRAWN = """(name) => {
  const scene = document.querySelector(".tab-scene")?.scene;
  const display = scene?.all().find((each) => each.name === name);
  return scene?.figures.pictures > 0 && display?.root.children.length > 0;
}"""
MEASURE = """async ([seconds, name]) => {
  const { scene } = document.querySelector(".tab-scene");
  Object.assign(scene.canvas.style, { width: "1000px", height: "600px" });
  const display = scene.all().find((each) => each.name === name);
  const gl = scene.renderer.getContext();
  await new Promise((done) => { setTimeout(done, 2000); });
  const times = [];
  for (let i = 0; i < 30; i += 1) {
    const begin = performance.now();
    scene.draw();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    times.push(performance.now() - begin);
    await new Promise(requestAnimationFrame);
  }
  const [pictures, received] = [scene.figures.pictures, display.received];
  const begin = performance.now();
  await new Promise((done) => { setTimeout(done, seconds * 1000); });
  const spent = (performance.now() - begin) / 1000;
  const counts = [scene.figures.pictures - pictures, display.received - received];
  const rates = counts.map((count) => count / spent);
  return [times.sort((a, b) => a - b)[15], ...rates];
}"""


@contextlib.contextmanager
def bare_three():
    """Serve a page on which three.js of the same version can draw. Yield its address."""
    vendored = os.path.join(ROOT, "build", "src", "pipros", "web", "page", "vendor", "three", "three.core.js")
    with open(vendored) as file:
        revision = re.search(r"REVISION = .(\d+)", file.read())[1]
    with tempfile.TemporaryDirectory() as folder:
        command = ["npm", "install", "--silent", "--prefix", folder, f"three@0.{revision}.0"]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        files = os.path.join(folder, "node_modules", "three")
        with open(os.path.join(files, "index.html"), "w") as page:
            page.write(BARE_PAGE)
        handler = functools.partial(Quiet, directory=files)
        with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
            threading.Thread(target=server.serve_forever).start()
            try:
                yield f"http://127.0.0.1:{server.server_port}/"
            finally:
                server.shutdown()


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=8.0)
    parser.add_argument("--only", default="", metavar="TEXT", help="only rows whose label contains TEXT")
    arguments = parser.parse_args()
    seconds, only = arguments.seconds, arguments.only
    environment = {**os.environ, "ROS_MASTER_URI": f"http://localhost:{PORT}"}
    with contextlib.ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        environment["ROS_HOME"] = folder

        def start(*argv, **more):
            process = subprocess.Popen(argv, env=environment, **more)
            stack.callback(process.wait)
            stack.callback(process.terminate)
            return process

        start(os.path.join(SCRIPTS, "roscore"), "-p", str(PORT), stdout=subprocess.DEVNULL)
        time.sleep(2)
        start(sys.executable, "-c", PUBLISHER)
        chromium = stack.enter_context(sync_playwright()).chromium
        program = "/usr/bin/chromium" if os.path.exists("/usr/bin/chromium") else None

        def launch(more):
            return chromium.launch(executable_path=program, args=["--no-sandbox", *more])

        def serve(displays, *more):
            """Start a server with a scene. Return its process and its address."""
            file = os.path.join(folder, "scene.rviz")
            with open(file, "w") as out:
                out.write(FILE.format(displays=displays))
            rviz = os.path.join(SCRIPTS, "rviz")
            server = start(rviz, "--no-browser", *more, "-d", file, stderr=subprocess.PIPE, text=True)
            return server, server.stderr.readline().split(": ", 1)[1].strip()

        print(f"{'scene':42} first picture    three  a picture  pictures/s  messages/s  server")
        for label, (displays, name) in SCENES.items():
            if only not in label:
                continue
            server, address = serve(displays, *([] if "anti-aliased" in label else [JAGGED]))
            link, browser = None, None
            if "Mbit" in label:
                port = address.split("/")[2].rpartition(":")[2]
                link = SlowLink(int(port), *SLOW)
                # The server accepts only its own address, so the browser must use this address for the link.
                browser = launch([f"--host-resolver-rules=MAP localhost:{port} 127.0.0.1:{link.port}"])
            browser = browser or launch([])
            tab = browser.new_page(viewport={"width": 1200, "height": 900})
            begin = time.monotonic()
            tab.goto(address, wait_until="commit")
            tab.wait_for_function(IS_DRAWN, arg=name, timeout=120_000)
            first = time.monotonic() - begin
            three = tab.evaluate(THREE)
            usage = psutil.Process(server.pid)
            before, since = sum(usage.cpu_times()[:2]), time.monotonic()
            picture, rate, received = tab.evaluate(MEASURE, [seconds, name])
            share = (sum(usage.cpu_times()[:2]) - before) / (time.monotonic() - since)
            times = f"{first:11.2f} s {three:5.0f} ms {picture:7.0f} ms"
            print(f"{label:42} {times} {rate:11.1f} {received:11.1f} {share:7.0%}", flush=True)
            browser.close()
            server.terminate()
            if link:
                link.close()
        for label, kind in ALONE.items():
            if only not in label:
                continue
            server, address = serve("{Class: rviz/Grid, Name: Grid}", JAGGED)
            browser = launch([])
            tab = browser.new_page(viewport={"width": 1200, "height": 900})
            tab.goto(address, wait_until="commit")
            tab.wait_for_function(IS_DRAWN, arg="Grid", timeout=120_000)
            picture, projection, world = tab.evaluate(DRAW_ALONE, kind)
            print(f"{label:42} {'':22} {picture:7.0f} ms", flush=True)
            with bare_three() as address:
                tab.goto(address)
                picture = tab.evaluate(DRAW_BARE, [kind, projection, world])
            print(f"{label + ', three.js alone':42} {'':22} {picture:7.0f} ms", flush=True)
            browser.close()
            server.terminate()
        for label, (count, views, has_stuck) in VIEWERS.items():
            if only not in label:
                continue
            server, address = serve("")
            # The viewers run in another thread, because Playwright runs an event loop in this one.
            with ThreadPoolExecutor(1) as pool:
                usage = psutil.Process(server.pid)
                watching = watch(address, usage, count, views, has_stuck, seconds)
                received, share = pool.submit(asyncio.run, watching).result()
            print(f"{label:42} {'':45} {received:11.1f} {share:7.0%}", flush=True)
            server.terminate()


async def watch(address, usage, count, views, has_stuck, seconds):
    """Return the clouds per second of the slowest viewer, and the server's usage of processors (1 is one)."""
    clouds = [0] * count
    tasks = [asyncio.create_task(view(address, views, clouds, index)) for index in range(count)]
    if has_stuck:
        tasks.append(asyncio.create_task(view(address, views, clouds, None)))
    while min(clouds) < 3:
        await asyncio.sleep(0.1)
        for task in tasks:
            if task.done():
                task.result()
    clouds[:] = [0] * count
    before, since = sum(usage.cpu_times()[:2]), time.monotonic()
    await asyncio.sleep(seconds)
    spent = time.monotonic() - since
    found = min(clouds) / spent, (sum(usage.cpu_times()[:2]) - before) / spent
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
    return found


async def view(address, views, clouds, index):
    """Watch the views, and count the messages of the first view in `clouds[index]`.

    If `index` is None, stop reading.
    """
    host, token = address.split("/")[2], address.split("#token=")[1].split("/")[0]
    more = {"origin": f"http://{host}", "proxy": None, "max_size": None}
    async with connect(f"ws://{host}/live", **more) as socket:
        await socket.send(json.dumps({"token": token}))
        for number, (name, arguments) in enumerate(views):
            await socket.send(json.dumps({"id": number, "view": name, "args": arguments}))
        if index is None:
            await asyncio.Event().wait()
        async for data in socket:
            if isinstance(data, bytes):
                clouds[index] += int.from_bytes(data[:4], "big") == 0


if __name__ == "__main__":
    main()
