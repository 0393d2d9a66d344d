"""Messages of pipros and packages of messages compared with those of genuine genpy."""

import json
import os
import sys
from pathlib import Path
from typing import Any

import pytest

import genpy
from tests.interop.programs.examine_corners import __file__ as corners_script
from tests.interop.programs.examine_messages import ask, ask_genuine, ask_pipros
from tests.interop.programs.examine_time import __file__ as time_script
from tests.interop.programs.examine_time import expressions, outcome
from tests.interop.random_definitions import HEADER, SEPARATOR, TYPES, full_text
from tests.support.catkin import CatkinWorkspace
from tests.support.examples import examples
from tests.support.same_results import printed

SHARE = Path("/usr/share")
WITHOUT_PYTHON = ("nodelet", "shape_msgs", "stereo_msgs", "trajectory_msgs")
"""Packages of which the interop machine has the definitions, but no classes made by genpy."""
INCOMPLETE = ("tf",)
"""Packages whose messages use tf2_msgs, of which Debian installs a package without definitions."""


def installed_types() -> list[dict[str, Any]]:
    jobs: list[dict[str, Any]] = []
    for file in sorted(SHARE.glob("*/msg/*.msg")):
        jobs.append({"type": f"{file.parts[3]}/{file.stem}"})
    for file in sorted(SHARE.glob("*/srv/*.srv")):
        service = f"{file.parts[3]}/{file.stem}"
        jobs += [{"type": service + half, "service": service} for half in ("Request", "Response")]
    kept = [job for job in jobs if job["type"].partition("/")[0] not in (*WITHOUT_PYTHON, *INCOMPLETE)]
    return [{**job, "seed": seed, "count": 8} for seed, job in enumerate(kept)]


def test_every_installed_type_looks_the_same_to_a_program() -> None:
    jobs = installed_types()

    # Under another name, Debian's folder comes before the packages of pipros, as any other on the path.
    expected, found = ask_genuine(jobs), ask_pipros(jobs, ROS_PACKAGE_PATH=f"{SHARE}/.")

    assert len(jobs) > 150
    for job, genuine, ours in zip(jobs, expected, found, strict=True):
        assert ours == genuine, job["type"]


@pytest.mark.parametrize("first", range(0, examples(600), 100))
def test_made_up_types_look_the_same_to_a_program(first: int) -> None:
    seeds = range(first, first + 100)
    jobs = [{"type": "made/T", "text": full_text(seed), "seed": seed, "count": 4} for seed in seeds]

    answers = list(zip(jobs, ask_genuine(jobs), ask_pipros(jobs), strict=True))

    compared = [answer for answer in answers if not is_own_accident(answer[1])]
    assert len(compared) > 85
    for job, genuine, ours in compared:
        assert ours == genuine, f"seed {job['seed']}:\n{job['text']}"


def is_own_accident(answer: Any) -> bool:
    """Return True if genuine genpy failed in its own generated code, as it sometimes does."""
    return isinstance(answer, list) and answer[1] in ("SyntaxError", "AttributeError", "NameError")


ODD = ["'a'", "1.5", "300", "-1", "None", "[1, 2]", "['a']", "b'ab'", "True", "2", "10000000000000000000000"]
ODD += ["'\\xfc'", "[]", "(1, 2)", "[1.5]", "[None]", "[b'a']", "[300]", "[-1]", "(1, 2, 3)", "b'abcdefgh'"]


def test_values_that_do_not_fit_a_field_are_refused_with_genpys_text() -> None:
    jobs = []
    for kind in [*TYPES, "made/In", "std_msgs/Header"]:
        for array in ("", "[]", "[3]"):
            inner = f"{SEPARATOR}\nMSG: made/In\nint32 x\n{HEADER}"
            alone = [{"f": {"python": value}} for value in ODD]
            jobs.append({"type": "made/T", "text": f"{kind}{array} f\n{inner}", "odd": alone})
            within = f"int32 a\nmade/Q q\n{SEPARATOR}\nMSG: made/Q\n{kind}{array} f\nint8 b\n{inner}"
            jobs.append({"type": "made/T", "text": within, "odd": [{"q": value} for value in alone]})

    expected, found = ask_genuine(jobs), ask_pipros(jobs)

    compared = 0
    for job, genuine, ours in zip(jobs, expected, found, strict=True):
        for value, theirs, mine in zip(job["odd"], genuine["odd"], ours["odd"], strict=True):
            where = f"{job['text']}{value}"
            if isinstance(theirs, str) or (
                theirs[1] == "SerializationError" and theirs[2].startswith("field ")
            ):
                assert mine == theirs, where
                compared += 1
            else:  # genuine ROS raises AttributeError, or prints a text about its internals
                assert mine[:2] == ["raised", "SerializationError"], where
    assert compared > 1500


