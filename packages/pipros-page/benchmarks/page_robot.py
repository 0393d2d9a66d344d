#!/usr/bin/env python3
"""A robot with all that the page shows: pictures, script time, memory and transfer of the Scene tab.

    script/bench page_robot [--seconds 10] [--only TEXT] [--minutes 10]

Needs Chromium and Playwright, which draw in software, in a window of 1440 x 900 pixels with the page's
defaults: anti-aliased, at most 30 pictures a second. The robot is that of page_robot_programs.py, with
turtlesim and the tutorials' Fibonacci server. Each row opens a new page with a scene: tf alone, the robot,
2,000 markers ten times a second, and 1,000,000 points ten times a second. The row "three.js alone" draws the
points of that cloud with three.js's own Points in a page that receives the same bytes, and uploads the same
buffers with each message. All draw as often as they can, as while the user turns the view. `--only` selects
the rows whose label contains a text.

Columns: pictures per second; milliseconds of script per picture; messages per second of the last display;
milliseconds on the page's main thread per message: of all script without drawing, which includes other
messages and the measurement, and of receiving and showing a message alone; megabytes per message and per
second; the heap after garbage collection and the server's memory in MB; the server's share of a processor.

`--minutes` instead shows markers and cloud together for so long, and prints the memories each minute. The
exit status is 1 if the minimum of a memory in the second half exceeds that in the first half by more than a
tenth and 1 MB. Minima are compared, because data is received and decoded all the time. The first minute does
not count.
"""

import os
import sys
import time

import psutil
from programs import QUIET, Programs
from table import options_of

from tests.browser.chromium import running_chromium

