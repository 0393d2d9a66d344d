"""pipros can be imported, and its pure libraries work, on systems that lack features of Linux."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.support.environments import FACADES as FACADE_FOLDERS
from tests.support.environments import SRC, import_path
from tests.support.without_posix import PACKAGES, run_without_posix

FACADES = [package for package in PACKAGES if package != "pipros"]

NEED_PYKDL = {"tf2_kdl", "tf2_kdl.tf2_kdl"}
"""They register the types of PyKDL, and say so where it is missing: PyPI does not have it."""

IMPORT_ALL = """
import importlib, json, sys, traceback
failed = {}
for name in json.loads(MODULES_AS_JSON):
    try:
        importlib.import_module(name)
    except Exception:
        failed[name] = traceback.format_exc().strip().splitlines()[-3:]
print(json.dumps(failed))
"""


def folder_of(package: str) -> Path:
    return next(folder / package for folder in (SRC, *FACADE_FOLDERS) if (folder / package).is_dir())


def modules_of(folder: Path) -> list[str]:
    files = sorted(file for file in folder.rglob("*.py") if "share" not in import_path(file).parts)
    names = [".".join(import_path(file).with_suffix("").parts) for file in files]
    return [name.removesuffix(".__init__") for name in names if not name.endswith("__main__")]


@pytest.mark.parametrize("packages", [["pipros"], FACADES], ids=["pipros", "facades"])
def test_every_module_can_be_imported_without_what_only_posix_has(packages: list[str]) -> None:
    """In one process for many modules, because a failed import does not affect the others."""
    modules = [module for package in packages for module in modules_of(folder_of(package))]
    assert set(packages) <= set(modules)
    modules = [module for module in modules if module not in NEED_PYKDL]
    failed = run_without_posix(f"MODULES_AS_JSON = {json.dumps(modules)!r}\n{IMPORT_ALL}")
    assert json.loads(failed) == {}


MESSAGES = """
from pipros.msg.dynamic import message_classes_from_text
from pipros import load_message_class, load_service_class

text = "uint8 FULL=100\\nstring name\\nfloat64[] cells"
Level = message_classes_from_text("robot/Level", text)["robot/Level"]
buffer = io.BytesIO()
Level(name="front", cells=[1.5, 2.5]).serialize(buffer)
read = Level().deserialize(buffer.getvalue())
assert (read.name, list(read.cells), read.FULL) == ("front", [1.5, 2.5], 100)
assert load_message_class("std_msgs/String")(data="x").data == "x"
assert load_service_class("std_srvs/SetBool")._request_class(data=True).data
"""

BAGS = """
import rosbag, rospy
from pipros.bag import BagReader
from std_msgs.msg import String

for compression in ("none", "bz2"):
    with rosbag.Bag("run.bag", "w", compression=compression) as bag:
        for second in (1, 2):
            bag.write("/chat", String(f"{compression} {second}"), rospy.Time(second))
    with BagReader(Path("run.bag")) as reader:
        assert [chunk.data for _, chunk, _, _ in reader] == [f"{compression} 1", f"{compression} 2"]
        assert reader.chunk_header(0).compression == compression
    with rosbag.Bag("run.bag") as bag:
        read = [(topic, time.to_sec()) for topic, _, time in bag.read_messages(start_time=rospy.Time(2))]
        assert read == [("/chat", 2.0)]
"""

TRANSFORMS = """
import rospy, tf2_ros
from geometry_msgs.msg import TransformStamped
from pipros.libraries.transforms.buffer import TransformBuffer

frames = TransformBuffer()
for second in (1, 3):
    frames.insert("map", "base", second * 10**9, (second, 0, 0, 0, 0, 0, 1), "test")
assert frames.lookup("map", "base", 2 * 10**9)[1][0] == 2.0

buffer = tf2_ros.BufferCore()
moved = TransformStamped()
moved.header.frame_id, moved.child_frame_id = "map", "base"
moved.transform.translation.x, moved.transform.rotation.w = 5.0, 1.0
buffer.set_transform_static(moved, "test")
assert buffer.lookup_transform_core("base", "map", rospy.Time(7)).transform.translation.x == -5.0
"""

FILTERS = """
import message_filters
from geometry_msgs.msg import PointStamped

def stamped(second):
    message = PointStamped()
    message.header.stamp.secs = second
    return message

sets = []
inputs = message_filters.SimpleFilter(), message_filters.SimpleFilter()
message_filters.TimeSynchronizer(inputs, 5).registerCallback(lambda *found: sets.append(found))
cache = message_filters.Cache(inputs[0], 5)
for number, second in ((0, 1), (0, 2), (1, 2)):
    inputs[number].signalMessage(stamped(second))
assert [[message.header.stamp.secs for message in found] for found in sets] == [[2, 2]]
assert cache.getLastestTime().secs == 2
"""


@pytest.mark.parametrize("in_browser", [False, True], ids=["windows", "browser"])
@pytest.mark.parametrize(
    "work", [MESSAGES, BAGS, TRANSFORMS, FILTERS], ids=["messages", "bags", "transforms", "filters"]
)
def test_pure_libraries_work_without_posix_and_in_a_browser(
    work: str, in_browser: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a browser also without threads, processes and sockets."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "home"))
    code = f"import io\nfrom pathlib import Path\n{work}\nprint('done')"
    assert run_without_posix(code, in_browser=in_browser) == "done\n"


@pytest.mark.parametrize(
    "attempt",
    ["threading.Thread(target=print).start()", "subprocess.run(['true'])", "socket.socket().listen()"],
)
def test_the_browser_of_these_tests_starts_and_connects_nothing(attempt: str) -> None:
    code = f"try:\n    {attempt}\nexcept RuntimeError as error:\n    print(error)"
    shown = run_without_posix(code, in_browser=True)
    assert shown == "a browser starts no threads or processes, and connects no sockets\n"
