"""Python modules that a `setup.py` names, found without running it."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipros.packages.setup_modules import SetupModules, declared_module

HEAD = (
    "from setuptools import setup, find_packages\n"
    "from catkin_pkg.python_setup import generate_distutils_setup\n"
)


def package(folder: Path, setup: str, *files: str) -> Path:
    for file in files:
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).touch()
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "setup.py").write_text(setup)
    return folder


@pytest.mark.parametrize(
    ("setup", "file"),
    [
        ("setup(packages=['lib'], package_dir={'': 'src'})", "src/lib"),
        ("setup(packages=['lib'], package_dir={'': 'python'})", "python/lib"),
        ("setup(packages=['lib'], package_dir={'lib': 'include/lib'})", "include/lib"),
        ("setup(packages=['lib', 'lib.sub'], package_dir={'lib': 'somewhere', 'lib.sub': 'x'})", "somewhere"),
        ("setup(packages=['lib'])", "lib"),
        ("setup(packages=('lib',), package_dir={'': './src/'})", "src/lib"),
        ("d = generate_distutils_setup(packages=['lib'], package_dir={'': 'src'})\nsetup(**d)", "src/lib"),
        ("setup(**generate_distutils_setup(packages=['lib'], package_dir={'': 'src'}))", "src/lib"),
        ("setup(packages=find_packages('src'), package_dir={'': 'src'})", "src/lib"),
        (
            "d = generate_distutils_setup()\nd['packages'] = ['robot', 'lib']\n"
            "d['package_dir'] = {'': 'src'}\nsetup(**d)",
            "src/lib",
        ),
        ("d = {}\nd['py_modules'] = ['lib']\nd['package_dir'] = {'': 'src'}\nsetup(**d)", "src/lib.py"),
        ("d = {'packages': ['lib'], 'package_dir': {'lib': 'python'}}\nsetup(**d)", "python"),
        ("setup(name='x', py_modules=['lib'], package_dir={'': 'src'})", "src/lib.py"),
        ("if True:\n    setup(packages=['lib'], package_dir=dict())", "lib"),
    ],
)
def test_a_module_is_in_the_folder_of_its_setup(tmp_path: Path, setup: str, file: str) -> None:
    folder = package(tmp_path / "p", HEAD + setup, file if file.endswith(".py") else f"{file}/__init__.py")
    assert declared_module((HEAD + setup).encode(), str(folder), "lib") == str(folder / file)
    assert SetupModules().find("lib", [str(tmp_path / "nothing"), str(folder)]) == str(folder / file)


@pytest.mark.parametrize(
    "setup",
    [
        "setup(packages=['other'], package_dir={'': 'src'})",
        "setup(packages=['lib'], package_dir={'': 'nowhere'})",
        "setup(py_modules=['lib'])",
        "setup(name='lib')",
        "setup(packages=['lib'",
        "lib = '\\d'\n\0",
        "",
    ],
)
def test_unnamed_and_missing_modules_are_not_found(tmp_path: Path, setup: str) -> None:
    folder = package(tmp_path / "p", setup, "src/lib/__init__.py")
    assert SetupModules().find("lib", [str(folder)]) is None


def test_a_setup_is_never_run(tmp_path: Path) -> None:
    mark = tmp_path / "mark"
    folder = package(tmp_path / "p", f"open({str(mark)!r}, 'w')\nsetup(packages=['lib'])", "lib/__init__.py")
    assert SetupModules().find("lib", [str(folder)]) == str(folder / "lib")
    assert not mark.exists()


def test_the_first_package_that_has_the_module_wins(tmp_path: Path) -> None:
    setup = "setup(packages=['lib'])"
    folders = [package(tmp_path / name, setup, "lib/__init__.py") for name in ("b", "a")]
    assert SetupModules().find("lib", map(str, folders)) == str(tmp_path / "b" / "lib")


def test_a_setup_py_that_is_not_a_file_or_too_long_is_left_out(tmp_path: Path) -> None:
    (tmp_path / "folder" / "setup.py").mkdir(parents=True)
    long = package(tmp_path / "long", "setup(packages=['lib'])" + "#" * 300_000, "lib/__init__.py")
    assert SetupModules().find("lib", [str(tmp_path / "folder"), str(long)]) is None