PROGRAMS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "page_robot_programs.py")
POINTS = 1_000_000
FILE = """\
Visualization Manager:
  Displays: [{displays}]
  Global Options: {{Fixed Frame: map}}
Window Geometry: {{Hide Left Dock: true}}
"""
TF = "{Class: rviz/TF, Name: TF}"
MARKERS = "{Class: rviz/MarkerArray, Name: Markers, Marker Topic: /many}"
CLOUD = "{Class: rviz/PointCloud2, Name: Cloud, Topic: /million, Style: Points, Size (Pixels): 2}"
ROBOT = ", ".join(
    (
        TF,
        "{Class: rviz/Map, Name: Map, Topic: /map}",
        "{Class: rviz/PointCloud2, Name: Points, Topic: /points}",
        "{Class: rviz/Path, Name: Path, Topic: /path}",
        "{Class: rviz/Odometry, Name: Odometry, Topic: /odom}",
        "{Class: rviz/MarkerArray, Name: Markers, Marker Topic: /markers}",
        "{Class: rviz/LaserScan, Name: Scan, Topic: /scan}",
    )
)
ROWS = (
    ("tf alone", TF, "TF", ""),
    ("the robot", ROBOT, "Scan", ""),
    ("2,000 markers at 10 Hz", f"{TF}, {MARKERS}", "Markers", "markers"),
    ("1,000,000 points at 10 Hz", CLOUD, "Cloud", "cloud"),
)
"""Label, displays, the display whose messages are counted, and the program that sends them."""
IS_DRAWN = """(name) => {
  const scene = document.querySelector(".tab-scene")?.scene;
  const display = scene?.all().find((each) => each.name === name);
  if (!display) return false;
  scene.mostPoints = 1000000;
  scene.hasNewClouds = true;
  scene.invalidate();
  return scene.figures.pictures > 0 && (display.root.children.length > 0 || display.shown?.size > 0);
}"""
BEGIN = """async (name) => {
  const { scene } = document.querySelector(".tab-scene");
  const { live } = await import("/live.js");
  const timed = (object, method) => {
    const call = object[method].bind(object);
    object[method] = (...values) => {
      const begin = performance.now();
      const result = call(...values);
      window.drawn.handling += performance.now() - begin;
      return result;
    };
  };
  window.drawn = { ms: 0, pictures: 0, handling: 0 };
  timed(live, "receive");
  const display = scene.all().find((each) => each.name === name);
  if (display.put) timed(display, "put");
  const draw = scene.draw.bind(scene);
  scene.draw = () => {
    const begin = performance.now();
    draw();
    window.drawn.ms += performance.now() - begin;
    window.drawn.pictures += 1;
    scene.invalidate();
  };
  scene.invalidate();
}"""
STATE = """(name) => {
  const { scene } = document.querySelector(".tab-scene");
  const display = scene.all().find((each) => each.name === name);
  const received = name === "TF" ? display.scene.frames.version : display.received;
  return { ...window.drawn, bytes: scene.figures.bytes, received };
}"""
CAMERA = """() => {
  const { canvas, view: { camera } } = document.querySelector(".tab-scene").scene;
  return [camera.projectionMatrix.elements, camera.matrixWorld.elements, canvas.width, canvas.height];
}"""
BARE = """async ([count, projection, world, width, height]) => {
  const THREE = await import("three");
  const { live } = await import("/live.js");
  const canvas = document.createElement("canvas");
  Object.assign(canvas, { width, height });
  Object.assign(canvas.style, { position: "absolute", zIndex: 9, left: 0, top: 0 });
  document.body.append(canvas);
  const renderer = new THREE.WebGLRenderer({ canvas, antialias: live.isSmooth });
  const camera = new THREE.PerspectiveCamera();
  camera.matrixAutoUpdate = false;
  camera.projectionMatrix.fromArray(projection);
  camera.projectionMatrixInverse.copy(camera.projectionMatrix).invert();
  camera.matrix.fromArray(world);
  camera.matrixWorldNeedsUpdate = true;
  const side = Math.floor(Math.sqrt(count));
  const places = new Float32Array(count * 3);
  const tints = new Uint8Array(count * 4).fill(200);
  for (let i = 0; i < count; i += 1) {
    const [x, y] = [((i % side) / side) * 10 - 5, (Math.floor(i / side) / side) * 10 - 5];
    places.set([x, y, Math.sin(x) * Math.cos(y)], i * 3);
  }
  const geometry = new THREE.BufferGeometry();
  const position = new THREE.BufferAttribute(places, 3);
  const color = new THREE.BufferAttribute(tints, 4, true);
  geometry.setAttribute("position", position);
  geometry.setAttribute("color", color);
  const material = new THREE.PointsMaterial({ size: 2, sizeAttenuation: false, vertexColors: true });
  const points = new THREE.Points(geometry, material);
  points.frustumCulled = false;
  const scene = new THREE.Scene().add(points);
  window.drawn = { ms: 0, pictures: 0, received: 0, bytes: 0, handling: 0 };
  live.watch("scene_cloud", { name: "/million", limit: count, fields: ["intensity"] }, (data) => {
    window.drawn.received += 1;
    window.drawn.bytes += data.byteLength;
    position.needsUpdate = color.needsUpdate = true;
  });
  requestAnimationFrame(function onFrame() {
    const begin = performance.now();
    renderer.render(scene, camera);
    window.drawn.ms += performance.now() - begin;
    window.drawn.pictures += 1;
    requestAnimationFrame(onFrame);
  });
}"""


class System(Programs):
    """The robot, and servers of scenes."""

    def __init__(self):
        super().__init__("roscore")
        for role in ("robot", "cameras", "logger", "others"):
            self.role(role)
        for package, name in (("turtlesim", "turtlesim_node"), ("actionlib_tutorials", "fibonacci_server")):
            self.start("rosrun", package, name, variables={"PIPROS_BROWSER": "off"}, **QUIET)
        time.sleep(3)

    def role(self, name):
        return self.start(sys.executable, PROGRAMS, name, **QUIET)

    def serve(self, displays):
        """Start a server with a scene. Return its process and its address."""
        file = os.path.join(self.folder, "scene.rviz")
        with open(file, "w") as out:
            out.write(FILE.format(displays=displays))
        return self.page("rviz", "-d", file)


def opened(browser, address):
    tab = browser.new_page(viewport={"width": 1440, "height": 900})
    tab.set_default_timeout(180_000)
    tab.on("pageerror", lambda error: print(error, flush=True))
    tab.goto(address, wait_until="commit")
    return tab


def drawn_scene(browser, address, name):
    """Open a scene, and count its pictures once it shows the display with this name."""
    tab = opened(browser, address)
    tab.wait_for_function(IS_DRAWN, arg=name)
    tab.evaluate(BEGIN, name)
    return tab


def script_s(session):
    found = session.send("Performance.getMetrics")["metrics"]
    return next(each["value"] for each in found if each["name"] == "ScriptDuration")


