"""The Scene tab in a browser: its drawing, its tree and its tools, with and without `--control`.

In the view from above, one metre is 50 pixels, and the origin is in the middle of the picture.
"""

import os
import re
import struct
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page as Tab
from playwright.sync_api import expect

from tests.browser.chromium import OpenTab, keep_screenshots, press, show_all_controls
from tests.browser.test_large_values import NOTE_COPIED, wait_for_note
from tests.support.browser import find_chromium
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

PROGRAM = Path(__file__).parent / "programs" / "scene_program.py"
SCALE = 50
GREY = (48, 48, 48)
ROBOT = "{Class: rviz/RobotModel, Name: Robot, Enabled: true}"

ROBOT_WITHOUT_MESH = (
    '<robot name="r"><link name="base_link"><visual><geometry><mesh filename="package://nothing/a.stl"/>'
    "</geometry></visual></link></robot>"
)
VIEW = """\
Visualization Manager:
  Displays: [{displays}]
  Global Options: {{Fixed Frame: /map, Background Color: 48; 48; 48}}
  Views:
    Current: {{Class: rviz/TopDownOrtho, Name: Current View, Scale: 50, X: 0, Y: 0}}
Window Geometry: {{Hide Left Dock: true}}
"""


@pytest.fixture
def system(ros: RosSystem) -> RosSystem:
    ros.serve_master()
    ros.pipros.start(sys.executable, PROGRAM)
    for topic in ("/map", "/path", "/cloud", "/scan", "/tf_static", "/markers"):
        ros.wait_for_publisher(topic)
    return ros


def scene_of(
    system: RosSystem,
    open_tab: OpenTab,
    tmp_path: Path,
    displays: str,
    *options: str,
    size: tuple[int, int] = (1200, 900),
) -> Tab:
    file = tmp_path / "scene.rviz"
    file.write_text(VIEW.format(displays=displays))
    return open_tab(Page(system, "-d", file, *options, command="rviz"), "scene", size)


def colour_at(tab: Tab, x: float, y: float) -> Sequence[int]:
    """Return the colour at a position in metres."""
    found: Sequence[int] = tab.evaluate(
        """([x, y, scale]) => {
          const scene = document.querySelector(".tab-scene")?.scene;
          if (!scene?.view) return [0, 0, 0];
          scene.draw();
          const { canvas, renderer } = scene;
          const gl = renderer.getContext();
          const ratio = canvas.height / canvas.clientHeight;
          const pixel = new Uint8Array(4);
          const at = [canvas.clientWidth / 2 + x * scale, canvas.clientHeight / 2 + y * scale];
          const [column, row] = at.map((value) => Math.floor(value * ratio));
          gl.readPixels(column, row, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
          return [...pixel].slice(0, 3);
        }""",
        [x, y, SCALE],
    )
    return tuple(found)


def wait_for_colours(
    tab: Tab, expected: Mapping[tuple[float, float], Sequence[int]], tolerance: int = 0
) -> None:
    def differences() -> Mapping[Any, Any]:
        found = {place: colour_at(tab, *place) for place in expected}
        return {
            place: found[place]
            for place, colour in expected.items()
            if any(abs(one - other) > tolerance for one, other in zip(found[place], colour, strict=True))
        }

    wait_until(lambda: not differences(), timeout_s=60.0, what=lambda: f"differences: {differences()}")


def statuses(tab: Tab, display: str) -> Mapping[str, str]:
    found: Mapping[str, str] = tab.evaluate(
        """(name) => Object.fromEntries((document.querySelector(".tab-scene")?.scene?.all() ?? [])
          .filter((each) => each.name === name)
          .flatMap((each) => [...each.statuses].map(([key, { text }]) => [key, text])))""",
        display,
    )
    return found


def test_unknown_displays_are_listed_and_stop_nothing(system: RosSystem, open_tab: OpenTab, tmp_path) -> None:
    displays = (
        "{Class: my/Wind, Name: Wind, Enabled: true}, {Class: rviz/RobotModel, Name: Robot, Enabled: true}"
    )
    tab = scene_of(system, open_tab, tmp_path, displays)
    wait_for_colours(tab, {(2, 2): (204, 102, 51)}, tolerance=1)
    assert "my/Wind is not supported" in statuses(tab, "Wind")["Class"]
    assert statuses(tab, "Robot")["lost"] == "No transform from [lost] to [map]"
    assert statuses(tab, "Robot")["URDF"] == "URDF parsed OK"


