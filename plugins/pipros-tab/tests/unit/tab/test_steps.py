"""The steps beside the files, done word by word."""

import html
import re
from pathlib import Path

from catkin_pkg.cli.create_pkg import main as create_package

import pipros_tab
from pipros_tools.cli.catkin_make import main as catkin_make

PAGE = Path(pipros_tab.__file__).parent / "page" / "index.html"


def test_steps_say_where_lines_belong(tmp_path: Path) -> None:
    package = tmp_path / "src" / "composiv_tryouts"
    (package / "msg").mkdir(parents=True)
    create_package(["composiv_tryouts", "rospy", "roscpp", "--rosdistro=noetic"], str(package.parent))
    (package / "msg" / "BatteryLevel.msg").write_text("string battery\n")
    for has, step in re.findall(r"<li data-file=\S+ data-has=\"(.*)\">Declare (.*)</li>", PAGE.read_text()):
        name, *words = map(html.unescape, re.findall("<code>(.*?)</code>", step))
        text = (package / name).read_text()
        if name == "CMakeLists.txt":
            component, _, below, above, *lines = words
            text = text.replace(f"  {below}\n", f"  {below}\n  {component}\n")
            text = text.replace(f"\n{above}", "\n".join(["", *lines, above]))
        else:
            text = text.replace("</exec_depend>\n\n", "\n".join(["</exec_depend>", *words, "\n"]))
        (package / name).write_text(text)
        assert re.search(html.unescape(has), text, re.MULTILINE)
    catkin_make(["-C", str(tmp_path)])
    assert any("battery: str" in stub.read_text() for stub in tmp_path.glob("devel/**/msg/*.pyi"))
