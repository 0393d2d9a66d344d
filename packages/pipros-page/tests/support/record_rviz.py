"""Records how genuine rviz draws the scenes of tests.support.rviz_scenes, in tests.golden.rviz.

    script/generate rviz [SCENE... | controls | panels | statuses | defaults]

With `PICTURES=FOLDER` in the environment, the pictures of scenes are stored in this folder, too. `controls`
drags interactive markers and records the feedback, `panels` the panels of images and cameras, and `statuses`
the status texts of displays (tests.support.rviz_records). `defaults` records a file that genuine rviz saves,
with the defaults of all displays and views.

Genuine ROS 1 and Debian's packages rviz and xvfb are needed; for `panels`, also x11-utils, and for
`statuses`, gcc. rviz draws in software on a virtual screen. pipros writes the `.rviz` files.
"""

import contextlib
import ctypes
import json
import os
import re
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import IO

from pipros_page.scene.layout_file import read_rviz, write_rviz
from tests.support.environments import VENV_BIN
from tests.support.rviz_records import (
    GRIPS,
    PANELS,
    SIZES,
    Grip,
    controls_file,
    display_of,
    feedback_by_marker,
    panel_file,
    probes_of,
    statuses_file,
    statuses_of,
)
from tests.support.rviz_scenes import (
    BACKGROUND,
    HEIGHT,
    ODD_SCENES,
    SCENES,
    TEMPLATE,
    WIDTH,
    config_of,
    record_of,
)

TESTS = Path(__file__).resolve().parents[1]

LEFT, TOP = 16, 62
SETTLED_S, LONGEST_S = 3.0, 60.0
STATUSES_S = 60.0
GL_WINDOW = re.compile(r"\(has no name\): \(\)  (\d+)x(\d+)\+0\+0  \+(\d+)\+(\d+)")
LEAST_PANEL = 150  # pixels
PORT = 12977
SCREEN = ":77"
ENTRIES, LINE_PIXELS = ("First", "Second"), 20  # of a menu
PROGRAMS = TESTS / "browser" / "programs"


Start = Callable[..., "subprocess.Popen[bytes]"]


def main(names: list[str]) -> int:
    with tempfile.TemporaryDirectory() as name, _screen(Path(name)) as start:
        folder = Path(name)
        recorders = {"controls": _record_controls, "panels": _record_panels, "statuses": _record_statuses}
        recorders["defaults"] = _record_defaults
        if len(names) == 1 and names[0] in recorders:
            recorders[names[0]](start, folder)
        else:
            _record_scenes(start, folder, names or list(SCENES))
    return 0


@contextlib.contextmanager
def _screen(folder: Path) -> Iterator[Start]:
    """Run a virtual screen and a genuine master. Yield a function that starts programs of genuine ROS."""
    running = []
    more = {"ROS_MASTER_URI": f"http://localhost:{PORT}", "ROS_HOME": str(folder), "HOME": str(folder)}
    more |= {"DISPLAY": SCREEN, "LIBGL_ALWAYS_SOFTWARE": "1", "LP_NUM_THREADS": "1"}
    environment = {**os.environ, **more, "XDG_RUNTIME_DIR": str(folder), "PATH": "/usr/bin:/bin"}
    environment.pop("PYTHONPATH", None)

    def start(*argv: str, output: IO[bytes] | int = subprocess.DEVNULL) -> subprocess.Popen[bytes]:
        nothing = subprocess.DEVNULL
        process = subprocess.Popen(argv, env=environment, stdout=output, stderr=nothing)
        running.append(process)
        return process

    try:
        start("Xvfb", SCREEN, "-screen", "0", "900x700x24", "-nocursor", "-fbdir", str(folder))
        start("/usr/bin/roscore", "-p", str(PORT))
        ready = ["/usr/bin/rosparam", "get", "/run_id"]
        while subprocess.run(ready, env=environment).returncode:
            time.sleep(1)
        yield start
    finally:
        for process in reversed(running):
            process.terminate()
        for process in running:
            process.wait()


def _record_scenes(start: Start, folder: Path, names: list[str]) -> None:
    start("/usr/bin/python3", str(PROGRAMS / "scene_program.py"))
    time.sleep(5)
    pictures = os.environ.get("PICTURES")
    has_odd_messages = False
    for name in sorted(names, key=list(SCENES).index):  # the odd ones last, because their program adds frames
        if name in ODD_SCENES and not has_odd_messages:
            start("/usr/bin/python3", str(PROGRAMS / "odd_scene_program.py"), str(folder))
            time.sleep(5)
            has_odd_messages = True
        file = folder / "scene.rviz"
        file.write_text(write_rviz(read_rviz(config_of(name))))
        viewer = start("/usr/bin/rviz", "-d", str(file))
        picture = _settled(lambda: _picture(folder / "Xvfb_screen0"))
        record = record_of(name, picture)
        if pictures:
            Path(pictures, f"{name}.ppm").write_bytes(f"P6 {WIDTH} {HEIGHT} 255\n".encode() + picture)
        viewer.kill()
        viewer.wait()
        target = TESTS / "golden" / "rviz" / f"{name}.json"
        target.parent.mkdir(exist_ok=True)
        target.write_text(json.dumps(record, separators=(",", ":")) + "\n")
        print(f"{name}: {len(record['probes'])} probes", flush=True)


