"""Switching tabs, selecting, zooming and going back lose nothing."""

import re

import pytest
from playwright.sync_api import expect

from tests.browser.chromium import OpenTab, go_to
from tests.support.page import Page
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until


@pytest.fixture
def system(ros: RosSystem) -> RosSystem:
    ros.serve_master()
    ros.pipros.start("rostopic", "pub", "-r", "20", "/level", "std_msgs/Float64", "2.5", "__name:=talker")
    ros.pipros.start("rostopic", "echo", "/level", "__name:=listener").wait_for("2.5")
    return ros


def test_curves_survive_a_visit_to_another_tab(system: RosSystem, open_tab: OpenTab) -> None:
    tab = open_tab(Page(system), "plot//level/data")
    legend = tab.locator(".tab-plot .legend")
    expect(legend).to_contain_text("/level/data: 2.5")
    go_to(tab, "Console")
    expect(tab.locator(".tab-plot")).to_be_hidden()
    go_to(tab, "Plot")
    expect(tab).to_have_url(re.compile("#plot//level/data$"))
    expect(legend).to_contain_text("/level/data: 2.5")


def test_a_filter_survives_a_visit_to_another_tab(system: RosSystem, open_tab: OpenTab) -> None:
    tab = open_tab(Page(system), "topics")
    tab.get_by_label("Filter topics").fill("lev")
    expect(tab.locator(".tab-topics tbody tr")).to_have_count(1)
    go_to(tab, "Nodes")
    go_to(tab, "Topics")
    expect(tab.get_by_label("Filter topics")).to_have_value("lev")
    expect(tab.locator(".tab-topics tbody tr")).to_have_count(1)


def test_publishing_continues_in_another_tab(system: RosSystem, open_tab: OpenTab) -> None:
    tab = open_tab(Page(system, "--control"), "publish")
    tab.get_by_label("Topic", exact=True).fill("/by_hand")
    tab.get_by_label("Type", exact=True).fill("std_msgs/String")
    tab.get_by_label("Type", exact=True).press("Tab")
    expect(tab.get_by_label("Message in YAML")).to_have_value(re.compile("data"))
    tab.get_by_label("Rate in hertz").fill("20")
    tab.get_by_role("button", name="Publish", exact=True).click()
    go_to(tab, "Topics")
    echo = system.pipros.start("rostopic", "echo", "-n", "3", "/by_hand")
    assert echo.wait() == 0
    tab.get_by_role("button", name="publishing 1").click()
    tab.get_by_role("button", name="Stop publishing /by_hand").click()
    expect(tab.get_by_role("button", name="publishing")).to_have_count(0)
    wait_until(lambda: "/by_hand" not in system.pipros.run("rostopic", "list").stdout, 60)


def test_a_message_published_once_is_not_published_again_after_a_restart(system, open_tab, tmp_path) -> None:
    file = tmp_path / "tokens"
    file.touch(mode=0o600)
    file.write_text("a-token-of-this-robot\n")
    page = Page(system, "--control", "--token-file", file)
    tab = open_tab(page, "publish//goal")
    tab.get_by_label("Type", exact=True).fill("std_msgs/String")
    tab.get_by_label("Type", exact=True).press("Tab")
    expect(tab.get_by_label("Message in YAML")).to_have_value('data: ""')
    tab.get_by_label("Message in YAML").fill("data: there")
    tab.get_by_label("Rate in hertz").fill("0")
    tab.get_by_role("button", name="Publish", exact=True).click()
    expect(tab.get_by_role("button", name="publishing 1")).to_be_visible()
    page.process.press_ctrl_c()
    page.process.wait()
    expect(tab.locator(".tab-publish .error")).to_contain_text("no longer published")
    host = page.host.replace("localhost", "127.0.0.1")
    Page(system, "--control", "--token-file", file, "--bind", host)
    expect(tab.get_by_role("button", name="publishing")).to_have_count(0)


def test_selecting_a_node_keeps_the_zoom(system: RosSystem, open_tab: OpenTab) -> None:
    tab = open_tab(Page(system), "graph")
    canvas = tab.locator("svg.canvas")
    node = tab.locator('[data-key="node:/talker"]')
    expect(node).to_be_visible()
    tab.get_by_role("button", name="Zoom in").click(click_count=3)
    scale = "element => element.viewBox.baseVal.width / element.clientWidth"
    before = canvas.evaluate(scale)
    node.press("Enter")
    expect(tab.locator("aside h2")).to_have_text("/talker")
    wait_until(lambda: canvas.evaluate(scale) == pytest.approx(before, rel=0.01), 30, "the same scale")


