"""The page of sliders in a browser."""

from __future__ import annotations

from playwright.sync_api import expect

from tests.browser.chromium import OpenTab, keep_screenshots
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until


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