def _record_controls(start: Start, folder: Path) -> None:
    output = folder / "feedback"
    with output.open("wb") as file:
        start("/usr/bin/python3", str(PROGRAMS / "controls_program.py"), output=file)
    time.sleep(3)
    scene = folder / "scene.rviz"
    scene.write_text(controls_file())
    start("/usr/bin/rviz", "-d", str(scene))
    _settled(lambda: _picture(folder / "Xvfb_screen0"))
    mouse = Mouse()
    for grip in GRIPS:
        mouse.do(grip)
    time.sleep(1)
    lines = [json.loads(line) for line in output.read_text().splitlines() if line.startswith("{")]
    found = feedback_by_marker(lines)
    print({name: [each["event_type"] for each in events] for name, events in found.items()})
    rows = {name: ",\n    ".join(map(json.dumps, events)) for name, events in found.items()}
    _write("rviz_controls", (f"{json.dumps(name)}: [\n    {row}\n  ]" for name, row in rows.items()))


def _record_panels(start: Start, folder: Path) -> None:
    start("/usr/bin/python3", str(PROGRAMS / "scene_program.py"))
    time.sleep(5)
    lines = []
    for name in PANELS:
        file = folder / "scene.rviz"
        file.write_text(panel_file(name))
        viewer = start("/usr/bin/rviz", "-d", str(file))
        _settled(partial(_panel, folder), is_ready=lambda picture: len(set(picture)) > 3)
        _, _, *size = _panel_area()
        probes = probes_of(_panel(folder), (size[0], size[1]), SIZES[display_of(name)])
        viewer.kill()
        viewer.wait()
        lines.append(f"{json.dumps(name)}: {json.dumps(probes, separators=(',', ':'))}")
        print(f"{name}: {size[0]} x {size[1]}, {len(probes)} probes", flush=True)
    _write("rviz_panels", lines)


def _panel(folder: Path) -> bytes:
    """Return the RGB values of the picture in a panel; empty if there is no panel yet."""
    area = _panel_area()
    return _picture(folder / "Xvfb_screen0", area) if area[2] else b""


def _panel_area() -> tuple[int, int, int, int]:
    """Return left, top, width and height of the picture in a panel; zeros if there is no panel yet."""
    program = ["/usr/bin/xwininfo", "-display", SCREEN, "-root", "-tree"]
    # xwininfo fails if a window closes while it runs.
    lines = subprocess.run(program, capture_output=True, text=True, check=False).stdout.splitlines()
    # Windows drawn with OpenGL have no names. The leftmost one belongs to the panel.
    areas = [[int(number) for number in found] for line in lines for found in GL_WINDOW.findall(line)]
    large = sorted((x, y, width, height) for width, height, x, y in areas if width > LEAST_PANEL)
    return large[0] if len(large) > 1 else (0, 0, 0, 0)


def _record_statuses(start: Start, folder: Path) -> None:
    source, library = TESTS / "support" / "rviz_statuses.c", folder / "rviz_statuses.so"
    compiler = ["/usr/bin/gcc", "-shared", "-fPIC", "-O1", "-o", str(library), str(source), "-ldl"]
    subprocess.run(compiler, check=True)
    start("/usr/bin/python3", str(PROGRAMS / "scene_program.py"))
    start("/usr/bin/python3", str(PROGRAMS / "bad_scene_program.py"), str(folder))
    time.sleep(5)
    file, log = folder / "scene.rviz", folder / "statuses"
    file.write_text(statuses_file())
    variables = (f"LD_PRELOAD={library}", f"RVIZ_STATUSES={log}")
    start("/usr/bin/env", *variables, "/usr/bin/rviz", "-d", str(file))
    time.sleep(STATUSES_S)
    found = statuses_of(log.read_text().splitlines())
    lines = (f"{json.dumps(name)}: {json.dumps(own)}" for name, own in sorted(found.items()))
    _write("rviz_statuses", lines)
    print(f"{len(found)} displays")