def test_two_fingers_zoom_the_graph(system: RosSystem, open_tab: OpenTab) -> None:
    tab = open_tab(Page(system), "graph")
    canvas = tab.locator("svg.canvas")
    expect(tab.locator('[data-key="node:/talker"]')).to_be_visible()
    box = canvas.bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] - 60
    width = "element => element.viewBox.baseVal.width"
    before = canvas.evaluate(width)
    session = tab.context.new_cdp_session(tab)
    for step in range(6):
        points = [{"x": x + side * (50 + 20 * step), "y": y, "id": side + 1} for side in (-1, 1)]
        kind = "touchMove" if step else "touchStart"
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    wait_until(
        lambda: canvas.evaluate(width) == pytest.approx(before / 3, rel=0.05), 30, "a third of the width"
    )


def test_a_selected_text_survives_updates(system: RosSystem, open_tab: OpenTab) -> None:
    tab = open_tab(Page(system), "topics")
    cell = tab.locator("tr[data-name='/level'] td").first
    expect(cell).to_have_text("/level")
    cell.evaluate("element => getSelection().selectAllChildren(element)")
    system.pipros.start("rostopic", "pub", "/another", "std_msgs/Float64", "1")
    expect(tab.locator("tr[data-name='/another']")).to_be_visible()  # an update of the table
    assert tab.evaluate("getSelection().toString()") == "/level"


def test_back_returns_to_the_earlier_selection(system: RosSystem, open_tab: OpenTab) -> None:
    tab = open_tab(Page(system), "graph")
    tab.locator('[data-key="node:/talker"]').press("Enter")
    tab.locator('[data-key="node:/listener"]').press("Enter")
    expect(tab.locator("aside h2")).to_have_text("/listener")
    tab.go_back()
    expect(tab.locator("aside h2")).to_have_text("/talker")
    expect(tab).to_have_url(re.compile("#graph/node:/talker$"))


def test_a_malformed_address_opens_the_tab(system: RosSystem, open_tab: OpenTab) -> None:
    tab = open_tab(Page(system), "topics/%zz")
    expect(tab.locator("tr[data-name='/level']")).to_be_visible()


def test_a_search_shows_hidden_topics_and_the_address_holds_it(system: RosSystem, open_tab: OpenTab) -> None:
    page = Page(system)
    tab = open_tab(page, "graph")
    expect(tab.locator('[data-key="topic:/level"]')).to_be_visible()
    system.pipros.start("rostopic", "pub", "/unheard", "std_msgs/String", "x", "__name:=lonely")
    expect(tab.locator('[data-key="node:/lonely"]')).to_be_visible()
    tab.get_by_label("Search nodes and topics").fill("unheard")
    expect(tab.locator(".bar [role=status]")).to_have_text("0 found, 1 hidden: show")
    tab.locator(".bar [role=status]").get_by_role("button", name="1 hidden: show").click()
    expect(tab.locator('[data-key="topic:/unheard"]')).to_be_visible()
    tab.get_by_label("Search nodes and topics").press("Enter")  # selects the only hit
    expect(tab.locator("aside h2")).to_have_text("/unheard")
    other = open_tab(page, tab.evaluate("location.hash").removeprefix("#"))
    expect(other.locator('[data-key="topic:/unheard"].selected')).to_be_visible()


def test_the_address_can_be_opened_again_in_the_same_tab(system: RosSystem, open_tab: OpenTab) -> None:
    page = Page(system)
    tab = open_tab(page, "topics//level")
    for _ in range(3):
        expect(tab.locator("aside")).to_contain_text("2.5")
        tab.goto(page.url_of("plot//level/data"))
        expect(tab.locator(".tab-plot .legend")).to_contain_text("/level/data: 2.5")
        tab.goto(page.url_of("topics//level"))


def test_the_focus_survives_updates_of_parameters(system: RosSystem, open_tab: OpenTab) -> None:
    system.pipros.run("rosparam", "set", "/arm/speed", "1")
    tab = open_tab(Page(system, "--control"), "params")
    button = tab.get_by_role("button", name="speed: 1")
    button.focus()
    system.pipros.run("rosparam", "set", "/arm/angle", "2")
    expect(tab.get_by_role("button", name="angle: 2")).to_be_visible()
    system.pipros.run("rosparam", "set", "/leg/angle", "3")
    expect(tab.get_by_role("button", name="angle: 3")).to_be_visible()
    assert tab.evaluate("document.activeElement.title") == "Edit"


def test_data_for_a_hidden_tab_leaves_the_address_alone(system: RosSystem, open_tab: OpenTab) -> None:
    # not the path of a number: the plot will offer the numbers in the message
    tab = open_tab(Page(system), "plot//twist")
    expect(tab.locator(".tab-plot .legend")).to_contain_text("is not published yet")
    go_to(tab, "Console")
    kind, value = "geometry_msgs/Vector3", "{x: 1}"
    system.pipros.start("rostopic", "pub", "-r", "10", "/twist", kind, value, "__name:=twister")
    expect(tab.get_by_role("group", name="Fields", include_hidden=True)).to_contain_text("Numbers of /twist")
    assert tab.url.endswith("#console")
    go_to(tab, "Plot")
    expect(tab.get_by_role("button", name="x", exact=True)).to_be_visible()