def test_displays_are_switched_added_and_saved(system: RosSystem, open_tab: OpenTab, tmp_path: Path) -> None:
    displays = (
        "{Class: my/Wind, Name: Wind, Force: 007}, {Class: rviz/RobotModel, Name: Robot, Enabled: true}"
    )
    tab = scene_of(system, open_tab, tmp_path, displays, "--control")
    wait_for_colours(tab, {(2, 2): (204, 102, 51)}, tolerance=1)
    tab.get_by_role("button", name="Displays").click()
    tab.get_by_label("Show Robot").uncheck()
    tab.get_by_label("Add a display").select_option(label="/map (Map)")
    tab.get_by_role("button", name="Displays").click()
    wait_for_colours(tab, {(2, 2): GREY, (-3.5, 2.5): (193, 193, 193)}, tolerance=1)
    keep_screenshots(tab, "scene")
    press(tab, "Save")
    expect(tab.locator(".scene-status")).to_contain_text("saved as")
    saved = (tmp_path / "scene.rviz").read_text()
    assert "Force: 007" in saved
    assert re.search(r"Name: Robot\n +Enabled: false", saved)
    assert re.search(r"Class: rviz/Map\n.*\n.*\n.*\n +Topic: /map", saved)


@pytest.mark.parametrize(("options", "is_smooth"), [((), True), (("--disable-anti-aliasing",), False)])
def test_anti_aliasing_can_be_disabled(ros, open_tab, options: Sequence[str], is_smooth: bool) -> None:
    ros.serve_master()
    tab = open_tab(Page(ros, *options, command="rviz"), "scene", (1200, 900))
    tab.wait_for_function("() => document.querySelector('.tab-scene')?.scene")
    found = tab.evaluate(
        "document.querySelector('.tab-scene').scene.renderer.getContext().getContextAttributes().antialias"
    )
    assert found is is_smooth


def test_a_goal_is_published_with_control(system: RosSystem, open_tab: OpenTab, tmp_path: Path) -> None:
    echo = system.pipros.start("rostopic", "echo", "-n1", "/move_base_simple/goal")
    tab = scene_of(
        system, open_tab, tmp_path, "{Class: rviz/RobotModel, Name: Robot, Enabled: true}", "--control"
    )
    wait_for_colours(tab, {(2, 2): (204, 102, 51)}, tolerance=1)
    echo.wait_for("does not appear to be published yet")  # it looks for the topic
    canvas = tab.locator(".scene-canvas")
    canvas.focus()
    tab.keyboard.press("g")
    expect(tab.get_by_role("button", name="2D Nav Goal")).to_have_attribute("aria-pressed", "true")
    box = canvas.bounding_box()
    assert box is not None
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    tab.mouse.move(middle[0] - 2 * SCALE, middle[1] - SCALE)
    tab.mouse.down()
    tab.mouse.move(middle[0] - 2 * SCALE, middle[1] - 3 * SCALE)
    tab.mouse.up()
    echo.wait(30.0)
    goal = "\n".join(echo.stdout)
    assert 'frame_id: "map"' in goal
    numbers = [float(number) for number in re.findall(r"\b[xyzw]: (\S+)", goal)]
    assert numbers == pytest.approx([-2, 1, 0, 0, 0, 0.7071, 0.7071], abs=0.05)


def test_without_control_nothing_is_published(system: RosSystem, open_tab: OpenTab, tmp_path: Path) -> None:
    tab = scene_of(system, open_tab, tmp_path, "", size=(390, 700))
    show_all_controls(tab)
    for name in ("2D Nav Goal", "2D Pose Estimate", "Publish Point", "Save"):
        expect(tab.get_by_role("button", name=name, exact=True)).to_be_disabled()
    tools = tab.locator(".scene-tools button")
    assert not tools.evaluate_all("(all) => all.filter((each) => each.scrollWidth > each.clientWidth).length")


def place_on(tab: Tab, x: float, y: float) -> tuple[float, float]:
    """Return the pixel of the page at a position in metres."""
    box = tab.locator(".scene-canvas").bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2 + x * SCALE, box["y"] + box["height"] / 2 - y * SCALE


