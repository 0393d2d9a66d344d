"""`pipros install` with a hostile index: what the plan names is installed, and nothing else is asked for."""

import io
import os
import sys
import tarfile
import venv
import zipfile
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

from pipros.basics.errors import PiprosError
from pipros_wheels import backend, installer
from pipros_wheels.commands import install, rosdep
from pipros_wheels.init_file import BUILD_SYSTEM, write_build_system
from tests.support.workspaces import Workspace

USER = (
    "find_package(catkin REQUIRED COMPONENTS message_generation dep_msgs ghost_msgs)\n"
    "generate_messages(DEPENDENCIES dep_msgs ghost_msgs)\ncatkin_package()"
)


def add_wheel(folder: Path, name: str, version: str, *requires: str) -> Path:
    folder.mkdir(exist_ok=True)
    file = folder / f"{name}-{version}-py3-none-any.whl"
    info = f"{name}-{version}.dist-info"
    lines = [f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}"]
    lines += [f"Requires-Dist: {item}" for item in requires]
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr(f"{info}/METADATA", "\n".join(lines) + "\n")
        archive.writestr(f"{info}/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n")
        archive.writestr(f"{info}/RECORD", "")
    return file


class Index:
    """An index with a source archive of every name, which writes a file if its code is run."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir()
        self.folder = folder
        self.mark = folder / "was_run"
        self.asked: set[str] = set()
        index = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                index.answer(self)

            def log_message(self, *_arguments: object) -> None:
                """Print nothing."""

        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self.server.server_port}/simple/"

    def answer(self, request: BaseHTTPRequestHandler) -> None:
        name = request.path.strip("/").split("/")[-1]
        file = self.folder / name
        if request.path.endswith("/"):
            self.asked.add(name)
            files = [
                f"{name}-99.0.tar.gz",
                *(found.name for found in self.folder.glob(f"{name.replace('-', '_')}-*")),
            ]
            content = "".join(f'<a href="/{found}">{found}</a>' for found in files).encode()
        else:
            content = (
                file.read_bytes() if file.exists() else self.source_archive(name.removesuffix(".tar.gz"))
            )
        request.send_response(200)
        request.send_header("Content-Type", "text/html" if request.path.endswith("/") else "application/zip")
        request.send_header("Content-Length", str(len(content)))
        request.end_headers()
        request.wfile.write(content)

    def source_archive(self, name: str) -> bytes:
        project, _, version = name.rpartition("-")
        text = f"open({str(self.mark)!r}, 'w')\nfrom setuptools import setup\n"
        text += f"setup(name={project!r}, version={version!r})\n"
        made = io.BytesIO()
        with tarfile.open(fileobj=made, mode="w:gz") as archive:
            info = tarfile.TarInfo(f"{name}/setup.py")
            info.size = len(text)
            archive.addfile(info, io.BytesIO(text.encode()))
        return made.getvalue()


@pytest.fixture
def index(tmp_path: Path) -> Iterator[Index]:
    made = Index(tmp_path / "index")
    thread = Thread(target=made.server.serve_forever)
    thread.start()
    yield made
    made.server.shutdown()
    thread.join()
    made.server.server_close()


@pytest.fixture
def environment(tmp_path: Path, index: Index, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A new environment whose pip takes the hostile index for PyPI."""
    folder = tmp_path / "environment"
    venv.create(folder, with_pip=False, symlinks=True)
    words = (sys.executable, "-m", "pip", "--python", str(folder / "bin" / "python"))
    monkeypatch.setattr(installer, "find_installer", lambda _name="": words)
    for name in [name for name in os.environ if name.startswith(("PIP_", "UV_"))]:
        monkeypatch.delenv(name)
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    for name, value in {
        "CONFIG_FILE": os.devnull, "INDEX_URL": index.url, "NO_CACHE_DIR": "1", "RETRIES": "0",
        "DISABLE_PIP_VERSION_CHECK": "1",
    }.items():  # fmt: skip
        monkeypatch.setenv(f"PIP_{name}", value)
    return folder


