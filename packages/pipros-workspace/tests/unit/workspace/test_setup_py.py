from pathlib import Path

import pytest

from pipros_workspace.setup_py import SetupPyError, read_setup_py
from tests.support.workspaces import hide_setuptools


def write(folder: Path, text: str, *packages: str) -> str:
    for package in packages:
        (folder / package).mkdir(parents=True)
        (folder / package / "__init__.py").touch()
    (folder / "setup.py").write_text(text)
    return str(folder)


@pytest.mark.parametrize(("text", "packages"), [
    ("from setuptools import setup\nsetup(packages=['a'])", {"a": "a"}),
    ("from distutils.core import setup\nsetup(packages=['a'], package_dir={'': 'src'})", {"a": "src/a"}),
    ("import setuptools\nsetuptools.setup(packages=['a', 'a.b'], package_dir={'a': 'x'})",
     {"a": "x", "a.b": "x/b"}),
    ("from setuptools import setup\nsetup(packages=['a.b'], package_dir={'': 'src/'})",
     {"a.b": "src/a/b"}),
    ("from setuptools import setup, find_packages\n"
     "setup(packages=find_packages('src'), package_dir={'': 'src'})",
     {"found": "src/found"}),
    ("from setuptools import setup\nsetup()", {}),
    ("print('talks')\nfrom setuptools import setup\nsetup(packages=['a'])\nprint('a lot')", {"a": "a"}),
])  # fmt: skip
def test_packages_are_in_the_folders_of_the_setup(
    tmp_path: Path, text: str, packages: dict[str, str]
) -> None:
    folder = write(tmp_path, text, "src/found")
    setup = read_setup_py(folder)
    assert setup.packages == {name: str(tmp_path / path) for name, path in packages.items()}
    assert setup.scripts == []


FIND = "setup(packages=find_packages('src', exclude=['*.test']), package_dir={'': 'src'})"


def test_packages_are_found_without_setuptools(tmp_path: Path) -> None:
    folder = write(
        tmp_path, f"from setuptools import setup, find_packages\n{FIND}", "src/a/b", "src/a/test", "src/c/d"
    )
    (tmp_path / "src/a/__init__.py").touch()
    with_setuptools = read_setup_py(folder).packages
    lacking = "import sys\nsys.modules['setuptools'] = None\n"
    (tmp_path / "sitecustomize.py").write_text(lacking)

    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("PYTHONPATH", str(tmp_path))
        found = read_setup_py(folder).packages

    assert (set(found), found) == ({"a", "a.b"}, with_setuptools)


def test_scripts_are_absolute(tmp_path: Path) -> None:
    folder = write(tmp_path, "from distutils.core import setup\nsetup(scripts=['scripts/a', 'b'])")
    assert read_setup_py(folder).scripts == [str(tmp_path / "scripts/a"), str(tmp_path / "b")]


def test_catkin_pkg_reads_the_manifest(tmp_path: Path) -> None:
    (tmp_path / "package.xml").write_text(
        '<package format="2"><name>p</name><version>1.2.3</version><description>d</description>'
        '<maintainer email="a@example.org">A</maintainer><license>x</license></package>'
    )
    text = (
        "from setuptools import setup\nfrom catkin_pkg.python_setup import generate_distutils_setup\n"
        "setup(**generate_distutils_setup(packages=['p'], package_dir={'': 'src'}))\n"
    )
    assert read_setup_py(write(tmp_path, text)).packages == {"p": str(tmp_path / "src/p")}


