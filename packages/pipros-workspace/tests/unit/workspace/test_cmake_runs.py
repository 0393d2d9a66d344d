from __future__ import annotations

from pathlib import Path

import pytest

from pipros_workspace.cmake_runs import NativeBuildFailed, configure, make_all

PRINTS = "#!/bin/sh\ncat <<'END'\n{text}\nEND\nexit 1\n"
PROCESSING = "-- +++ processing catkin package: '{name}'\n"


def script(path: Path, content: str) -> Path:
    path.write_text(content)
    path.chmod(0o755)
    return path


@pytest.mark.needs("first lines")
@pytest.mark.parametrize(("printed", "failed"), [
    ("CMake Error at b/CMakeLists.txt:4 (find_package):\n  No x.\n\n  More.", {"b": ["No x."]}),
    ("CMake Error at /usr/share/catkin/cmake/all.cmake:8 (message):\n  No y.", {"a": ["No y."]}),
    ("-- Configuring done\nCMake Error in b/CMakeLists.txt:\n  No z.\n", {"b": ["No z."]}),
    (
        "CMake Error at a/CMakeLists.txt:1 (f):\n  one\n\nCMake Error at a/CMakeLists.txt:2 (f):\n  two\n"
        + PROCESSING.format(name="b")
        + "CMake Error at /x.cmake:1 (message):\n  three\n",
        {"a": ["one"], "b": ["three"]},
    ),
])  # fmt: skip
def test_the_rejected_packages_are_found_with_the_reason(
    tmp_path: Path, printed: str, failed: dict[str, list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    text = PROCESSING.format(name="b") + PROCESSING.format(name="a") + printed
    cmake = script(tmp_path / "cmake", PRINTS.format(text=text))

    found = configure([str(cmake)], tmp_path, {}, {name: tmp_path / name for name in ("a", "b")})

    reasons = {name: [line.strip() for line in reason.splitlines()[1:]] for name, reason in found.items()}
    assert reasons == failed
    assert printed in capsys.readouterr().out


@pytest.mark.needs("first lines")
@pytest.mark.parametrize("printed", [
    'CMake Error: Cannot determine link language for target "b_node".',
    "CMake Error: CMake can not determine linker language for target: b_node",
    'CMake Error: Variables are set to NOTFOUND:\nX\n    linked by target "b_node" in directory /b',
    'CMake Error: Cannot determine link language for target "main".',
])  # fmt: skip
def test_a_target_that_cannot_be_generated_rejects_the_package_that_adds_it(
    tmp_path: Path, printed: str
) -> None:
    folders = {name: tmp_path / name for name in ("a", "b")}
    for name, folder in folders.items():
        folder.mkdir()
        (folder / "CMakeLists.txt").write_text(
            f"add_executable(${{PROJECT_NAME}}_node {name}.py)\nadd_library( main_{name}\n  x.cpp)\n"
        )
    with (folders["b"] / "CMakeLists.txt").open("a") as file:
        file.write("ADD_EXECUTABLE(main main.py)\n")
    text = f"-- Configuring done\n{printed}\n-- Generating done"
    cmake = script(tmp_path / "cmake", PRINTS.format(text=text))

    (name,) = found = configure([str(cmake)], tmp_path, {}, folders)

    assert name == "b"
    assert found[name].strip() in printed


@pytest.mark.needs("first lines")
@pytest.mark.parametrize("printed", ["", "CMake Error at CMakeLists.txt:4 (cmake_minimum_required):\n  Old."])
def test_a_failure_without_a_culprit_is_an_error(tmp_path: Path, printed: str) -> None:
    cmake = script(tmp_path / "cmake", PRINTS.format(text=printed))
    with pytest.raises(NativeBuildFailed, match=r"cmake\" failed; the reason is printed above"):
        configure([str(cmake)], tmp_path, {}, {"a": tmp_path / "a"})


def test_incomplete_packages_are_named_with_the_compilers_error(tmp_path: Path) -> None:
    bin_folder = tmp_path / "bin"
    bin_folder.mkdir()
    script(
        bin_folder / "make",
        "#!/bin/sh\ncase $PWD in */good) exit 0 ;; esac\necho 'a.cpp:1:1: error: no'\nexit 2\n",
    )
    for name in ("good", "bad"):
        (tmp_path / name).mkdir()
    variables = {"PATH": f"{bin_folder}:/bin"}

    assert make_all(["-j1"], tmp_path, variables, ["good", "bad"]) == {"bad": "a.cpp:1:1: error: no"}
    with pytest.raises(NativeBuildFailed):
        make_all(["-j1"], tmp_path, variables, ["good"])