def test_tools_measure_points_and_publish_them(system: RosSystem, open_tab: OpenTab, tmp_path: Path) -> None:
    points = system.pipros.start("rostopic", "echo", "-n1", "/clicked_point/point")
    poses = system.pipros.start("rostopic", "echo", "-n1", "-p", "/initialpose/pose")
    tab = scene_of(system, open_tab, tmp_path, ROBOT, "--control")
    wait_for_colours(tab, {(2, 2): (204, 102, 51)}, tolerance=1)
    for echo in (points, poses):
        echo.wait_for("does not appear to be published yet")  # it looks for the topic
    tab.locator(".scene-canvas").focus()
    tab.keyboard.press("n")
    for x in (2, 4):
        tab.mouse.click(*place_on(tab, x, 2))
    expect(tab.locator(".scene-status")).to_have_text("[Length: 2.00m]")
    tab.keyboard.press("c")
    tab.mouse.click(*place_on(tab, 2, 2))
    points.wait(30.0)
    numbers = [float(line.split()[1]) for line in points.stdout if line.startswith(("x", "y", "z"))]
    assert numbers == pytest.approx([2, 2, 0.5], abs=0.05)
    tab.keyboard.press("p")
    tab.mouse.move(*place_on(tab, -1, -1))
    tab.mouse.down()
    tab.mouse.move(*place_on(tab, -3, -1))
    tab.mouse.up()
    poses.wait(30.0)
    row = [float(number) for number in poses.stdout[-1].split(",")[1:]]
    assert row[:7] == pytest.approx([-1, -1, 0, 0, 0, 1, 0], abs=0.05)
    assert [row[7], row[14], row[42]] == pytest.approx([0.25, 0.25, 0.06853892], abs=1e-5)


def test_bad_input_becomes_a_status_and_harms_nothing_else(system: RosSystem, open_tab, tmp_path) -> None:
    marker = "type: 1, ns: bad, header: {frame_id: map}, scale: {x: 1, y: 1, z: 1}, color: {a: 1}"
    array = (
        f"markers: [{{{marker}, id: 1, pose: {{position: {{x: .nan}}}}}}, {{{marker}, id: 2}}, "
        f"{{{marker}, id: 3, action: 9}}, {{{marker}, id: 4, type: 99}}, "
        f"{{{marker}, id: 5, header: {{frame_id: nowhere}}}}]"
    )
    system.pipros.start("rostopic", "pub", "-l", "/bad", "visualization_msgs/MarkerArray", f"{{{array}}}")
    scan = "{header: {frame_id: map}, ranges: [.inf, .nan, 1e38], range_max: .inf, angle_increment: .nan}"
    system.pipros.start("rostopic", "pub", "-l", "/bad_scan", "sensor_msgs/LaserScan", scan)
    displays = (
        "{Class: rviz/MarkerArray, Name: Bad, Enabled: true, Marker Topic: /bad}, "
        "{Class: rviz/LaserScan, Name: Scan, Enabled: true, Topic: /bad_scan}, "
        "{Class: rviz/Map, Name: Points, Enabled: true, Topic: /cloud}, "
        "{Class: rviz/Grid, Name: Grid, Enabled: maybe, Cell Size: .nan, Plane Cell Count: 1e9, Color: x}"
    )
    tab = scene_of(system, open_tab, tmp_path, f"{displays}, {ROBOT}")
    wait_for_colours(tab, {(2, 2): (204, 102, 51)}, tolerance=1)
    wait_until(lambda: len(statuses(tab, "Bad")) == 6, 30.0, what=lambda: str(statuses(tab, "Bad")))
    found = statuses(tab, "Bad")
    assert found["bad/1"] == "Position contains invalid floating point values (nans or infs)"
    assert found["bad/2"] == "Uninitialized quaternion, assuming identity."
    assert found["bad/3"] == "Unknown action 9"
    assert found["bad/5"] == "For frame [nowhere]: Frame [nowhere] does not exist"
    # The graphics card may be reset at any time.
    tab.evaluate(
        """() => {
          const { scene } = document.querySelector(".tab-scene");
          const reset = scene.renderer.getContext().getExtension("WEBGL_lose_context");
          reset.loseContext();
          setTimeout(() => reset.restoreContext(), 0);
        }"""
    )
    wait_for_colours(tab, {(2, 2): (204, 102, 51)}, tolerance=1)