def test_a_setup_reads_the_variables_of_noetic_in_a_bare_shell(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("ROS_DISTRO", "ROS_PYTHON_VERSION"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("ROS_VERSION", "one")  # of the shell, which takes precedence
    text = (
        "import os\nfrom setuptools import setup\n"
        "setup(packages=[os.environ['ROS_' + name] for name in ('VERSION', 'DISTRO', 'PYTHON_VERSION')])"
    )
    assert set(read_setup_py(write(tmp_path, text)).packages) == {"one", "noetic", "3"}


@pytest.mark.parametrize(("text", "reason"), [
    ("raise RuntimeError('no way')", "no way"), ("def", "SyntaxError"),
    ("import sys\nsys.exit(3)", "it ended with exit status 3"),
])  # fmt: skip
def test_a_setup_that_fails_is_quoted(tmp_path: Path, text: str, reason: str) -> None:
    with pytest.raises(SetupPyError, match=r"setup\.py failed") as error:
        read_setup_py(write(tmp_path, text))
    assert reason in str(error.value)


def test_a_setup_without_an_end_is_ended(tmp_path: Path) -> None:
    with pytest.raises(SetupPyError, match="did not finish within"):
        read_setup_py(write(tmp_path, "import threading\nthreading.Event().wait()"), limit_s=0.2)


@pytest.mark.parametrize(("text", "packages"), [
    ("from setuptools import find_namespace_packages, setup\n"
     "setup(packages=find_namespace_packages('src'), package_dir={'': 'src'})",
     {"found": "src/found"}),
    ("from setuptools import Command, setup\nfrom setuptools.command.install import install\n"
     "class Mine(install): pass\nsetup(packages=['found'], cmdclass={'install': Mine})",
     {"found": "found"}),
    ("from pathlib import Path\nfrom setuptools import setup\n"
     "setup(packages=('found',), package_dir={'': Path('src')})", {"found": "src/found"}),
    ("from distutils.core import setup\nfrom distutils.util import convert_path\n"
     "setup(packages={'found': 1}.keys(), package_dir={'': convert_path('src')})",
     {"found": "src/found"}),
])  # fmt: skip
def test_a_setup_may_use_all_of_setuptools(tmp_path: Path, text: str, packages: dict[str, str]) -> None:
    setup = read_setup_py(write(tmp_path, text, "src/found"))
    assert setup.packages == {name: str(tmp_path / path) for name, path in packages.items()}


def test_modules_data_files_and_entry_points_are_read(tmp_path: Path) -> None:
    setup = read_setup_py(
        write(
            tmp_path,
            "from setuptools import setup\nsetup(packages=['a'], py_modules=['lone', 'a.inside'],"
            " package_dir={'': 'src'}, data_files=[('share/p', ['x.txt', 'y/z.txt']), 'top.txt'],"
            " entry_points={'console_scripts': ['arm = a.cli:main', 'bad']})",
        )
    )
    assert setup.modules == {"lone": f"{tmp_path}/src/lone.py"}
    assert [(target, path.removeprefix(f"{tmp_path}/")) for target, path in setup.data_files] == [
        *(("share/p", "x.txt"), ("share/p", "y/z.txt"), ("", "top.txt"))
    ]
    assert setup.entry_points == {"arm": "a.cli:main"}
    assert setup.left_out == [
        "setup.py: the entry point [bad] is left out; it must be NAME = MODULE:FUNCTION"
    ]


@pytest.mark.parametrize("declared", [
    {"console_scripts": ["arm = a.cli:main", "leg=a.leg:Leg.main [fast]"], "other": ["x = a:b"]},
    {
        "console_scripts": "\n  arm = a.cli:main\n# a comment\n\n leg=a.leg:Leg.main [fast]",
        "other": "x = a:b",
    },
    {
        "console_scripts": ("arm = a.cli:main",),
        "gui_scripts": "leg = a.leg:Leg.main",
        "other": ["x = a:b"],
    },
    "[console_scripts]\narm = a.cli:main\n\n[ gui_scripts ]\n  leg = a.leg:Leg.main\n[other]\nx = a:b\n",
])  # fmt: skip
def test_entry_points_are_read_in_all_forms_of_setuptools(
    tmp_path: Path, declared: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    hide_setuptools(tmp_path, monkeypatch)
    text = f"from setuptools import setup\nsetup(packages=['a'], entry_points={declared!r})"
    setup = read_setup_py(write(tmp_path, text))
    assert setup.entry_points == {"arm": "a.cli:main", "leg": "a.leg:Leg.main"}
    assert setup.left_out == ["setup.py: the entry point [x = a:b] is left out, because it is in [other]"]


@pytest.mark.parametrize(("file", "content"), [
    ("setup.cfg", "[metadata]\nname = p\n[options]\npackages = find:\n"),
    ("pyproject.toml", '[tool.setuptools]\npackages = ["p"]\n'),
    ("pyproject.toml", '[tool.setuptools.packages.find]\nwhere = ["src"]\n'),
])  # fmt: skip
def test_packages_that_only_another_file_names_are_not_lost_in_silence(
    tmp_path: Path, file: str, content: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    hide_setuptools(tmp_path, monkeypatch)
    (tmp_path / file).write_text(content)
    folder = write(tmp_path, "from setuptools import setup\nsetup()")
    with pytest.raises(
        SetupPyError, match=rf"passes no packages to setup\(\), and catkin does not read {file}"
    ):
        read_setup_py(folder)
    write(tmp_path, "from setuptools import setup\nsetup(packages=['p'])")
    assert list(read_setup_py(folder).packages) == ["p"]


def test_a_subpackage_outside_of_its_parent_is_refused(tmp_path: Path) -> None:
    text = "from setuptools import setup\nsetup(packages=['a', 'a.b'], package_dir={'a': 'x', 'a.b': 'y'})"
    with pytest.raises(
        SetupPyError, match=r"package_dir has a.b in .*/y, but .* inside of its parent: .*/x/b"
    ):
        read_setup_py(write(tmp_path, text))
