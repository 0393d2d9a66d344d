"""The command `rosgraph` compared with the genuine one, and the executables of genuine packages with ours."""

from __future__ import annotations

import pytest

from tests.support.answers import ask
from tests.support.ros import RosSystem


@pytest.mark.parametrize("arguments", [[], ["-h"], ["--help"], ["-x"], ["one"]])
def test_without_a_master_and_with_arguments_it_says_the_same(ros: RosSystem, arguments: list[str]) -> None:
    ours, genuine = (ask(side, "rosgraph", *arguments) for side in (ros.pipros, ros.genuine))
    assert (ours.returncode, ours.stdout, ours.stderr) == (genuine.returncode, genuine.stdout, genuine.stderr)


@pytest.mark.parametrize("package", ["rostopic", "rosservice", "rosgraph"])
def test_tools_are_programs_of_their_packages(ros: RosSystem, package: str) -> None:
    ours, genuine = (
        ask(side, "rosrun", package, package, "--nonsense") for side in (ros.pipros, ros.genuine)
    )
    assert (ours.returncode, ours.output) == (genuine.returncode, genuine.output)


def test_the_package_roslaunch_has_the_launch_files_of_the_genuine_one(ros: RosSystem) -> None:
    for name in ("example.launch", "example-min.launch", "example-include.launch"):
        for side in (ros.pipros, ros.genuine):
            listed = ask(side, "roslaunch", "--files", "roslaunch", name)
            assert listed.returncode == 0, listed.output
            assert any(file.endswith(f"roslaunch/resources/{name}") for file in listed.stdout)


@pytest.mark.parametrize("arguments", [["example-args.launch", "who:=me"], ["example-min.launch"]])
def test_genuine_roslaunch_reads_our_examples_as_we_do(ros: RosSystem, arguments: list[str]) -> None:
    """The files without `$(find roslaunch)`, which is the genuine folder in genuine ROS."""
    folder = ros.pipros.run("rospack", "find", "roslaunch").stdout[0]
    file, *rest = arguments
    path = f"{folder}/resources/{file}"
    ours, genuine = (
        ask(side, "roslaunch", "--dump-params", path, *rest) for side in (ros.pipros, ros.genuine)
    )
    assert ours.returncode == genuine.returncode == 0, ours.output
    assert sorted(ours.stdout) == sorted(genuine.stdout)


@pytest.mark.parametrize(
    ("arguments", "parameters"),
    [
        (["example.launch"], 8),
        (["example-pass_all_args.launch", "who:=me"], 2),
        (["example-params.launch"], 9),
    ],
)
def test_the_other_examples_load(ros: RosSystem, arguments: list[str], parameters: int) -> None:
    dumped = ros.pipros.run("roslaunch", "--dump-params", "roslaunch", *arguments)
    assert dumped.returncode == 0, dumped.output
    assert len([line for line in dumped.stdout if line.startswith("/")]) >= parameters - 1