def test_a_jump_of_time_removes_moving_frames_and_messages(system: RosSystem, open_tab, tmp_path) -> None:
    cloud = "{Class: rviz/PointCloud2, Name: Cloud, Enabled: true, Topic: /cloud}"
    tab = scene_of(system, open_tab, tmp_path, f"{cloud}, {ROBOT}")
    wait_for_colours(tab, {(2, 2): (204, 102, 51)}, tolerance=1)
    found = tab.evaluate(
        """() => {
          const { scene } = document.querySelector(".tab-scene");
          const transform = { translation: { x: 0, y: 0, z: 0 }, rotation: { x: 0, y: 0, z: 0, w: 1 } };
          const header = { frame_id: "map", stamp: 5n };
          scene.addTransforms({ transforms: [{ header, child_frame_id: "moving", transform }] }, false);
          scene.simulatedNs = 9n;
          const before = scene.frames.parent("moving");
          scene.setClock(3n);
          const [cloud] = scene.all();
          const after = ["moving", "base_link"].map((name) => scene.frames.parent(name));
          // What was sent before the jump may arrive after it.
          const late = [3000000003n, 3n, 0n].map((stamp) => scene.isLate({ header: { ...header, stamp } }));
          return [before, ...after, cloud.root.children.length, late];
        }"""
    )
    assert found == ["map", None, "map", 0, [True, False, False]]


def test_links_and_namespaces_are_switched_one_by_one(system: RosSystem, open_tab: OpenTab, tmp_path) -> None:
    markers = "{Class: rviz/MarkerArray, Name: Markers, Enabled: true, Marker Topic: /markers}"
    frames = "{Class: rviz/TF, Name: Frames, Enabled: true, Marker Scale: 0.1, Frames: {All Enabled: false}}"
    tab = scene_of(system, open_tab, tmp_path, f"{ROBOT}, {markers}, {frames}")
    wait_for_colours(tab, {(4, 2): (255, 0, 0), (2, 4): (255, 0, 0)}, tolerance=1)
    tab.get_by_role("button", name="Displays").click()
    for row, part in (("Robot", "bare"), ("Markers", "spheres")):
        tab.locator(".scene-name", has_text=row).click()
        tab.get_by_label(part, exact=True).uncheck()
    tab.locator(".scene-name", has_text="Frames").click()
    frame = tab.get_by_label("turned", exact=True)
    expect(frame).to_be_checked()
    for is_shown in (True, False):
        tab.get_by_label("All Enabled", exact=True).set_checked(is_shown)
        expect(frame).to_be_checked(checked=is_shown)
    tab.get_by_role("button", name="Displays").click()
    wait_for_colours(tab, {(4, 2): GREY, (2, 4): GREY, (2, 2): (204, 102, 51)}, tolerance=1)


def drag(tab: Tab, begin: tuple[float, float], end: tuple[float, float], key: str = "") -> None:
    """Drag the mouse between two places in metres, with a key held."""
    if key:
        tab.keyboard.down(key)
    tab.mouse.move(*place_on(tab, *begin))
    tab.mouse.down()
    tab.mouse.move(*place_on(tab, *end))
    tab.mouse.up()
    if key:
        tab.keyboard.up(key)


def test_a_rectangle_selects_points_markers_and_links(system: RosSystem, open_tab: OpenTab, tmp_path) -> None:
    cloud = "{Class: rviz/PointCloud2, Name: Cloud, Topic: /cloud, Size (m): 0.6, Decay Time: 1000}"
    markers = "{Class: rviz/MarkerArray, Name: Markers, Marker Topic: /markers}"
    tab = scene_of(system, open_tab, tmp_path, f"{cloud}, {markers}, {ROBOT}")
    wait_for_colours(tab, {(2, 2): (204, 102, 51), (2, 4): (255, 0, 0), (-4, 0): (255, 0, 0)}, tolerance=1)
    tab.locator(".scene-canvas").focus()
    tab.keyboard.press("s")
    panel = tab.get_by_role("region", name="Selection")
    drag(tab, (-3.5, 0.5), (-1.5, -0.5))
    expect(panel).to_contain_text("2 selected")
    expect(panel).to_contain_text(re.compile(r"Cloud: Point 1Position-3; 0; 0intensity50Cloud: Point 2"))
    drag(tab, (1, 3), (3.5, 4.5), "Shift")
    expect(panel).to_contain_text(re.compile("3 selected.*Markers: Marker spheres/1Framemap"))
    drag(tab, (1.7, 2.3), (2.3, 1.7), "Shift")
    expect(panel).to_contain_text(re.compile("4 selected.*Robot: Link base_linkPosition2; 2; 0"))
    drag(tab, (1.7, 2.3), (2.3, 1.7), "Control")
    expect(panel).to_contain_text("3 selected")
    expect(panel).not_to_contain_text("Robot")
    keep_screenshots(tab, "selection")
    # A pixel of a point beside its middle.
    found = tab.evaluate(
        """async () => {
          const { Picker } = await import("/scene/picking.js");
          const { scene } = document.querySelector(".tab-scene");
          const { clientWidth: width, clientHeight: height } = scene.canvas;
          return new Picker(scene).point(Math.floor(width / 2) - 162, Math.floor(height / 2) - 12).toArray();
        }"""
    )
    assert found == pytest.approx([-3.24, 0.24, 0], abs=0.05)
    tab.keyboard.press("f")
    wait_for_colours(tab, {(0, 0): GREY}, tolerance=0)
    tab.get_by_role("button", name="Clear").click()
    expect(panel).to_be_hidden()


