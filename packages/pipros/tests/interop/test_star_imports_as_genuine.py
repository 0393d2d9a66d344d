"""`from package import *` binds the same names as in genuine ROS, including imported modules."""

import fnmatch
from collections.abc import Iterator, Mapping

import pytest

from tests.interop.test_python_api_as_genuine import PACKAGES, dumped_once, listed
from tests.support.environments import SHIPPED
from tests.support.once import shared_folder

LACKING = {
    "bondpy.bondpy.BondSM_sm": "a state machine that a compiler wrote; pipros has its own",
    "camera_calibration_parsers.camera_calibration_parsers_wrapper": "a library in C++",
    "image_geometry.cameramodels.cv2": "OpenCV, which is installed with an extra, if at all",
    "rosbag.bag.AES": "a library that is installed for encrypted bags, if at all",
    "rosbag.bag.gnupg": "a library that is installed for encrypted bags, if at all",
    "rosbag.bag.roslz4": "pipros uses lz4 from PyPI", "tf*PyKDL": "a library that pip does not have",
    "tf_conversions.*": "what PyKDL binds, a library that pip does not have",
}  # fmt: skip
"""Names that are not bound here, and what they are. Those that `listed` knows come on top."""

TOOLS = {
    *("catkin", "genmsg", "genpy", "rosclean", "rosgraph", "roslaunch", "roslib", "rosmaster"),
    *("rosmsg", "rosnode", "rosparam", "rosservice", "rostopic", "roswtf"),
}
"""Packages of Noetic's own tools. Their star imports do not repeat what the genuine modules import."""

LIBRARIES = [package for package in PACKAGES if package not in TOOLS]

MESSAGES = [
    f"{folder.parent.name}.{folder.name}"
    for kind in ("msg", "srv")
    for folder in sorted(each for share in SHIPPED for each in share.glob(f"*/{kind}"))
]

Bound = Mapping[str, Mapping[str, list[str]]]


@pytest.fixture(scope="session")
def both(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> tuple[Bound, Bound]:
    """Return the names that star imports bind in both implementations, by module."""
    folder = shared_folder(tmp_path_factory, worker_id) / "stars"
    genuine, ours = dumped_once(folder, "dump_star_imports.py", *LIBRARIES, *MESSAGES)
    assert not {name: names for name, names in ours.items() if isinstance(names, str)}
    # Errors are texts. Some modules cannot be imported in genuine ROS, either.
    return {name: names for name, names in genuine.items() if not isinstance(names, str)}, ours


def differences(genuine: Bound, ours: Bound) -> Iterator[str]:
    for module in genuine.keys() & ours.keys():
        for name, origin in genuine[module].items():
            if name not in ours[module] and not name.startswith("__") and origin[0] != "value of __future__":
                yield f"{module}.{name}"


def is_known(name: str) -> bool:
    return any(fnmatch.fnmatchcase(name, pattern) for pattern in LACKING) or listed(name) is not None


def test_star_imports_bind_the_names_of_genuine_ros(both: tuple[Bound, Bound]) -> None:
    assert sum(map(len, both[0].values())) > 2000
    assert [name for name in sorted(differences(*both)) if not is_known(name)] == []


def test_every_listed_exception_is_needed(both: tuple[Bound, Bound]) -> None:
    names = list(differences(*both))
    optional = {"image_geometry.cameramodels.cv2", "rosbag.rosbag_main"}
    assert [pattern for pattern in LACKING.keys() - optional if not fnmatch.filter(names, pattern)] == []


def test_star_imports_of_packages_and_messages_bind_nothing_else(both: tuple[Bound, Bound]) -> None:
    genuine, ours = both
    whole = [name for name in genuine if name in LIBRARIES or name in MESSAGES]
    assert len(whole) > 40
    since_1_17 = {"rospy": {"is_shutdown_requested"}}
    found = {name: more for name in whole if (more := ours[name].keys() - genuine[name].keys())}
    assert found == since_1_17


def test_imported_modules_are_the_same_as_in_genuine_ros(both: tuple[Bound, Bound]) -> None:
    genuine, ours = both
    different = [
        (module, name, origin[0], ours[module][name])
        for module in genuine.keys() & ours.keys()
        for name, origin in genuine[module].items()
        if name in ours[module] and not origin[1] and ours[module][name] != origin
    ]
    assert different == []
