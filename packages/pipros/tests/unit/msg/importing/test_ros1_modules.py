"""The names below `pipros.ros1`, beside packages that rosidl generated for ROS 2 under the same names."""

import ast
import gc
import importlib
import pickle
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from importlib.machinery import ModuleSpec
from pathlib import Path

import pytest

from pipros.msg import load_message_class, load_service_class
from pipros.msg.importing.beside_ros2 import Ros1Loader, Ros2Finder
from pipros.msg.importing.hook import installed_library
from pipros.msg.importing.modules import is_ros2_folder, why_not_ros1
from pipros.msg.importing.ros1_modules import ros1_spec

Make = Callable[[str], Path]
GENERATED = """
class Metaclass_{name}(type):
    @classmethod
    def __import_type_support__(cls): ...
class {name}(metaclass=Metaclass_{name}): ...
"""


@pytest.fixture
def make_ros2(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Make]:
    """Return a function that makes a package of ROS 2 importable, and returns its folder."""
    before = dict(sys.modules)
    monkeypatch.syspath_prepend(tmp_path)

    def forget(name: str) -> None:
        for module in [each for each in sys.modules if name in each.split(".")]:
            del sys.modules[module]

    def make(name: str) -> Path:
        folder = tmp_path / name
        for kind, type_name in (("msg", "Sample"), ("srv", "Question")):
            (folder / kind).mkdir(parents=True)
            (folder / kind / "__init__.py").write_text(GENERATED.format(name=type_name))
        (folder / "__init__.py").touch()
        (folder / f"{name}_s__rosidl_typesupport_c.so").touch()
        forget(name)
        return folder

    yield make
    for module in [each for each in sys.modules if each not in before]:
        del sys.modules[module]
    sys.modules.update(before)
    for name in list(vars(importlib.import_module("pipros.ros1"))):
        if name.endswith(("_msgs", "_srvs")):
            delattr(importlib.import_module("pipros.ros1"), name)


def test_without_ros2_the_names_are_those_of_the_public_modules() -> None:
    assert importlib.import_module("pipros.ros1.std_msgs.msg") is importlib.import_module("std_msgs.msg")
    assert importlib.import_module("pipros.ros1.std_srvs.srv._SetBool").SetBool is load_service_class(
        "std_srvs/SetBool"
    )


def test_ros1_has_its_own_modules_beside_those_of_ros2(make_ros2: Make) -> None:
    make_ros2("map_msgs")
    assert importlib.import_module("map_msgs.msg").Sample.__module__ == "map_msgs.msg"
    found = load_message_class("map_msgs/OccupancyGridUpdate")
    assert found.__module__ == "pipros.ros1.map_msgs.msg._OccupancyGridUpdate"
    assert found is importlib.import_module("pipros.ros1.map_msgs.msg").OccupancyGridUpdate
    assert type(found().header) is load_message_class("std_msgs/Header")
    assert pickle.loads(pickle.dumps(found(width=3))).width == 3  # noqa: S301  # its own
    assert load_service_class("map_msgs/GetMapROI").__module__ == "pipros.ros1.map_msgs.srv._GetMapROI"


def test_embedded_types_are_those_of_ros1(make_ros2: Make) -> None:
    make_ros2("uuid_msgs")
    assert load_message_class("geographic_msgs/WayPoint")._slot_types[0] == "uuid_msgs/UniqueID"
    assert "UniqueID" in dir(importlib.import_module("pipros.ros1.uuid_msgs.msg"))


def test_python_modules_of_ros1_packages_are_found_too(make_ros2: Make) -> None:
    make_ros2("sensor_msgs")
    module = importlib.import_module("pipros.ros1.sensor_msgs.point_cloud2")
    assert module.PointCloud2 is load_message_class("sensor_msgs/PointCloud2")
    with pytest.raises(ModuleNotFoundError):
        importlib.import_module("pipros.ros1.sensor_msgs.no_such_module")