def test_displays_are_dragged_into_groups(system: RosSystem, open_tab: OpenTab, tmp_path: Path) -> None:
    group = "{Class: rviz/Group, Name: Group, Enabled: false, Displays: []}"
    tab = scene_of(system, open_tab, tmp_path, f"{ROBOT}, {{Class: rviz/Grid, Name: Grid}}, {group}")
    wait_for_colours(tab, {(2, 2): (204, 102, 51)}, tolerance=1)
    tab.get_by_role("button", name="Displays").click()
    names = "document.querySelector('.tab-scene').scene.all().map(({ name }) => name)"
    rows = {name: tab.locator(".scene-row > summary", has_text=name) for name in ("Robot", "Grid", "Group")}
    rows["Grid"].drag_to(rows["Robot"], target_position={"x": 60, "y": 2})
    wait_until(lambda: tab.evaluate(names) == ["Grid", "Robot", "Group"], 30.0, "the dragged grid")
    rows["Robot"].drag_to(rows["Group"])
    wait_for_colours(tab, {(2.25, 2.25): GREY})  # the group is off
    saved = tab.evaluate("document.querySelector('.tab-scene').scene.config.Displays")
    assert [each["Name"] for each in saved] == ["Grid", "Group"]
    assert [each["Name"] for each in saved[1]["Displays"]] == ["Robot"]
    rows["Group"].drag_to(rows["Grid"], target_position={"x": 60, "y": 2})
    wait_until(lambda: tab.evaluate(names) == ["Group", "Robot", "Grid"], 30.0, "the dragged group")


def test_clashing_ids_lost_messages_and_old_topics_are_reported(system, open_tab, tmp_path) -> None:
    markers = "{Class: rviz/MarkerArray, Name: Markers, Marker Topic: /markers}"
    tab = scene_of(system, open_tab, tmp_path, markers)
    wait_for_colours(tab, {(2, 4): (255, 0, 0)}, tolerance=1)
    found = tab.evaluate(
        """async () => {
          const { scene } = document.querySelector(".tab-scene");
          const { Subscription } = await import("/scene/subscription.js");
          const [markers] = scene.all();
          const [{ message }] = markers.shown.values();
          markers.sender = "/other";
          markers.take(message);
          markers.received = 0;
          for (let count = 0; count < 5; count += 1) markers.countMessage();
          markers.arrivals = [1, 2, 3, 4, 5].map((tick) => performance.now() - 60000 + 100 * tick);
          markers.noteAge();
          let lost = 0;
          const noted = new Subscription(scene, () => {}, () => {}, (count) => { lost = count; });
          noted.note({ lost: 7 });
          return [...["Id clash", "Age"].map((name) => markers.statuses.get(name).text), lost];
        }"""
    )
    assert found[0] == (
        "[spheres/1] is sent by [/scene_program] and by [/other], which overwrite each other."
    )
    assert re.fullmatch(
        r"Stale: the last message of \[/other\] is \d+ s old; before, there was one every 0\.1 s\.", found[1]
    )
    assert found[2] == 7


def test_an_inertial_sensor_and_a_depth_image_are_drawn(system: RosSystem, open_tab, tmp_path) -> None:
    displays = (
        "{Class: rviz_imu_plugin/Imu, Name: Imu, Enabled: true, Topic: /imu, Box properties: "
        "{Enable box: true, Box color: 0; 0; 255, z_scale: 20}, Axes properties: {Enable axes: false}}, "
        "{Class: rviz/DepthCloud, Name: Depth, Enabled: true, Depth Map Topic: /depth/image, "
        "Color Image Topic: /colour/image}"
    )
    tab = scene_of(system, open_tab, tmp_path, displays)
    # Pixels are 2.5 m wide at that depth; the last one, at the right below, is empty.
    wait_for_colours(
        tab, {(0.2, 0.2): (0, 0, 255), (-4, 4): (200, 100, 0), (2.2, 2.2): (200, 100, 0)}, tolerance=1
    )
    assert statuses(tab, "Depth")["Depth Map"].endswith("depth maps received")