def heap_mb(session):
    session.send("HeapProfiler.collectGarbage")
    return session.send("Runtime.getHeapUsage")["usedSize"] / 1e6


def measure(tab, state, server, seconds, label):
    """Print a row. `state` is JavaScript that returns the sums."""
    session = tab.context.new_cdp_session(tab)
    session.send("Performance.enable")
    tab.wait_for_timeout(3000)
    usage = psutil.Process(server.pid)
    before, script, cpu, since = (
        tab.evaluate(*state),
        script_s(session),
        sum(usage.cpu_times()[:2]),
        time.monotonic(),
    )
    tab.wait_for_timeout(seconds * 1000)
    after, spent = tab.evaluate(*state), time.monotonic() - since
    script, cpu = script_s(session) - script, sum(usage.cpu_times()[:2]) - cpu
    keys = ("pictures", "ms", "received", "bytes", "handling")
    pictures, ms, received, size, handling = (after[key] - before[key] for key in keys)
    received = max(received, 1)
    row = [
        f"{pictures / spent:11.1f}",
        f"{ms / max(pictures, 1):8.1f}",
        f"{received / spent:12.1f}",
        f"{max(0.0, script * 1000 - ms) / received:12.2f}",
        f"{handling / received:10.2f}",
        f"{size / received / 1e6:9.3f}",
        f"{size / spent / 1e6:8.1f}",
        f"{heap_mb(session):8.1f}",
        f"{usage.memory_info().rss / 1e6:8.1f}",
        f"{cpu / spent:7.0%}",
    ]
    print(f"{label:28}{''.join(row)}", flush=True)


def rows(system, browser, seconds, only):
    heads = " pictures/s      ms  messages/s   script ms  handling  MB each    MB/s    heap  server    cpu"
    print(f"{'':28}{heads}")
    for label, displays, name, role in ROWS:
        if only not in label and not only.startswith(label):
            continue
        sender = system.role(role) if role else None
        server, address = system.serve(displays)
        tab = drawn_scene(browser, address, name)
        measure(tab, (STATE, name), server, seconds, label)
        if role == "cloud":
            camera = tab.evaluate(CAMERA)
            tab.close()
            tab = opened(browser, f"{address.rpartition('/')[0]}/topics")
            tab.evaluate(BARE, [POINTS, *camera])
            measure(tab, ("() => window.drawn",), server, seconds, "the same, three.js alone")
        tab.close()
        server.terminate()
        if sender:
            sender.terminate()


def soak(system, browser, minutes):
    """Print the three memories each minute. Return whether they do not grow."""
    for role in ("markers", "cloud"):
        system.role(role)
    server, address = system.serve(f"{MARKERS}, {CLOUD}")
    tab = drawn_scene(browser, address, "Cloud")
    tab.wait_for_function(IS_DRAWN, arg="Markers")
    session = tab.context.new_cdp_session(tab)
    process, history = psutil.Process(server.pid), []
    print(" minute  heap MB  arrays MB  server MB  pictures  markers  clouds", flush=True)
    for minute in range(1, minutes + 1):
        tab.wait_for_timeout(60_000)
        session.send("HeapProfiler.collectGarbage")
        usage = session.send("Runtime.getHeapUsage")
        figures = (
            usage["usedSize"] / 1e6,
            usage.get("backingStorageSize", 0) / 1e6,
            process.memory_info().rss / 1e6,
        )
        counts = [tab.evaluate(STATE, name)["received"] for name in ("Markers", "Cloud")]
        pictures = tab.evaluate("window.drawn.pictures")
        print(
            f"{minute:7}{figures[0]:9.1f}{figures[1]:11.1f}{figures[2]:11.1f}{pictures:10}{counts[0]:9}{counts[1]:8}",
            flush=True,
        )
        history.append(figures)
    middle = max(2, (len(history) + 1) // 2)
    halves = (history[1:middle] or history, history[middle:] or history)
    first, second = ([min(values) for values in zip(*half, strict=True)] for half in halves)
    return all(later <= 1.1 * earlier + 1 for earlier, later in zip(first, second, strict=True))


def main():
    options = options_of(__doc__, seconds=10.0, only="", minutes=0)
    with System() as system, running_chromium() as browser:
        if options.minutes:
            return 0 if soak(system, browser, options.minutes) else 1
        rows(system, browser, options.seconds, options.only)
    return 0


if __name__ == "__main__":
    sys.exit(main())
