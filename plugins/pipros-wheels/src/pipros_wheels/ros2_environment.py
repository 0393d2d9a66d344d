"""The environment in which messages for rclpy are built: ROS 2's generators from PyPI, and a compiler."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from pipros.basics.errors import PiprosError
from pipros.packages import cache_folder
from pipros_wheels.installer import InstallFailed, find_installer

LIBRARIES = (
    "rosidl_generator_c",
    "rosidl_typesupport_fastrtps_c",
    "rosidl_typesupport_introspection_c",
    "rosidl_typesupport_c",
    "rosidl_generator_py",
)
"""The kinds of libraries of a package of messages. Each needs those before it; rclpy needs all."""
GENERATORS = (
    *LIBRARIES,
    *("rosidl_adapter", "rosidl_cli", "rosidl_generator_cpp", "rosidl_generator_type_description"),
)
_RUNTIME = (
    *("rosidl_runtime_c", "rosidl_typesupport_c", "rosidl_typesupport_fastrtps_c"),
    *("rosidl_typesupport_fastrtps_cpp", "rosidl_typesupport_introspection_c", "fastcdr", "rcutils"),
)
_MODULES = ("numpy", "pyyaml")
"""What the generators need, but do not require."""
_SAID_CHARACTERS = 3000
_ADVICE = "on Debian and Ubuntu: apt-get install g++ python3-dev"
_QUESTION = (
    "import sysconfig, numpy; print(sysconfig.get_path('include'), numpy.get_include(), "
    "sysconfig.get_path('purelib'), sep='\\n')"
)


class BuildFailed(PiprosError):
    """A compiler or a generator of ROS 2 is missing, or failed."""


def find_compilers() -> list[str]:
    """Return the compilers of C and C++: those named by CC and CXX, or found in PATH.

    Raises:
        BuildFailed: there is none.
    """
    found = [
        next(filter(None, map(shutil.which, filter(None, (os.environ.get(variable), *names)))), "")
        for variable, names in (("CC", ("cc", "gcc", "clang")), ("CXX", ("c++", "g++", "clang++")))
    ]
    if not all(found):
        raise BuildFailed(f"messages for rclpy need a C and a C++ compiler; {_ADVICE}")
    return found


class BuildEnvironment:
    """A virtual environment in the cache, for a distribution and the running version of Python."""

    def __init__(self, distribution: str) -> None:
        self.distribution = distribution
        self.folder = Path(cache_folder(f"ros2_{distribution}_{sys.implementation.cache_tag}"))
        self.python = self.folder / "bin" / "python"

    def require(self, packages: Iterable[str]) -> None:
        """Install the packages of ROS 2 that are missing. Blocks; the output of pip or uv is not captured.

        Raises:
            InstallFailed, NoInstaller: they cannot be installed.
        """
        index = self.folder / "share" / "ament_index" / "resource_index" / "packages"
        missing = sorted(name for name in packages if not (index / name).exists())
        if not missing:
            return
        command = find_installer()
        if not self.python.exists():
            subprocess.run([sys.executable, "-m", "venv", "--without-pip", self.folder], check=True)  # noqa: S603
        python = ("--python", str(self.python))
        if command[1:] == ("pip",):  # uv
            words = [*command, "install", *python]
        else:
            words = [*command[: 3 if command[1] == "-m" else 1], *python, "install"]
        names = [f"ros-{self.distribution}-{name.replace('_', '-')}" for name in missing]
        if subprocess.run([*words, "--quiet", *_MODULES, *names], check=False).returncode:  # noqa: S603
            raise InstallFailed(f"cannot install {', '.join(names)} in {self.folder}")

    def generate(self, package: str, share: Path, output: Path) -> None:
        """Run ROS 2's generators; see `rosidl_driver`. Raises `BuildFailed`."""
        driver = Path(__file__).with_name("rosidl_driver.py")
        words = (self.python, driver, package, share, self.folder / "share", output)
        _run(words, AMENT_PREFIX_PATH=str(self.folder))

    def compile(self, package: str, work: Path, prefix: Path, needs: Iterable[str]) -> None:
        """Compile what `generate` wrote: libraries to `prefix/lib`, and the extension module beside its code.

        Args:
            prefix: where the libraries and headers of packages are that were built before.
            needs: the packages with which the libraries are linked.

        Raises:
            BuildFailed: a compiler is missing or fails.
        """
        c, cpp = find_compilers()
        python, numpy, site = _run([self.python, "-c", _QUESTION]).splitlines()
        if not Path(python, "Python.h").exists():
            raise BuildFailed(f"messages for rclpy need the headers of Python ({python}/Python.h); {_ADVICE}")
        roots = (prefix, self.folder)
        headers = [*(work / name for name in LIBRARIES), self.folder / "include"]
        headers += [each for root in roots for each in root.glob("include/*/")]
        flags = ["-O1", "-fPIC", *(f"-I{each}" for each in (*headers, python, numpy))]
        sources = [file for name in LIBRARIES for file in (work / name).rglob("*.c*")]

        def build(source: Path) -> None:
            words = [c] if source.suffix == ".c" else [cpp, "-std=c++17"]
            _run([*words, *flags, "-c", source, "-o", f"{source}.o"])

        with ThreadPoolExecutor(os.cpu_count()) as executor:
            list(executor.map(build, sources))
        (prefix / "lib").mkdir(exist_ok=True)
        found = (
            root / "lib" / f"lib{need}__{name}.so" for root in roots for need in needs for name in LIBRARIES
        )
        linked = [f"-L{root / 'lib'}" for root in roots]
        linked += [f"-l{file.stem.removeprefix('lib')}" for file in found if file.exists()]
        linked += [f"-l{name}" for name in _RUNTIME]
        for name in LIBRARIES:
            parts = [
                f"{file}.o"
                for file in sources
                if file.is_relative_to(work / name) and ".ep." not in file.name
            ]
            target = prefix / "lib" / f"lib{package}__{name}.so"
            _run([cpp, "-shared", "-Wl,-rpath,$ORIGIN", "-o", target, *parts, *linked])
            linked.insert(0, f"-l{package}__{name}")
        module = work / "rosidl_generator_py" / package / f"{package}_s__rosidl_typesupport_c.so"
        depth = len(Path(site, package).relative_to(self.folder).parts)
        entry = [f"{file}.o" for file in sources if ".ep." in file.name]
        rpath = f"-Wl,-rpath,$ORIGIN/{'../' * depth}lib"
        _run([cpp, "-shared", rpath, "-o", module, *entry, *linked])


def _run(words: Sequence[str | Path], **variables: str) -> str:
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    ended = subprocess.run(  # noqa: S603
        words, env=environment | variables, capture_output=True, text=True, check=False
    )
    if ended.returncode:
        said = (ended.stdout + ended.stderr).rstrip()[-_SAID_CHARACTERS:]
        raise BuildFailed(f"{Path(words[0]).name} failed:\n{said}")
    return ended.stdout
