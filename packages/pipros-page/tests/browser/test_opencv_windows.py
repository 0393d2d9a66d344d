"""Windows of OpenCV in a browser: images, trackbars, keys and the mouse."""

from playwright.sync_api import expect

from tests.browser.chromium import OpenTab, keep_screenshots
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

PROGRAM = """
import cv2, numpy, rospy
rospy.init_node("viewer")
image = numpy.zeros((240, 320, 3), numpy.uint8)
cv2.circle(image, (160, 120), 80, (0, 200, 255), -1)
cv2.putText(image, "pipros", (110, 128), cv2.FONT_HERSHEY_SIMPLEX, 1, (60, 0, 0), 2)
cv2.imshow("camera", image)
cv2.namedWindow("mask")
cv2.imshow("mask", cv2.inRange(image, (0, 100, 200), (50, 255, 255)))
cv2.createTrackbar("lowest hue", "mask", 20, 179, lambda value: print("hue", value, flush=True))
cv2.createTrackbar("highest hue", "mask", 90, 179, lambda value: None)
cv2.setMouseCallback("camera", lambda *seen: print("mouse", *seen, flush=True))
while True:
    key = cv2.waitKeyEx(20)
    if key != -1:
        print("key", key, flush=True)
    if key == 27:
        break
cv2.destroyWindow("camera")
rospy.spin()
"""


def test_windows_have_images_trackbars_keys_and_a_mouse(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    (ros.home / "viewer.py").write_text(PROGRAM)
    viewer = ros.pipros.start("python3", "viewer.py")
    tab = open_tab(Page.of(viewer), "")
    expect(tab).to_have_title("OpenCV /viewer")
    camera = tab.get_by_alt_text("camera")
    tab.wait_for_function("() => document.querySelector('img')?.naturalWidth === 320")

    camera.click(position={"x": 100, "y": 50})
    viewer.wait_for(r"^mouse 1 100 50 1 None$")  # pressed, with the left button
    viewer.wait_for(r"^mouse 4 100 50 0 None$")  # released
    tab.keyboard.press("a")
    viewer.wait_for("^key 97$")
    tab.keyboard.press("ArrowLeft")
    viewer.wait_for("^key 65361$")
    hue = tab.get_by_label("lowest hue")
    expect(hue).to_have_value("20")
    hue.press("ArrowRight")
    viewer.wait_for("^hue 21$")
    keep_screenshots(tab, "opencv-windows")

    tab.get_by_role("button", name="Close mask").click()
    expect(tab.get_by_alt_text("mask")).to_have_count(0)
    tab.keyboard.press("Escape")
    expect(camera).to_have_count(0)
    expect(tab.get_by_text("The program has no open window.")).to_be_visible()


# The page of sliders in a browser.


def test_a_slider_moves_with_keys_and_a_button_resets_it(ros: RosSystem, open_tab: OpenTab) -> None:
    ros.serve_master()
    steering = ros.pipros.start("rosrun", "rqt_robot_steering", "rqt_robot_steering", "__name:=steering")
    tab = open_tab(Page.of(steering), "")
    expect(tab).to_have_title("Steering /cmd_vel /steering")
    slider = tab.get_by_label("linear")
    expect(slider).to_have_value("0")
    echo = ros.pipros.start("rostopic", "echo", "/cmd_vel/linear/x")
    slider.press("End")
    wait_until(lambda: echo.output.count("3.0\n") > 15, 30, lambda: echo.output)  # the page repeats it
    expect(tab.locator("output").first).to_have_text("3.000 m/s")
    keep_screenshots(tab, "sliders")
    tab.get_by_role("button", name="Stop").click()
    expect(slider).to_have_value("0")
    echo.wait_for(r"^0\.0")