CAMERA = """(places) => {
  const scene = document.querySelector(".tab-scene")?.scene;
  const { canvas } = scene?.all().find((each) => each.name === "Camera") ?? {};
  if (!canvas || canvas.width < 40) return [];
  const drawing = canvas.getContext("2d");
  return places.map(([x, y]) => [...drawing.getImageData(x, y, 1, 1).data].slice(0, 3));
}"""


def test_a_camera_shows_the_scene_over_its_image(system: RosSystem, open_tab: OpenTab, tmp_path) -> None:
    displays = (
        f"{ROBOT}, {{Class: rviz/Marker, Name: Cube, Enabled: true, Marker Topic: /visualization_marker}}, "
        "{Class: rviz/Camera, Name: Camera, Enabled: true, Image Topic: /camera/image, "
        "Overlay Alpha: 0.25, Visibility: {Robot: false}}"
    )
    tab = scene_of(system, open_tab, tmp_path, displays)
    # The image, the green cube that is 4 m ahead of the camera's middle, and the robot, which is not visible.
    places, expected = [[1, 38], [20, 2], [29, 11]], [[200, 100, 0], [50, 216, 0], [200, 100, 0]]

    def found() -> Any:
        return tab.evaluate(CAMERA, places)

    def is_right() -> bool:
        pairs = zip(found(), expected, strict=False)
        return bool(found()) and all(one == pytest.approx(other, abs=2) for one, other in pairs)

    wait_until(is_right, 30.0, what=lambda: str(found()))
    assert statuses(tab, "Camera")["Camera Info"] == "received"


def feedback_of(line: str) -> tuple[str, str, int, float, float]:
    """Return control, frame, event, x and the sine of half the yaw, in a line of `rostopic echo -p`."""
    part = line.split(",")
    return part[6], part[3], int(part[7]), float(part[8]), float(part[13])


def test_interactive_markers_are_moved_turned_and_clicked(system: RosSystem, open_tab, tmp_path) -> None:
    echo = system.pipros.start("rostopic", "echo", "-p", "/controls/feedback")
    markers = (
        "{Class: rviz/InteractiveMarkers, Name: Controls, Enabled: true, Update Topic: /controls/update}"
    )
    tab = scene_of(system, open_tab, tmp_path, markers, "--control")
    wait_for_colours(tab, {(-3, -1): (0, 0, 255)}, tolerance=1)
    system.wait_for_links("/controls/feedback", 2)  # to the server of the markers, and to `rostopic echo`
    tab.locator(".scene-canvas").focus()
    tab.keyboard.press("i")

    def feedback() -> list[str]:
        return [line for line in echo.stdout if not line.startswith("%")]

    drag(tab, (-0.3, -1), (0.7, -1))
    wait_for_colours(tab, {(-2, -1): (0, 0, 255)}, tolerance=1)
    drag(tab, (-2, -1), (-2, -1))
    drag(tab, (-2.27, 3.5), (-4, 5.23))
    tab.mouse.click(*place_on(tab, -2, -1), button="right")
    tab.get_by_role("menuitem", name="Second").click()
    wait_until(lambda: any(feedback_of(line)[2] == 2 for line in feedback()), 30.0)
    lines = feedback()
    found = [feedback_of(line) for line in lines]
    assert {line.split(",")[4].split("/")[-1] for line in lines} == {"Controls"}
    assert {frame for _, frame, *_ in found} == {"map"}
    moves = [(event, x) for control, _, event, x, _ in found if control == "move_x"]
    assert [event for event, _ in moves if event] == [1, 4, 1, 1, 5]
    assert moves[-1][1] == pytest.approx(-2, abs=0.03)
    assert [event for control, _, event, *_ in found if control == "press"] == [1, 4, 3, 1, 5, 2]
    turns = [(event, z) for control, _, event, _, z in found if control == "ROTATE_AXIS"]
    assert (turns[-1][0], turns[-1][1]) == (5, pytest.approx(0.7071, abs=0.02))