@pytest.mark.parametrize("name", ["no_such_msgs", "no_such_msgs.msg", "os.msg"])
def test_other_names_do_not_exist(name: str) -> None:
    assert ros1_spec(installed_library(), f"pipros.ros1.{name}") is None


def test_types_that_ros1_lacks_do_not_exist(make_ros2: Make) -> None:
    make_ros2("map_msgs")
    with pytest.raises(ModuleNotFoundError):
        importlib.import_module("pipros.ros1.map_msgs.msg._Sample")


def test_packages_that_genpy_generated_are_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "only_generated" / "msg").mkdir(parents=True)
    (tmp_path / "only_generated" / "__init__.py").touch()
    (tmp_path / "only_generated" / "msg" / "__init__.py").write_text("Arm = 1\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert importlib.import_module("pipros.ros1.only_generated.msg").Arm == 1


def test_a_variable_gives_the_public_name_to_ros1(make_ros2: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    make_ros2("map_msgs")
    ros1 = ModuleSpec("map_msgs", None)
    finder = Ros2Finder(lambda name: ros1 if name == "map_msgs" else None)
    assert finder.find_spec("map_msgs") is None
    monkeypatch.setenv("PIPROS_MESSAGES", "ros1")
    assert finder.find_spec("map_msgs") is ros1
    assert finder.find_spec("json") is None
    assert finder.find_spec("no_such_module") is None


def test_facades_are_compiled_with_the_names_of_ros1(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    assert isinstance(Ros2Finder(lambda _name: None).find_spec("tf2_ros").loader, Ros1Loader)
    file = tmp_path / "facade.py"
    file.write_text(
        "from std_msgs.msg import String\nHOMES = ('std_msgs.msg', 'threading std_msgs.msg:Bool')\n"
    )
    for _ in range(2):  # the second one is read from the bytecode
        module = importlib.util.module_from_spec(ModuleSpec("facade", Ros1Loader("facade", str(file))))
        Ros1Loader("facade", str(file)).exec_module(module)
        assert module.HOMES == ("pipros.ros1.std_msgs.msg", "threading pipros.ros1.std_msgs.msg:Bool")
        assert module.String is load_message_class("std_msgs/String")
    assert [each.suffixes[-2] for each in (tmp_path / "__pycache__").iterdir()] == [".ros1"]


def test_threads_import_facades_at_the_same_time() -> None:
    """Debian's Python 3.11 shares the depth of trees between threads, which change during a collection."""
    source = Path(ast.__file__).read_bytes()

    def compile_below(frames: int) -> object:
        return compile_below(frames - 1) if frames else Ros1Loader("a", "a.py").source_to_code(source, "a.py")

    def collected(*_: object) -> None:
        """Let another thread run."""

    gc.callbacks.append(collected)
    interval = sys.getswitchinterval()
    # A thread that starts while another one does cannot install the trace function of a measured run.
    all_started = threading.Barrier(5)
    try:
        with ThreadPoolExecutor(4, initializer=all_started.wait) as threads:
            compiled = threads.map(compile_below, [0, 20, 40, 60] * 10)
            all_started.wait(60)
            sys.setswitchinterval(1e-6)
            assert all(compiled)
    finally:
        sys.setswitchinterval(interval)
        gc.callbacks.remove(collected)


def test_a_class_of_ros2_is_named_with_its_file_and_the_alternatives(make_ros2: Make) -> None:
    folder = make_ros2("map_msgs")
    sample = importlib.import_module("map_msgs.msg").Sample
    sample.__module__ = "map_msgs.msg._sample"  # as rosidl generates it
    for value in (sample, sample()):
        assert why_not_ros1(value) == (
            f"map_msgs.msg.Sample is a class of ROS 2 ({folder}/msg/__init__.py), whose packages have the "
            "same names in this environment. Install ROS 2 in an environment of its own, or import ROS 1's "
            "class: from pipros.ros1.map_msgs.msg import Sample"
        )


def test_a_missing_folder_is_not_of_ros2(tmp_path: Path) -> None:
    assert not is_ros2_folder(str(tmp_path / "gone"))
