"""Transforms of both sides: the same results for the same queries, on one graph, and by the same programs."""

import re
from pathlib import Path
from typing import Any

import pytest

from tests.interop.programs.examine_buffer import __file__ as buffer_script
from tests.interop.programs.examine_geometry import __file__ as geometry_script
from tests.support.ros import RosSystem, Side
from tests.support.same_results import both_results, different_pairs

PROGRAMS = Path(__file__).parent / "programs"


def differing(script: str, seed: int, count: int) -> list[tuple[Any, Any]]:
    genuine, ours = both_results(script, seed, count)
    assert len(genuine) >= count
    return different_pairs(genuine, ours)


@pytest.mark.parametrize("seed", [1, 2])
def test_ten_thousand_questions_have_the_same_answers(seed: int) -> None:
    assert differing(buffer_script, seed, 50) == []


def test_invalid_frames_have_the_same_answers() -> None:
    assert differing(str(PROGRAMS / "examine_bad_frames.py"), 1, 400) == []


def test_messages_are_transformed_alike() -> None:
    assert differing(geometry_script, 1, 50) == []


@pytest.mark.parametrize(
    ("sender", "asker"), [("pipros", "genuine"), ("genuine", "pipros"), ("pipros", "pipros")]
)
def test_nodes_of_both_sides_exchange_frames(plain_ros: RosSystem, sender: str, asker: str) -> None:
    plain_ros.serve_master()
    sides = {"pipros": plain_ros.pipros, "genuine": plain_ros.genuine}
    sending = sides[sender].start("python3", PROGRAMS / "send_frames.py")

    ended = sides[asker].run("python3", PROGRAMS / "ask_frames.py", timeout_s=90)
    sending.press_ctrl_c()

    assert ended.stdout == [
        "1.0 2.0 3.0 1.0", "True 3.0", "0.0",
        '"nowhere" passed to lookupTransform argument source_frame does not exist. ', "[1.0, 2.0, 3.0]",
        "[('arm', 'base', '/sender'), ('base', 'map', '/sender'), ('hand', 'arm', '/sender')]",
    ], ended.output  # fmt: skip


# The programs of tf and tf2_ros, and buffer servers and clients, together with genuine ones.
FIXED = ["1", "2", "3", "0", "0", "1", "0", "map", "hand"]
NUMBERS = ["1", "2", "3", "0.5", "0.25", "-0.125", "map", "hand"]
PAIRS = [("pipros", "genuine"), ("genuine", "pipros"), ("pipros", "pipros")]


def program(side: str, package: str, name: str) -> list[str]:
    """The command line of a program.

    Debian's package of tf has no package.xml, so that its rosrun does not find it.
    """
    return ["rosrun", package, name] if side == "pipros" else [f"/usr/lib/{package}/{name}"]


@pytest.fixture
def sides(plain_ros: RosSystem) -> dict[str, Side]:
    plain_ros.serve_master()
    return {"pipros": plain_ros.pipros, "genuine": plain_ros.genuine}


@pytest.mark.parametrize(("server", "client"), PAIRS)
def test_a_buffer_client_looks_up_transforms(sides: dict[str, Side], server: str, client: str) -> None:
    started = [
        sides["pipros"].start(
            "rosrun", "tf2_ros", "static_transform_publisher",
            *["1", "2", "3", "0", "0", "1", "0", "map", "hand"],
        ),
        sides[server].start(*program(server, "tf2_ros", "buffer_server")),
    ]  # fmt: skip

    ended = sides[client].run("python3", PROGRAMS / "ask_buffer_server.py", timeout_s=90)
    for process in started:
        process.press_ctrl_c()

    assert ended.stdout == [
        "True",
        "map hand 1.0 1.0",
        "1.0 True",
        'LookupException "nowhere" passed to lookupTransform argument source_frame does not exist. ',
        'InvalidArgumentException Invalid argument "/hand" passed to lookupTransform argument source_frame '
        "in "
        "tf2 frame_ids cannot start with a '/' like: ",
        "InvalidArgumentException Invalid argument passed to lookupTransform argument source_frame in tf2 "
        "frame_ids cannot be empty",
    ], ended.output


@pytest.mark.parametrize("package", ["tf", "tf2_ros"])
@pytest.mark.parametrize(("sender", "listener"), PAIRS)
def test_a_published_frame_is_echoed(sides, package: str, sender: str, listener: str) -> None:
    more = ["20"] if package == "tf" else []
    sending = sides[sender].start(*program(sender, package, "static_transform_publisher"), *NUMBERS, *more)
    echo = sides[listener].start(*program(listener, "tf", "tf_echo"), "map", "hand", "20")

    echo.wait_for(r"At time", 60)
    echo.wait_for(r"RPY \(degree\)")
    for process in (echo, sending):
        process.press_ctrl_c()
        process.wait()

    assert "- Translation: [1.000, 2.000, 3.000]" in echo.stdout
    assert "- Rotation: in Quaternion [-0.091, 0.105, 0.253, 0.958]" in echo.stdout, echo.output
    assert "            in RPY (degree) [-7.162, 14.324, 28.648]" in echo.stdout


