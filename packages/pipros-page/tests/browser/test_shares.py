"""Pictures have most of the window, nothing in the head is cut, and labels are legible."""

import re
import sys
from pathlib import Path

import pytest
from playwright.sync_api import Page as Tab
from playwright.sync_api import expect

from tests.browser.chromium import OpenTab
from tests.browser.every_tab import page_with_every_tab, visited
from tests.browser.shares import share_of_pictures
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

ROBOT = Path(__file__).parent / "programs" / "robot_program.py"
PANELS = "panels/row(plot//imu/angular_velocity/x*50~column(images//front/image_raw~console)*50)"
# The least shares at 1440 x 900 and 390 x 844 pixels.
LEAST = {
    "": (0.55, 0.6), PANELS: (0.45, 0.5), "scene": (0.65, 0.75), "plot//imu/angular_velocity/x": (0.7, 0.4),
}  # fmt: skip
SIZES = ((1440, 900), (390, 844))
HEAD = "header > :not(.skip, [popover]), .group:not([hidden]) > .name, .group:not(.closed) a"
CUT = f"""() => [...document.querySelectorAll("{HEAD}")]
  .filter((each) => each.checkVisibility() && each.clientWidth)
  .filter((each) => each.getBoundingClientRect().right > innerWidth + 1
    || each.scrollWidth > each.clientWidth + 1)
  .map((each) => each.outerHTML.slice(0, 100))"""
SHOWN = "each.checkVisibility({ visibilityProperty: true })"
OVERFULL = f"""() => [...document.querySelectorAll(".toolbar")].filter((row) => row.checkVisibility()
  && (row.clientHeight > 52 || [...row.children].some((each) => {SHOWN}
    && each.getBoundingClientRect().right > row.getBoundingClientRect().right + 1)))
  .map((row) => row.outerHTML.slice(0, 100))"""
SMALL_TEXTS = """() => [...document.querySelectorAll(".graph svg text")]
  .filter((each) => each.checkVisibility() && each.textContent)
  .map((each) => parseFloat(getComputedStyle(each).fontSize) * each.getScreenCTM().a)
  .filter((size) => size < 10.9)"""
WIDTHS = """() => {
  const labels = [...document.querySelectorAll(".graph .link.label")];
  const lines = [...document.querySelectorAll(".graph .link:not(.label) .arrow")];
  const widthOf = (index) => parseFloat(getComputedStyle(lines[index]).strokeWidth);
  return labels.map((label, index) => [parseFloat(label.textContent), widthOf(index)])
    .filter(([rate]) => rate > 0).sort(([one], [other]) => one - other);
}"""
"""Rates (Hz) and the widths of their lines (px), from the slowest to the fastest."""
COLOURED = """() => {
  const canvas = document.querySelector(".chart canvas");
  const { data, width, height } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  const halves = [0, 0];
  for (let at = 0; at < data.length; at += 4) {
    const isBlue = data[at + 3] > 200 && data[at + 2] - data[at] > 60;
    if (isBlue) halves[(at / 4) % width < width / 2 ? 0 : 1] += 1;
  }
  return height ? halves : null;
}"""
"""Number of pixels of the first curve in the left and in the right half of the chart."""


@pytest.fixture
def page(ros: RosSystem) -> Page:
    ros.pipros.start_master()
    ros.pipros.start(sys.executable, ROBOT, "robot")
    ros.wait_for_publisher("/imu")
    return Page(ros, command="rqt")


@pytest.mark.parametrize("size", range(2), ids=("wide", "phone"))
def test_pictures_have_most_of_the_window(page: Page, open_tab: OpenTab, size: int) -> None:
    for place, least in LEAST.items():
        tab = open_tab(page, place, SIZES[size])

        def is_large(tab: Tab = tab, wanted: float = least[size]) -> bool:
            return share_of_pictures(tab) >= wanted

        wait_until(is_large, 60, lambda tab=tab, place=place: f"{place}: {share_of_pictures(tab):.0%}")  # type: ignore[misc]
        tab.context.close()


