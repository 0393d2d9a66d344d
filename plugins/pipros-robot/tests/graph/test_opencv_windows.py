"""Windows of OpenCV on a page: images, keys, trackbars and the mouse, for builds of OpenCV without a GUI."""

from collections.abc import Iterator

import cv2
import numpy
import pytest

from tests.support.page import Page
from tests.support.ros import RosSystem

BEFORE, AFTER = (
    "import cv2, rospy\nrospy.init_node('viewer')",
    "import rospy\nrospy.init_node('viewer')\nimport cv2",
)
PROGRAM = """
import numpy
image = numpy.zeros((40, 60, 3), numpy.uint8)
image[:, :, 2] = 255
cv2.namedWindow("view")
cv2.createTrackbar("hue", "view", 10, 179, lambda value: print("hue", value, flush=True) or 0)
cv2.setMouseCallback("view", lambda *seen: print("mouse", *seen, flush=True), "mine")
cv2.imshow("view", image)
print("at", cv2.getTrackbarPos("hue", "view"), flush=True)
while True:
    key = cv2.waitKey(10)
    if key == ord("q"):
        break
    if key == ord("b"):
        image[:] = (255, 0, 0)
        cv2.imshow("view", image)
cv2.destroyAllWindows()
print("open", cv2.getWindowProperty("view", cv2.WND_PROP_VISIBLE), flush=True)
print("end", cv2.waitKey(0), flush=True)
rospy.spin()
"""


@pytest.fixture(params=[BEFORE, AFTER], ids=["imported before", "imported after"])
def program(request: pytest.FixtureRequest) -> str:
    return str(request.param) + PROGRAM


def middle(images: Iterator[bytes]) -> list[int]:
    """Return the colour (blue, green, red) in the middle of the next image."""
    data = numpy.frombuffer(next(images), numpy.uint8)
    image = cv2.imdecode(data, cv2.IMREAD_COLOR)
    assert image.shape == (40, 60, 3)
    return [int(value) for value in image[20, 30]]


def test_a_program_with_windows_runs_on_a_page(ros: RosSystem, program: str) -> None:
    ros.serve_master()
    (ros.home / "viewer.py").write_text(program)
    viewer = ros.pipros.start("python3", "viewer.py")
    with Page.of(viewer).connect() as browser:
        viewer.wait_for("^at 10$")
        windows = browser.watch("windows")
        assert next(windows) == {
            "node": "/viewer",
            "windows": [
                {"name": "view", "title": "view", "hasMouse": True, "trackbars": [["hue", 0, 179, 10]]}
            ],
        }
        images = browser.watch("image", window="view")
        assert middle(images) == pytest.approx([0, 0, 255], abs=3)

        browser.act("move", window="view", trackbar="hue", value=90)
        viewer.wait_for("^hue 90$")
        browser.act("mouse", window="view", event=cv2.EVENT_LBUTTONDOWN, x=5, y=7, flags=1)
        viewer.wait_for("^mouse 1 5 7 1 mine$")
        browser.act("key", code=ord("b"))
        assert middle(images) == pytest.approx([255, 0, 0], abs=3)
        for action, wrong in (
            ("key", {"code": "q"}),
            ("mouse", {"window": "view", "event": 99, "x": 0, "y": 0, "flags": 0}),
            ("move", {"window": "view", "trackbar": "hue", "value": 180}),
            ("move", {"window": "other", "trackbar": "hue", "value": 1}),
        ):
            assert "error" in browser.act(action, **wrong)
        browser.act("key", code=ord("q"))
        viewer.wait_for("^open 0.0$")
        viewer.wait_for("^end -1$")
    viewer.press_ctrl_c()
    assert viewer.wait() == 0


def test_ctrl_c_ends_a_program_that_waits_for_a_key(ros: RosSystem) -> None:
    ros.serve_master()
    (ros.home / "viewer.py").write_text(
        f"{BEFORE}\nimport numpy\ncv2.imshow('x', numpy.zeros((2, 2)))\nprint('up', flush=True)\n"
        "print(cv2.waitKey())"
    )
    viewer = ros.pipros.start("python3", "viewer.py")
    viewer.wait_for("^up$")
    viewer.press_ctrl_c()
    assert viewer.wait() == 0
    assert "-1" in viewer.stdout


@pytest.mark.parametrize(
    ("start", "variables"),
    [("import cv2, rospy", {}), (BEFORE, {"PIPROS_WINDOWS": "off"}), (AFTER, {"PIPROS_WINDOWS": "off"})],
    ids=["no node", "off", "off, imported after"],
)
def test_opencv_is_unchanged_without_a_node_or_if_switched_off(
    ros: RosSystem, start: str, variables: dict[str, str]
) -> None:
    ros.serve_master()
    (ros.home / "viewer.py").write_text(f"{start}\ncv2.namedWindow('x')")
    ended = ros.pipros.run("python3", "viewer.py", **variables)
    assert ended.returncode == 1
    assert "cv2.error" in ended.output
