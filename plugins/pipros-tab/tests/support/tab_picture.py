"""The picture of the tab for the documentation: `script/generate pictures tab`."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from playwright.sync_api import Browser, expect

from tests.pyodide.test_tab_page import begin, opened, picture, shows, terminal
from tests.support.pyodide_files import write_tab


def take_tab(browser: Browser, file: Path) -> None:
    """Write a picture of three terminals beside a turtle that draws a square."""
    with TemporaryDirectory() as folder:
        write_tab(Path(folder))
        command = [str(Path(sys.executable).with_name("pipros")), "serve", "--tab", folder, "--port", "0"]
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as server:
            assert server.stderr is not None
            with opened(browser, server.stderr.readline().split()[-1]) as page:
                page.set_viewport_size({"width": 1280, "height": 720})
                begin(page, "roscore")
                shows(page, "started core service")
                begin(page, "rosrun turtlesim turtlesim_node", 1)
                expect(picture(page, "turtlesim").get_by_text("The arrow keys steer")).to_be_visible()
                begin(page, "rosrun turtlesim draw_square", 2)
                expect(terminal(page, 2).get_by_text("Reached goal")).to_have_count(5)
                page.screenshot(path=file)
            server.terminate()