def test_cameras_have_most_of_their_column(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "", (1440, 900))
    images = tab.get_by_role("region", name="Images")
    expect(images).to_have_count(2)
    heights = [each.bounding_box()["height"] for each in images.all()]  # type: ignore[index]
    column = tab.locator(".panels").bounding_box()
    assert column is not None
    assert sum(heights) >= 0.599 * column["height"]
    expect(images.first.locator("canvas")).to_be_visible()
    for controls in tab.locator(".panel :is(.toolbar, .legend button)").all():
        expect(controls).to_be_hidden()
    plot = tab.get_by_role("region", name="Plot")
    curves = plot.locator(".u-over").bounding_box()
    whole = plot.bounding_box()
    assert curves is not None
    assert whole is not None
    assert curves["height"] > 0.35 * whole["height"]
    assert curves["y"] + curves["height"] < whole["y"] + whole["height"]
    images.first.get_by_role("button", name="Controls of this view").click()
    expect(images.first.get_by_label("Topic", exact=True)).to_be_visible()


@pytest.mark.parametrize("width", [1440, 1280, 800, 390])
def test_nothing_is_cut_at_any_width(ros: RosSystem, open_tab: OpenTab, tmp_path: Path, width: int) -> None:
    tab = open_tab(page_with_every_tab(ros, tmp_path), "graph", (width, 900))

    def cut() -> list[str]:
        is_wide = tab.evaluate("document.documentElement.scrollWidth > innerWidth")
        return [*tab.evaluate(CUT), *tab.evaluate(OVERFULL), *(["the page"] if is_wide else [])]

    for place in visited(tab):
        wait_until(lambda: not cut(), 20, lambda place=place: f"{place}: {cut()}")  # type: ignore[misc]


@pytest.mark.parametrize("size", [(1440, 900), (1000, 500), (800, 900), (390, 844)])
def test_labels_of_the_graph_are_legible(page: Page, open_tab: OpenTab, size: tuple[int, int]) -> None:
    tab = open_tab(
        page, "graph/;mode=all;hide_dead_sinks=false;hide_leaf_topics=false;hide_debug=false", size
    )
    expect(tab.locator(".vertex", has_text="/front/image_raw")).to_be_attached()
    assert tab.evaluate(SMALL_TEXTS) == []


def test_the_graph_counts_what_it_hides_and_shows_it(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "graph", (1440, 900))
    hidden = tab.locator(".corner").get_by_role("button", name="hidden: show")
    expect(hidden).to_be_visible()
    expect(tab.locator(".vertex", has_text="/battery")).to_have_count(0)
    hidden.click()
    expect(tab.locator(".vertex", has_text="/battery")).to_have_count(1)
    expect(hidden).to_be_hidden()


def test_a_fast_topic_has_a_thicker_line_and_namespaces_a_colour(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "graph/;mode=all;hide_dead_sinks=false;hide_leaf_topics=false", (1440, 900))
    expect(tab.locator(".vertex", has_text="/front/image_raw")).to_have_class(re.compile("tinted"))
    expect(tab.locator(".vertex", has_text="/battery")).not_to_have_class(re.compile("tinted"))

    def differ() -> bool:
        found = tab.evaluate(WIDTHS)
        return len(found) > 1 and found[-1][0] > 2 * found[0][0] and found[-1][1] > found[0][1] + 0.3 > 1.5

    wait_until(differ, 60, lambda: str(tab.evaluate(WIDTHS)))


def test_curves_grow_from_the_right_of_the_chosen_span(page: Page, open_tab: OpenTab) -> None:
    tab = open_tab(page, "plot//imu/angular_velocity/x", (1200, 700))
    seconds = tab.locator("label", has_text=re.compile("^Show")).locator("select")
    seconds.select_option("300")
    wait_until(lambda: tab.evaluate(COLOURED)[1] > 0, 60, "the curve")
    assert tab.evaluate(COLOURED)[0] == 0
    expect(seconds).to_have_value("300")