def test_interactive_markers_need_control(system: RosSystem, open_tab: OpenTab, tmp_path: Path) -> None:
    markers = (
        "{Class: rviz/InteractiveMarkers, Name: Controls, Enabled: true, Update Topic: /controls/update}"
    )
    tab = scene_of(system, open_tab, tmp_path, markers)
    wait_for_colours(tab, {(-3, -1): (0, 0, 255)}, tolerance=1)
    tab.locator(".scene-canvas").focus()
    tab.keyboard.press("i")
    tab.mouse.click(*place_on(tab, -0.3, -1))
    expect(tab.locator(".scene-status")).to_contain_text("start the command with --control")


def test_a_picture_is_saved_without_a_window(system: RosSystem, tmp_path: Path) -> None:
    file, picture = tmp_path / "scene.rviz", tmp_path / "scene.png"
    file.write_text(
        VIEW.format(displays=f"{ROBOT}, {{Class: rviz/Map, Name: M, Enabled: true, Topic: /none}}")
    )
    chromium = find_chromium()
    assert chromium is not None
    path = f"{system.pipros.environment['PATH']}{os.pathsep}{Path(chromium).parent}"
    options = ("--size", "640x480", "--timeout", "10")
    done = system.pipros.run("rviz", "--png", picture, "-d", file, *options, timeout_s=100.0, PATH=path)
    assert done.returncode == 3
    assert "rviz: missing: M: no message on [/none]" in done.stderr
    assert "Robot: lost: No transform" in "\n".join(done.stderr)
    content = picture.read_bytes()
    assert (content[:8], struct.unpack(">II", content[16:24])) == (b"\x89PNG\r\n\x1a\n", (640, 480))
    assert len(set(content)) > 100


def test_a_picture_waits_for_meshes_and_messages(system: RosSystem, tmp_path: Path) -> None:
    file, picture = tmp_path / "scene.rviz", tmp_path / "scene.png"
    robot = "{Class: rviz/RobotModel, Name: Meshes, Robot Description: /meshes}"
    latched = "{Class: rviz/Map, Name: M, Topic: /map}, {Class: rviz/LaserScan, Name: S, Topic: /scan}"
    file.write_text(VIEW.format(displays=f"{robot}, {latched}"))
    path = f"{system.pipros.environment['PATH']}{os.pathsep}{Path(find_chromium() or '').parent}"
    done = system.pipros.run(
        "rviz", "--png", picture, "-d", file, "--timeout", "90", timeout_s=200.0, PATH=path
    )
    assert done.returncode == 0, done.stderr
    system.pipros.run("rosparam", "set", "/meshes", ROBOT_WITHOUT_MESH)
    done = system.pipros.run(
        "rviz", "--png", picture, "-d", file, "--timeout", "5", timeout_s=100.0, PATH=path
    )
    assert done.returncode == 3
    assert any("missing: mesh [package://nothing/a.stl]" in line for line in done.stderr), done.stderr


def test_a_link_that_has_ended_is_named(system: RosSystem, open_tab: OpenTab, tmp_path: Path) -> None:
    tab = scene_of(system, open_tab, tmp_path, "{Class: rviz/Path, Name: Way, Enabled: true, Topic: /none}")
    wait_until(lambda: "Topic" in statuses(tab, "Way"), 30.0)
    tab.evaluate(
        """() => {
          const { scene } = document.querySelector(".tab-scene");
          const now = scene.now();
          const turned = { translation: { x: 0, y: 0, z: 0 }, rotation: { x: 0, y: 0, z: 0, w: 1 } };
          const old = now - 7000000000n;
          const links = [["map", "odom", old], ["odom", "moving", now], ["other", "alone", now]];
          const transforms = links.map(([parent, child, stamp]) => ({
            header: { frame_id: parent, stamp }, child_frame_id: child, transform: turned }));
          scene.addTransforms({ transforms }, false, "/amcl");
          const [way] = scene.all();
          way.sender = "/planner";
          way.whenPlaced({ header: { frame_id: "moving", stamp: now } }, () => {});
        }"""
    )
    age = r"The transform from \[odom\] to \[map\], sent by \[/amcl\], is \d+ s old; "
    # once no transform has arrived for two seconds
    ended = re.compile(age + r"its sender may have stopped\.")
    wait_until(lambda: ended.fullmatch(statuses(tab, "Way")["Link"]), 30.0)
    assert statuses(tab, "Way")["Transform [sender=/planner]"].startswith("For frame [moving]: No transform")
    tab.evaluate(
        """() => {
          const [way] = document.querySelector(".tab-scene").scene.all();
          way.whenPlaced({ header: { frame_id: "alone", stamp: 0n } }, () => {});
        }"""
    )
    assert statuses(tab, "Way")["Link"] == (
        "[alone] is in the tree of [other], but the fixed frame is not; "
        "with [other] as the fixed frame, it would be shown."
    )