# Messages, their tools and times, in corner cases of genpy and genmsg.
def test_every_corner_looks_as_in_genuine_ros() -> None:
    # The texts of genuine ROS' definitions, including comments. Under another name, Debian's folder comes
    # before the packages of pipros, as any other on the path.
    path = {"ROS_PACKAGE_PATH": "/usr/share/."}
    genuine = answers("/usr/bin/python3", {"PATH": "/usr/bin:/bin", **path})
    own = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")} | path

    ours = answers(sys.executable, own)

    assert len(genuine) > 700
    assert {line: ours[line] for line in genuine if ours[line] != genuine[line]} == {}
    failed = [line for line, said in genuine.items() if "NameError" in said]
    assert failed == [], "these lines say nothing"


def answers(python: str, environment: dict[str, str]) -> dict[str, str]:
    found: dict[str, str] = json.loads(printed(python, corners_script, environment=environment))
    return found


# Time and Duration of pipros and of genuine genpy, on the same expressions.
def test_every_expression_has_the_same_outcome() -> None:
    asked = expressions(seed=1, count=2000)
    genuine = printed("/usr/bin/python3", time_script, given=json.dumps(asked))

    expected = dict(zip(asked, json.loads(genuine), strict=True))

    assert {expression: outcome(expression, genpy) for expression in asked} == expected


# Packages generated by genuine ROS, and pickles in both directions.
GENERATED = Path("/usr/lib/python3/dist-packages")
PACKAGES = ["actionlib_msgs", "diagnostic_msgs", "geometry_msgs", "nav_msgs", "rosgraph_msgs", "sensor_msgs"]
PACKAGES += ["std_msgs", "std_srvs"]
ENVIRONMENT = {name: value for name, value in os.environ.items() if not name.startswith("ROS_")}


@pytest.fixture
def generated(tmp_path: Path) -> Path:
    """A folder with packages generated by genpy, as in a devel space, but without genpy."""
    for package in PACKAGES:
        (tmp_path / package).symlink_to(GENERATED / package)
    return tmp_path


def test_packages_that_genpy_generated_run_on_pipros(generated: Path) -> None:
    jobs = [job for job in installed_types() if job["type"].partition("/")[0] in PACKAGES]

    found = ask([sys.executable], jobs, {**ENVIRONMENT, "PYTHONPATH": str(generated)})

    assert len(jobs) > 100
    for job, ours, genuine in zip(jobs, found, ask_genuine(jobs), strict=True):
        assert ours == genuine, job["type"]


def test_a_definition_may_embed_what_genpy_generated(generated: Path, tmp_path: Path) -> None:
    package = tmp_path / "src" / "robot"
    (package / "msg").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>robot</name></package>")
    (package / "msg" / "Goal.msg").write_text("geometry_msgs/PoseStamped pose\nstd_msgs/String[] names")
    code = """
import geometry_msgs, std_msgs.msg
from robot.msg import Goal
assert "generated" not in Goal.__module__ and hasattr(geometry_msgs, "__file__")
goal = Goal(names=[std_msgs.msg.String("a")])
print(Goal._from_bytes(b"".join(goal._to_buffers())) == goal, type(goal.pose).__mro__[1].__name__)
"""
    environment = {**ENVIRONMENT, "PYTHONPATH": str(generated), "ROS_PACKAGE_PATH": str(package.parent)}
    assert shown([sys.executable], code, environment) == "True Message"


def test_a_devel_space_of_genuine_catkin_serves_pipros(catkin_workspace: CatkinWorkspace) -> None:
    generated = catkin_workspace.folder / "devel" / "lib" / "python3" / "dist-packages"
    code = """
from composiv_tryouts.msg import BatteryLevel
from pipros.msg import load_message_class
print(BatteryLevel.__base__.__name__, load_message_class("composiv_tryouts/BatteryLevel") is BatteryLevel)
print(__import__("composiv_tryouts").__file__, BatteryLevel._from_bytes(BatteryLevel("25")._to_buffers()[0]))
"""
    said = shown([sys.executable], code, {**ENVIRONMENT, "PYTHONPATH": str(generated)})
    assert said.splitlines() == ["Message True", f'{generated}/composiv_tryouts/__init__.py battery: "25"']


MAKE = """
import genpy, pickle, sys
from geometry_msgs.msg import PoseStamped
from std_msgs.msg import Header
message = PoseStamped(header=Header(3, genpy.Time(1, 2), "map"))
print(pickle.dumps([message, genpy.Time(4), genpy.Duration(-5)]).hex())
"""
SHOW = "import pickle; print(pickle.loads(bytes.fromhex('{}')))"


@pytest.mark.parametrize("is_from_genuine", [True, False])
def test_pickles_are_loaded_in_other_processes(is_from_genuine: bool) -> None:
    sides = [(["/usr/bin/python3"], {"PATH": "/usr/bin:/bin"}), ([sys.executable], ENVIRONMENT)]
    maker, reader = sides if is_from_genuine else sides[::-1]

    pickled = shown(*maker[:1], MAKE, maker[1])

    said = shown(*reader[:1], SHOW.format(pickled), reader[1])
    assert "seq: 3" in said
    assert said.endswith("genpy.Time[4000000000], genpy.Duration[-5000000000]]")


def shown(command: list[str], code: str, environment: dict[str, str]) -> str:
    return printed(*command, "-c", code, environment=environment).strip()