def installed(environment: Path) -> set[str]:
    return {info.name.removesuffix(".dist-info") for info in environment.rglob("*.dist-info")}


def test_what_the_plan_names_is_installed_and_no_other_name_is_asked_of_the_index(
    environment: Path, index: Index, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    workspace = Workspace(tmp_path / "ws")
    workspace.add("user_pkg", USER, "dep_msgs ghost_msgs python3-serial my_key")
    folder = tmp_path / "wheels"
    add_wheel(folder, "ros1_dep_msgs", "1.0.0", "pipros", "ros1-base-msgs>=1.1", "ros1-lost-msgs")
    for version in ("1.0.0", "1.2.0"):
        add_wheel(folder, "ros1_base_msgs", version, "labtool")
    add_wheel(folder, "labtool", "2.0")
    (folder / "no wheel.whl").touch()
    (folder / "ros1_base_msgs-9.0-py3-none-any.whl").write_text("no zip file")
    keys = tmp_path / "keys.yaml"
    keys.write_text("my_key: labtool>=1\n")
    add_wheel(index.folder, "pyserial", "100.0")

    code = install.main(["-f", str(folder), "--keys", str(keys), str(workspace.base)])

    shown = capfd.readouterr()
    assert index.asked == {"pyserial"}
    assert installed(environment) == {
        *(
            "ros1_user_pkg-0.1.0", "ros1_dep_msgs-1.0.0", "ros1_base_msgs-1.2.0", "labtool-2.0",
            "pyserial-100.0",
        )
    }  # fmt: skip
    assert "dep_msgs        wheel in a folder  ros1-dep-msgs==1.0.0   user_pkg" in shown.out
    assert "Unknown, and not installed: ghost_msgs ros1-lost-msgs." in shown.out
    assert "user_pkg does not require ghost_msgs, because" in shown.out
    assert "ros1_base_msgs-9.0-py3-none-any.whl is not a wheel" in shown.err
    assert code == 1


def test_a_dry_run_with_an_index_runs_no_code_and_the_installation_takes_the_wheel(
    environment: Path, index: Index, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    workspace = Workspace(tmp_path / "ws")
    workspace.add("user_pkg", depends="far_msgs ghost_msgs")
    add_wheel(index.folder, "ros1_far_msgs", "1.0")
    words = ["--index-url", index.url, str(workspace.base)]
    assert install.main(["--dry-run", *words]) == 0
    shown = capfd.readouterr().out
    assert "far_msgs        wheel in an index  ros1-far-msgs  user_pkg" in shown
    assert "Unknown, and not installed: ghost_msgs." in shown  # of which the index has a source archive only
    assert installed(environment) == set()
    assert install.main(words) == 0
    assert installed(environment) == {"ros1_user_pkg-0.1.0", "ros1_far_msgs-1.0"}
    assert not index.mark.exists()


def test_rosdep_asks_for_projects_in_the_table_only(
    environment: Path, index: Index, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    workspace = Workspace(tmp_path / "ws")
    workspace.add("user_pkg", USER, "dep_msgs ghost_msgs python3-semver")
    add_wheel(index.folder, "semver", "100.0")
    monkeypatch.setenv("PATH", "/nowhere")
    monkeypatch.setattr(rosdep, "_is_installed", lambda _requirement: False)
    assert rosdep.main(["install", "--from-paths", str(workspace.base)]) == 0
    assert (index.asked, installed(environment)) == ({"semver"}, {"semver-100.0"})


# The hooks that pip and uv call, in the package's folder.


CMAKE = "catkin_package()\ninstall(DIRECTORY launch DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})"


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    workspace = Workspace(tmp_path / "ws")
    workspace.add("hand")
    folder = workspace.add(
        "arm", CMAKE, "hand rospy", launch__run_dot_launch="<launch/>", _dot_git__config=""
    )
    monkeypatch.chdir(folder)
    return folder


def metadata(file: Path) -> str:
    with zipfile.ZipFile(file) as archive:
        (path,) = [name for name in archive.namelist() if name.endswith("METADATA")]
        return archive.read(path).decode()


def test_the_metadata_is_that_of_the_wheel(package: Path, tmp_path: Path) -> None:
    assert backend.get_requires_for_build_wheel() == []
    name = backend.build_wheel(str(tmp_path))
    assert name == "ros1_arm-0.1.0-py3-none-any.whl"
    info = backend.prepare_metadata_for_build_wheel(str(tmp_path))
    assert info == "ros1_arm-0.1.0.dist-info"
    assert (tmp_path / info / "METADATA").read_text() == metadata(tmp_path / name)
    assert "Requires-Dist: ros1-hand\n" in metadata(tmp_path / name)


def test_nothing_is_written_to_the_source(package: Path, tmp_path: Path) -> None:
    before = sorted(package.rglob("*"))
    backend.build_wheel(str(tmp_path))
    backend.build_sdist(str(tmp_path))
    assert sorted(package.rglob("*")) == before


def test_a_source_archive_makes_the_same_wheel(package: Path, tmp_path: Path, monkeypatch) -> None:
    write_build_system(package)
    archive = tmp_path / backend.build_sdist(str(tmp_path))
    first = archive.read_bytes()
    backend.build_sdist(str(tmp_path))
    assert archive.read_bytes() == first
    wheel = (tmp_path / backend.build_wheel(str(tmp_path))).read_bytes()
    with tarfile.open(archive) as opened:
        assert not any(".git" in name for name in opened.getnames())
        # Python 3.10 and 3.11 have filters only in later releases
        options: dict[str, Any] = {"filter": "data"} if hasattr(tarfile, "data_filter") else {}
        opened.extractall(tmp_path / "unpacked", **options)  # noqa: S202 - made by this test
    monkeypatch.chdir(tmp_path / "unpacked" / "ros1_arm-0.1.0")
    other = tmp_path / "other"
    other.mkdir()
    assert (other / backend.build_wheel(str(other))).read_bytes() == wheel


def test_an_editable_wheel_points_to_the_folder(package: Path, tmp_path: Path) -> None:
    info = backend.prepare_metadata_for_build_editable(str(tmp_path))
    file = tmp_path / backend.build_editable(str(tmp_path))
    assert (tmp_path / info / "METADATA").read_text() == metadata(file)
    with zipfile.ZipFile(file) as archive:
        assert archive.read(archive.namelist()[0]).decode() == f"{package}\n"


def test_settings_are_the_options_of_the_command(package: Path, tmp_path: Path) -> None:
    (package / "extra.txt").touch()
    name = backend.build_wheel(str(tmp_path), {"whole": "true"})
    with zipfile.ZipFile(tmp_path / name) as archive:
        assert any(path.endswith("share/arm/extra.txt") for path in archive.namelist())
    (package / "CMakeLists.txt").write_text("project(arm)\nadd_executable(a a.cpp)\n")
    with pytest.raises(PiprosError, match="compiles a "):
        backend.build_wheel(str(tmp_path), {"strict": "true"})
    with pytest.raises(PiprosError, match=r"the setting strict must be true or false, got \[maybe\]"):
        backend.build_wheel(str(tmp_path), {"strict": "maybe"})


def test_a_folder_without_a_package_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(PiprosError, match=r"has no package\.xml"):
        backend.build_wheel(str(tmp_path))
    with pytest.raises(PiprosError, match=r"has no package\.xml"):
        write_build_system(tmp_path)


def test_the_build_system_is_added_once(package: Path) -> None:
    file = package / "pyproject.toml"
    file.write_text("[tool.black]\n")
    write_build_system(package)
    write_build_system(package)
    assert file.read_text() == f"{BUILD_SYSTEM}\n[tool.black]\n"
    file.write_text("[build-system]\nrequires = []\n")
    with pytest.raises(PiprosError, match="already has a \\[build-system\\]"):
        write_build_system(package)