@pytest.mark.parametrize("package", ["tf", "tf2_ros"])
@pytest.mark.parametrize("arguments", ["1 2 3", "1 2 3 0 0 0 a"])
def test_wrong_arguments_end_alike(sides: dict[str, Side], package: str, arguments: str) -> None:
    codes = {
        name: side.run(*program(name, package, "static_transform_publisher"), *arguments.split()).returncode
        for name, side in sides.items()
    }

    assert codes["pipros"] == codes["genuine"] != 0


def test_both_sides_monitor_remap_and_echo_alike(sides: dict[str, Side]) -> None:
    """Numbers differ, and the genuine monitor does not name publishers; everything else is the same."""
    for name in ("genuine", "pipros"):
        sides[name].start(
            *program(name, "tf", "static_transform_publisher"),
            *["1", "2", "3", "0", "0", "0", "map", name, "20"], "/tf:=/tf_old",
        )  # fmt: skip
        sides[name].start(
            *program(name, "tf", "tf_remap"),
            f"_mappings:=[{{old: {name}, new: {name}_hand}}, {{old: map, new: earth}}]",
            f"__name:={name}_remapper",
        )
    shown = {}
    for name, side in sides.items():
        monitor = side.start(*program(name, "tf", "tf_monitor"), "earth", "pipros_hand")
        echo = side.start(
            *program(name, "tf2_tools", "echo.py"), "earth", "genuine_hand", "-l", "4000", "-r", "20"
        )
        monitor.wait_for("All Broadcasters", 60)
        monitor.wait_for("^Node: .* Hz, Average Delay: .* Max Delay: ", 60)
        echo.wait_for("RPY .degree.", 60)
        for process in (monitor, echo):
            process.press_ctrl_c()
        everything = side.start(*program(name, "tf", "tf_monitor"))
        everything.wait_for("^Frame: genuine_hand published by .* Average Delay: ", 60)
        everything.press_ctrl_c()
        lines = [
            re.sub(r"-?[0-9][-+0-9.e]*|/?\w+_(remapper|publisher)", "N", line) for line in monitor.stdout
        ]
        start = next(number for number, line in enumerate(lines) if line.startswith("RESULTS"))
        end = next(number for number, line in enumerate(lines) if line.startswith("Node: "))
        spoken = [re.sub(r"[0-9.]{9,}", "N", line) for line in echo.stdout]
        first = next(number for number, line in enumerate(spoken) if line.startswith("At time"))
        told = [line for line in lines[start : end + 1] if line not in ("", "All Broadcasters:")]  # on stderr
        shown[name] = (lines[0].strip(), told, spoken[first : first + 5])

    assert shown["pipros"] == shown["genuine"]
    assert "Chain is: earth -> pipros_hand" in shown["pipros"][1]
    ended = {
        name: [
            side.run(*program(name, "tf", "tf_monitor"), "a").returncode,
            side.run(*program(name, "tf2_tools", "echo.py"), "a").returncode,
            side.run(*program(name, "tf2_tools", "echo.py"), "a", "b", "-l", "2", "-r", "20").returncode,
            side.run(*program(name, *["robot_state_publisher"] * 2)).returncode,  # without a description
        ]
        for name, side in sides.items()
    }
    assert ended["pipros"] == ended["genuine"] == [255, 2, 0, 1]


def test_the_tree_is_drawn(sides: dict[str, Side], plain_ros: RosSystem) -> None:
    ours = sides["pipros"]
    ours.start(*program("pipros", "tf", "static_transform_publisher"), *NUMBERS, "20")
    plain_ros.wait_for_publisher("/tf", 60)  # it listens for five seconds

    ended = ours.run(*program("pipros", "tf", "view_frames"), timeout_s=100)

    assert [line for line in ended.stdout if "generated" in line] == [
        "frames.gv generated", "frames.svg generated", "frames.pdf generated",
    ]  # fmt: skip
    assert '"map" -> "hand"' in (plain_ros.home / "frames.gv").read_text()
    assert ">hand</text>" in (plain_ros.home / "frames.svg").read_text()
    assert (plain_ros.home / "frames.pdf").read_bytes().startswith(b"%PDF")


def test_both_sides_report_the_same_changes(sides: dict[str, Side]) -> None:
    sides["pipros"].run(
        "rosparam", "set", "/notifier/frame_pairs", "[{source_frame: hand, target_frame: odom}]"
    )
    told = {}
    for side in ("genuine", "pipros"):
        notifier = sides[side].start(*program(side, "tf", "tf_change_notifier"), "__name:=notifier")
        told[side] = sides["pipros"].run("python3", PROGRAMS / "move_frame.py", timeout_s=90).stdout
        notifier.end()
    assert told["pipros"] == told["genuine"]
    assert len(told["pipros"]) == 8
    assert [line.endswith("None") for line in told["pipros"][:5]] == [False, True, False, True, False]


def test_a_wrong_pair_of_frames_is_named(sides: dict[str, Side]) -> None:
    sides["pipros"].run("rosparam", "set", "/notifier/frame_pairs", "[{source_frame: hand}]")
    ended = sides["pipros"].run("rosrun", "tf", "tf_change_notifier", "__name:=notifier")
    assert (ended.returncode, "target_frame of a frame pair" in ended.output) == (1, True)