def _record_defaults(start: Start, folder: Path) -> None:
    file = folder / "scene.rviz"
    target = TESTS / "golden" / "rviz_defaults.rviz"
    kinds = [
        "Grid Axes TF RobotModel PointCloud2 PointCloud LaserScan Map GridCells Path Pose PoseArray",
        "PoseWithCovariance Odometry Polygon PointStamped Range WrenchStamped Marker MarkerArray",
        "InteractiveMarkers Image Camera DepthCloud Temperature FluidPressure Illuminance RelativeHumidity",
        "Group",
    ]
    views = "Orbit XYOrbit ThirdPersonFollower TopDownOrtho FPS"
    displays = ", ".join(f"{{Class: rviz/{kind}, Enabled: false}}" for kind in " ".join(kinds).split())
    saved = ", ".join(f"{{Class: rviz/{kind}}}" for kind in views.split())
    text = TEMPLATE.format(displays=displays, view="{Class: rviz/Orbit}")
    file.write_text(text.replace("Saved: ~", f"Saved: [{saved}]"))
    start("/usr/bin/rviz", "-d", str(file), "__name:=rviz")
    target.unlink(missing_ok=True)
    while not target.exists():
        time.sleep(5)
        # pipros's rosservice is used, because Debian's packages lack the definition of this service.
        start(str(VENV_BIN / "rosservice"), "call", "/rviz/save_config", f"path: {{data: {target}}}").wait()


def _write(name: str, lines: Iterable[str]) -> None:
    """Write an object of JSON, whose members are given."""
    (TESTS / "golden" / f"{name}.json").write_text("{\n  " + ",\n  ".join(lines) + "\n}\n")


class Mouse:
    """The mouse and the keyboard of the virtual screen, operated through the XTEST extension."""

    def __init__(self) -> None:
        self._x11, self._test = ctypes.CDLL("libX11.so.6"), ctypes.CDLL("libXtst.so.6")
        self._x11.XOpenDisplay.restype = ctypes.c_void_p
        self._display = ctypes.c_void_p(self._x11.XOpenDisplay(SCREEN.encode()))

    def do(self, grip: Grip) -> None:
        (x, y), end = grip.pixels()
        self.move(x - 3, y)
        self.move(x, y)
        if grip.key:
            self.key(grip.key, True)
        self.press(grip.button, True)
        if end != (x, y):
            self.move(*end)
        self.press(grip.button, False)
        if grip.key:
            self.key(grip.key, False)
        if grip.menu_entry:
            line = ENTRIES.index(grip.menu_entry)
            self.move(x + 15, y + 8 + line * LINE_PIXELS)
            self.move(x + 16, y + 10 + line * LINE_PIXELS)
            self.press(1, True)
            self.press(1, False)

    def move(self, x: int, y: int) -> None:
        self._test.XTestFakeMotionEvent(self._display, -1, LEFT + x, TOP + y, 0)
        self._flush()

    def press(self, button: int, is_down: bool) -> None:
        self._test.XTestFakeButtonEvent(self._display, button, int(is_down), 0)
        self._flush()

    def key(self, name: str, is_down: bool) -> None:
        symbol = self._x11.XStringToKeysym(f"{name}_L".encode())
        code = self._x11.XKeysymToKeycode(self._display, symbol)
        self._test.XTestFakeKeyEvent(self._display, code, int(is_down), 0)
        self._flush()

    def _flush(self) -> None:
        """Send the event, and wait while rviz draws some frames, during which it searches for controls."""
        self._x11.XFlush(self._display)
        time.sleep(0.6)


def _is_drawn(picture: bytes) -> bool:
    return picture[:3] == bytes(BACKGROUND) and len(set(picture)) > 1


def _settled(read: Callable[[], bytes], is_ready: Callable[[bytes], bool] = _is_drawn) -> bytes:
    """Return the picture that `read` returns, once it is ready and has not changed for `SETTLED_S`.

    After `LONGEST_S`, return the last picture.
    """
    last, since = b"", time.monotonic()
    begin = since
    while time.monotonic() - begin < LONGEST_S:
        time.sleep(0.5)
        picture = read()
        if picture != last:
            last, since = picture, time.monotonic()
        elif time.monotonic() - since > SETTLED_S and is_ready(picture):
            break
    return last


def _picture(screen: Path, area: tuple[int, int, int, int] = (LEFT, TOP, WIDTH, HEIGHT)) -> bytes:
    """Return the RGB values of an area in an XWD file; by default, the area of rviz's picture.

    `area` consists of left, top, width and height in pixels.
    """
    left, top, width, height = area
    data = screen.read_bytes()
    words = struct.unpack(">25I", data[:100])
    begin, line = words[0] + 12 * words[19], words[12]
    rows = []
    for y in range(top, top + height):
        row = data[begin + y * line + left * 4 :][: width * 4]
        rgb = bytearray(width * 3)
        rgb[::3], rgb[1::3], rgb[2::3] = row[2::4], row[1::4], row[::4]
        rows.append(bytes(rgb))
    return b"".join(rows)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