def test_the_points_of_a_viewer_are_divided_among_its_clouds(system: RosSystem, open_tab, tmp_path) -> None:
    clouds = ", ".join(
        f"{{Class: rviz/PointCloud2, Name: {name}, Enabled: true, Topic: /cloud}}" for name in "AB"
    )
    tab = scene_of(system, open_tab, tmp_path, clouds)
    figures = tab.locator(".scene-figures")
    expect(figures).to_contain_text("8 of 8 points")
    expect(figures).to_contain_text("MB/s")
    assert "Transform [sender=/scene_program]" in statuses(tab, "A")
    limits = "document.querySelector('.tab-scene').scene.all().map(({ limit }) => limit)"
    wait_until(lambda: tab.evaluate(limits) == [100_000, 100_000], 30.0, "the limits of both clouds")
    tab.get_by_label("Points of all clouds").select_option("20000")
    wait_until(lambda: tab.evaluate(limits) == [10_000, 10_000], 30.0, "the new limit")
    tab.get_by_role("button", name="Displays").click()
    tab.get_by_label("Show A").uncheck()
    wait_until(lambda: tab.evaluate(limits) == [0, 20_000], 30.0, "one cloud")


def test_a_link_shows_the_same_displays_and_view(system: RosSystem, open_tab: OpenTab, tmp_path) -> None:
    file = tmp_path / "scene.rviz"
    file.write_text(VIEW.format(displays=f"{ROBOT}, {{Class: my/Wind, Name: Wind, Force: 007}}"))
    page = Page(system, "-d", file, command="rviz")
    tab = open_tab(page, "scene", (1200, 900))
    wait_for_colours(tab, {(2, 2): (204, 102, 51)}, tolerance=1)
    assert tab.url.endswith("#scene")
    tab.get_by_role("button", name="Displays").click()
    tab.get_by_label("Add a display").select_option(label="/map (Map)")
    tab.get_by_label("Show Robot").uncheck()
    tab.get_by_role("button", name="Displays").click()
    tab.evaluate("document.querySelector('.tab-scene').scene.view.set('X', -2)")
    shown = {(2, 2): GREY, (4, 2): GREY, (-1.5, 2.5): (193, 193, 193)}  # the origin is 2 m further right
    wait_for_colours(tab, shown, tolerance=1)
    wait_until(lambda: tab.evaluate("location.hash").startswith("#scene/"), 30.0, "the address")
    tab.context.grant_permissions(["clipboard-read", "clipboard-write"])
    tab.evaluate(NOTE_COPIED)
    press(tab, "Link")
    wait_for_note(tab, "Copy as Link: copied")
    link = str(tab.evaluate("navigator.clipboard.readText()"))
    wait_until(lambda: link == tab.evaluate("location.href"), 30.0, "the address")
    place = link.partition("#")[2]
    other = open_tab(page, place, (1200, 900))
    wait_for_colours(other, shown, tolerance=1)
    assert "Force" in other.evaluate("JSON.stringify(document.querySelector('.tab-scene').scene.file)")
    damaged = open_tab(page, f"{place[:-9]}x", (1200, 900))
    expect(damaged.get_by_role("alert").first).to_have_text(
        "the link to the scene is damaged; the file is shown"
    )
    wait_for_colours(damaged, {(2, 2): (204, 102, 51)}, tolerance=1)


def test_changes_survive_a_lost_connection(system: RosSystem, open_tab: OpenTab, tmp_path: Path) -> None:
    tab = scene_of(system, open_tab, tmp_path, ROBOT)
    tab.goto(tab.url.replace("/#", "/index.html#"))  # the page of the modules, one of which is imported below
    wait_for_colours(tab, {(2, 2): (204, 102, 51)}, tolerance=1)
    tab.evaluate("document.querySelector('.tab-scene').scene.view.set('X', -2)")
    lost = tab.evaluate(
        """async () => {
          const { live } = await import("/live.js");
          const lost = new Promise((resolve) => {
            const note = () => resolve(document.querySelector("#system").textContent);
            live.addEventListener("state", note, { once: true });
          });
          live.socket.close();
          return lost;
        }"""
    )
    assert "no connection" in lost
    expect(tab.locator("#system")).to_contain_text("read-only")
    wait_for_colours(tab, {(4, 2): (204, 102, 51)}, tolerance=1)
