"""Caches and logs in folders where other users can write: planted files are not used or written."""

import logging
import os
import shutil
import stat
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest

from pipros.basics.cache_files import CacheFolder
from pipros.basics.env import Environment
from pipros.basics.log_file import open_to_write
from pipros.master.store import Store, StoreUntrusted
from pipros.msg.importing.library import Library
from pipros.node.log import find_log_config, open_file_handler
from pipros_tools.launch.logs import LogFolder, LogFolderUnusable
from pipros_workspace.index import PackageIndex
from tests.support.environments import VENV_BIN
from tests.support.ros import RosSystem
from tests.support.users import NOBODY, STRANGER, give_away, needs_nobody, needs_other_users
from tests.support.waiting import wait_until

# Caches in a folder where other users can write: planted files are not used.


needs_shared = pytest.mark.skipif(not hasattr(os, "getuid"), reason="files have no owner here")


@pytest.fixture
def shared_home(tmp_path: Path) -> Path:
    """A ROS_HOME in which every user can create and rename files."""
    if not hasattr(os, "getuid"):
        pytest.skip("files have no owner here")
    home = tmp_path / "shared"
    home.mkdir()
    home.chmod(0o777)
    return home


@pytest.fixture
def cache(shared_home: Path) -> CacheFolder:
    cache = CacheFolder(str(shared_home / "pipros" / "things"))
    cache.write("thing", b"mine")
    assert cache.read("thing") == b"mine"
    return cache


def things(home: Path) -> Path:
    return home / "pipros" / "things"


def link_to_a_file_of_mine(home: Path) -> None:
    (home / "download").write_bytes(b"chosen by a stranger")
    (things(home) / "thing").unlink()
    (things(home) / "thing").symlink_to(home / "download")


def second_name_of_a_file_of_mine(home: Path) -> None:
    (home / "download").write_bytes(b"chosen by a stranger")
    (things(home) / "thing").unlink()
    (things(home) / "thing").hardlink_to(home / "download")


def link_to_a_folder_of_mine(home: Path) -> None:
    things(home).rename(home / "unpacked")
    things(home).symlink_to(home / "unpacked")


def link_to_a_folder_above(home: Path) -> None:
    (home / "pipros").rename(home / "unpacked")
    (home / "pipros").symlink_to(home / "unpacked")


def pipe(home: Path) -> None:
    (things(home) / "thing").unlink()
    os.mkfifo(things(home) / "thing", 0o600)


PLANTED: dict[str, Callable[[Path], object]] = {
    "link": link_to_a_file_of_mine, "hard link": second_name_of_a_file_of_mine,
    "link to a folder": link_to_a_folder_of_mine, "link to the folder above": link_to_a_folder_above,
    "pipe": pipe, "file that the group may write": lambda home: (things(home) / "thing").chmod(0o620),
    "file that all may write": lambda home: (things(home) / "thing").chmod(0o602),
    "folder that the group may write": lambda home: things(home).chmod(0o770),
    "folder above that all may write": lambda home: (home / "pipros").chmod(0o777),
}  # fmt: skip
GIVEN_AWAY: dict[str, Callable[[Path], object]] = {
    "file": lambda home: give_away(things(home) / "thing"), "folder": lambda home: give_away(things(home)),
    "folder above": lambda home: give_away(home / "pipros"),
}  # fmt: skip


@pytest.mark.parametrize(
    "plant",
    [
        *(pytest.param(plant, id=name) for name, plant in PLANTED.items()),
        *(
            pytest.param(plant, id=f"another's {n}", marks=needs_other_users)
            for n, plant in GIVEN_AWAY.items()
        ),
    ],
)
def test_files_that_others_could_have_written_are_not_read(cache, shared_home, plant) -> None:
    plant(shared_home)

    assert cache.read("thing") is None


def test_a_file_that_is_being_replaced_is_read(cache: CacheFolder, shared_home: Path, monkeypatch) -> None:
    fstat = os.fstat

    def replace_and_fstat(descriptor: int) -> os.stat_result:
        if stat.S_ISREG(fstat(descriptor).st_mode):
            (things(shared_home) / "new").write_bytes(b"new")
            (things(shared_home) / "new").replace(things(shared_home) / "thing")
        return fstat(descriptor)

    content = (things(shared_home) / "thing").read_bytes()
    monkeypatch.setattr(os, "fstat", replace_and_fstat)

    assert cache.read("thing") == content


def test_nothing_is_written_through_a_link(cache: CacheFolder, shared_home: Path) -> None:
    link_to_a_file_of_mine(shared_home)
    link = things(shared_home) / "thing"

    cache.write("thing", b"mine again")

    assert (shared_home / "download").read_bytes() == b"chosen by a stranger"
    assert not link.is_symlink()
    assert cache.read("thing") == b"mine again"


@pytest.mark.parametrize("plant", [link_to_a_folder_of_mine, link_to_a_folder_above])
def test_nothing_is_written_through_a_linked_folder(cache, shared_home, plant) -> None:
    plant(shared_home)

    cache.write("another", b"mine")

    assert list(shared_home.rglob("another")) == []


def test_folders_and_files_of_a_cache_are_for_this_user_only(tmp_path: Path) -> None:
    before = os.umask(0)
    try:
        CacheFolder(str(tmp_path / "home" / "pipros" / "things")).write("thing", b"mine")
    finally:
        os.umask(before)

    modes = {path.name: stat.S_IMODE(path.stat().st_mode) for path in tmp_path.rglob("*")}
    assert modes == {"home": 0o700, "pipros": 0o700, "things": 0o700, "thing": 0o600}


def test_a_link_of_the_user_to_ros_home_is_followed(cache: CacheFolder, shared_home: Path) -> None:
    link = shared_home.with_name("link")
    link.symlink_to(shared_home)

    assert CacheFolder(str(link / "pipros" / "things")).read("thing") == b"mine"


@needs_other_users
def test_nothing_is_left_in_the_home_of_another_user(shared_home: Path) -> None:
    """As after `sudo -E`: the owner could neither use nor replace a cache created by root."""
    give_away(shared_home)

    CacheFolder(str(shared_home / "pipros" / "things")).write("thing", b"mine")

    assert list(shared_home.iterdir()) == []


def test_a_cache_that_is_not_used_is_reported_once(cache: CacheFolder, shared_home: Path, capfd) -> None:
    things(shared_home).chmod(0o777)

    for _ in range(3):
        cache.read("thing")
        cache.write("thing", b"mine")

    [line] = capfd.readouterr().err.splitlines()
    assert f"{things(shared_home)} must not be writable by other users" in line
    assert "set ROS_HOME" in line


def test_a_missing_cache_is_not_reported(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert CacheFolder(str(tmp_path / "pipros" / "things")).read("thing") is None
    assert capfd.readouterr().err == ""


def test_a_cache_may_be_named_relative_to_the_working_directory(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    cache = CacheFolder(os.path.join("home", "things"))
    cache.write("thing", b"mine")
    assert cache.read("thing") == (tmp_path / "home" / "things" / "thing").read_bytes() == b"mine"


def test_a_home_that_cannot_be_examined_has_no_log_configuration(tmp_path: Path) -> None:
    assert find_log_config(Environment(ros_home=tmp_path / ("x" * 300))) is None


@needs_shared
def test_code_behind_a_link_is_not_run_as_a_message(tmp_path: Path) -> None:
    definition = tmp_path / "src" / "robot" / "msg" / "Arm.msg"
    definition.parent.mkdir(parents=True)
    definition.write_text("int8 hand\n")
    cache = tmp_path / "home" / "messages"

    def find(name: str) -> str:
        return str(tmp_path / "src" / name)

    compiled = Library(find, str(cache)).code("msg", "robot/Arm")
    [entry] = (path for path in cache.rglob("*") if path.is_file())
    chosen = tmp_path / "download"
    chosen.write_bytes(entry.read_bytes().replace(b"hand", b"bomb"))
    entry.unlink()
    entry.symlink_to(chosen)

    assert Library(find, str(cache)).code("msg", "robot/Arm") == compiled


@needs_other_users
def test_rosrun_does_not_run_a_program_that_another_user_chose(tmp_path: Path, shared_home: Path) -> None:
    source = tmp_path / "src"
    for number in range(50):
        package = source / f"p{number}"
        package.mkdir(parents=True)
        (package / "package.xml").write_text(f"<package><name>p{number}</name></package>")
    listed = [source, *source.rglob("*")]
    for path in listed:
        os.utime(path, (1_000_000_000, 1_000_000_000))
    list(PackageIndex([source], cache_folder=shared_home / "pipros" / "packages"))
    [entry] = (shared_home / "pipros" / "packages").iterdir()
    evil = shared_home / "evil"
    shutil.copytree(source / "p7", evil)
    entry.write_bytes(entry.read_bytes().replace(f"{source}/p7\t".encode(), f"{evil}\t".encode()))
    give_away(shared_home)
    shared_home.chmod(0o777)
    for path in tmp_path.rglob("*"):
        path.chmod(path.stat().st_mode | 0o055)

    variables = {"ROS_HOME": str(shared_home), "ROS_PACKAGE_PATH": str(source), "PATH": "/usr/bin:/bin"}
    found = subprocess.run(
        [VENV_BIN / "rospack", "find", "p7"], env=variables, capture_output=True, text=True, check=False
    )

    assert (found.returncode, found.stdout) == (0, f"{source / 'p7'}\n")
    assert f"{shared_home / 'pipros'} belongs to another user" in found.stderr


@needs_shared
def test_parameters_that_a_master_keeps_are_for_its_user_only(tmp_path: Path) -> None:
    before = os.umask(0)
    try:
        store = Store(tmp_path / "pipros" / "master.sqlite")
        store.param_set("/password/", "secret")
        modes = {path.name: stat.S_IMODE(path.stat().st_mode) for path in (tmp_path / "pipros").rglob("*")}
        store.close()
    finally:
        os.umask(before)

    assert "master.sqlite-wal" in modes
    assert set(modes.values()) == {0o600}
    assert stat.S_IMODE((tmp_path / "pipros").stat().st_mode) == 0o700


@needs_shared
def test_a_world_readable_store_becomes_private(tmp_path: Path) -> None:
    Store(tmp_path / "master.sqlite").close()
    (tmp_path / "master.sqlite").chmod(0o644)

    Store(tmp_path / "master.sqlite").close()

    assert stat.S_IMODE((tmp_path / "master.sqlite").stat().st_mode) == 0o600


def linked(file: Path) -> Path:
    file.rename(f"{file}2")
    file.symlink_to(f"{file}2")
    return file


@needs_shared
def test_a_store_behind_a_link_of_the_user_is_restored(tmp_path: Path) -> None:
    file = tmp_path / "master.sqlite"
    store = Store(file)
    store.param_set("/speed/", 99)
    store.close()
    linked(file)

    store = Store(file)
    store.close()

    assert store.restored.parameters == (("/speed/", 99),)


STORES: dict[str, Callable[[Path], object]] = {
    "file of another user": lambda file: give_away(file),
    "link of another user": lambda file: give_away(linked(file)),
    "folder of another user": lambda file: give_away(file.parent),
    "folder that all may write": lambda file: file.parent.chmod(0o777),
    "file that all may write": lambda file: file.chmod(0o666),
}


@needs_shared
@needs_other_users
@pytest.mark.parametrize("plant", STORES.values(), ids=STORES)
def test_parameters_that_another_user_could_have_written_are_not_restored(tmp_path, plant) -> None:
    file = tmp_path / "pipros" / "master.sqlite"
    store = Store(file)
    store.param_set("/speed/", 99)
    store.close()
    plant(file)

    with pytest.raises(StoreUntrusted, match="set ROS_HOME to your own folder"):
        Store(file)


@needs_shared
@needs_other_users
def test_roscore_says_that_it_does_not_resume(ros: RosSystem) -> None:
    folder = Path(ros.pipros.environment["ROS_HOME"]) / "pipros"
    folder.mkdir(parents=True)
    folder.chmod(0o777)

    ran = ros.pipros.run("roscore", "-p", str(ros.port), "--resume")

    ran.check(1, f"{folder} must not be writable by other users")


# Log files in a folder where other users can write: planted files are not written to.


@pytest.fixture
def victim(tmp_path: Path) -> Path:
    file = tmp_path / "file of mine"
    file.write_text("precious")
    return file


def link_of_another_user(path: Path, victim: Path) -> None:
    path.symlink_to(victim)
    give_away(path)


def link_to_a_link_of_another_user(path: Path, victim: Path) -> None:
    link_of_another_user(path.with_name("between"), victim)
    path.symlink_to("between")


def hard_link(path: Path, victim: Path) -> None:
    path.hardlink_to(victim)


def log_pipe(path: Path, victim: Path) -> None:
    del victim
    os.mkfifo(path)


@needs_other_users
@pytest.mark.parametrize(
    "plant", [link_of_another_user, link_to_a_link_of_another_user, hard_link, log_pipe],
    ids=lambda plant: plant.__name__,
)  # fmt: skip
@pytest.mark.parametrize("append", [True, False])
def test_files_that_another_user_could_have_planted_are_not_written_to(
    tmp_path: Path, victim: Path, plant: Callable[[Path, Path], None], append: bool
) -> None:
    plant(tmp_path / "x.log", victim)

    with pytest.raises(OSError, match=r"link that belongs to another user|hard link|No such device"):
        os.close(open_to_write(tmp_path / "x.log", append=append))

    assert victim.read_text() == "precious"


@needs_other_users
@pytest.mark.skipif(sys.platform != "linux", reason="needs descriptors of links")
def test_a_link_exchanged_after_it_was_checked_is_not_followed(tmp_path, victim: Path, monkeypatch) -> None:
    path, allowed = tmp_path / "x.log", tmp_path / "of-mine.log"
    path.symlink_to(allowed)
    link_of_another_user(tmp_path / "evil", victim)

    def exchange_before(call: Callable[..., str]) -> Callable[..., str]:
        def exchanged(*args: object, **options: object) -> str:
            with suppress(FileNotFoundError):
                (tmp_path / "evil").replace(path)
            return call(*args, **options)

        return exchanged

    monkeypatch.setattr("os.readlink", exchange_before(os.readlink))
    os.close(open_to_write(path, append=False))

    assert victim.read_text() == "precious"
    assert allowed.exists()


@needs_other_users
def test_the_log_of_a_node_does_not_follow_the_link_of_another_user(tmp_path, victim: Path, capsys) -> None:
    link_of_another_user(tmp_path / "talker.log", victim)

    open_file_handler(tmp_path / "talker.log").emit(logging.makeLogRecord({"msg": "a line"}))

    assert "a link that belongs to another user" in capsys.readouterr().err
    assert victim.read_text() == "precious"


@needs_other_users
def test_the_folder_of_a_run_is_not_a_link_of_another_user(tmp_path: Path) -> None:
    (tmp_path / "documents").mkdir()
    link_of_another_user(tmp_path / "the-run", tmp_path / "documents")

    with pytest.raises(LogFolderUnusable, match="a link that belongs to another user"):
        LogFolder.of_run(Environment(log_dir=tmp_path), "the-run")
    tmp_path.chmod(0o1777)
    with pytest.raises(LogFolderUnusable, match="a link of another user"):
        LogFolder.of_run(Environment(log_dir=tmp_path / "the-run"), "a-run")
    assert not list((tmp_path / "documents").iterdir())


def test_links_of_the_user_are_followed(tmp_path: Path, victim: Path) -> None:
    (tmp_path / "x.log").symlink_to("between")
    (tmp_path / "between").symlink_to(victim)

    with open(open_to_write(tmp_path / "x.log"), "w") as file:
        file.write(" indeed")

    assert victim.read_text() == "precious indeed"


def test_a_link_to_itself_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "x.log").symlink_to("x.log")

    with pytest.raises(OSError, match="symbolic links"):
        open_to_write(tmp_path / "x.log")


@pytest.mark.skipif(not os.path.exists("/dev/stderr"), reason="needs /dev/stderr")
@pytest.mark.parametrize("device", ["/dev/null", "/dev/stderr"])
def test_devices_may_be_log_files(device: str) -> None:
    code = f"from pipros.basics.log_file import LogFile; LogFile({device!r}).write('a line\\n')"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    assert ran.stderr == ("a line\n" if device == "/dev/stderr" else "")


@needs_other_users
def test_the_pid_file_of_a_core_replaces_a_planted_link(ros: RosSystem, victim: Path) -> None:
    home = Path(ros.pipros.environment["ROS_HOME"])
    home.mkdir()
    link_of_another_user(home / f"roscore-{ros.port}.pid", victim)

    core = ros.pipros.start_master()

    def written() -> str:
        with suppress(FileNotFoundError):  # between the end of the link and the new file
            return (home / f"roscore-{ros.port}.pid").read_text()
        return ""

    assert wait_until(lambda: written() == str(core.pid))
    assert victim.read_text() == "precious"


_NODE = """\
import rospy
rospy.init_node("chatty")
for number in range(20):
    rospy.loginfo("line %d", number)
print("done", flush=True)
"""


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full of Linux")
def test_a_node_on_a_full_disk_warns_once_and_continues(ros: RosSystem) -> None:
    ros.serve_master()
    (ros.home / "chatty.py").write_text(_NODE)

    ran = ros.pipros.run("python", ros.home / "chatty.py", "__log:=/dev/full")

    assert ran.returncode == 0
    assert "done" in ran.stdout
    assert "Logging error" not in ran.output
    assert ran.output.count("WARNING: cannot write to log file [/dev/full]: No space left on device") == 1


# A container that is started with only a user number: no HOME, no account.


HOMELESS_NODE = """\
import rospy
rospy.init_node("homeless")
print("named", rospy.get_name(), flush=True)
rospy.spin()
"""


@pytest.fixture
def homeless(ros: RosSystem) -> Path:
    """Return the folder that replaces the home of the programs of `ros`."""
    temporary = ros.home / "tmp"
    temporary.mkdir()
    for name in ("HOME", "ROS_HOME"):
        del ros.pipros.environment[name]
    ros.pipros.environment["TMPDIR"] = str(temporary)
    return temporary / f"pipros-home-{STRANGER}"


@needs_nobody
def test_a_system_runs_and_can_be_queried_as_usual(ros: RosSystem, homeless: Path) -> None:
    core = ros.pipros.start(*NOBODY, "roscore", "-p", str(ros.port))
    core.wait_for(r"started core service \[/rosout\]")
    (ros.home / "node.py").write_text(HOMELESS_NODE)
    node = ros.pipros.start(*NOBODY, "python", ros.home / "node.py")
    node.wait_for("named /homeless")
    launch = ros.home / "x.launch"
    launch.write_text("<launch><param name='a' value='7'/></launch>")

    for command, expected in {
        "rosnode list": "/homeless", "rostopic list": "/rosout", "rospack find std_msgs": "std_msgs",
        "rosmsg show std_msgs/String": "string data", f"roslaunch {launch}": "No processes to monitor",
        "rosparam get /a": "7", "roslaunch-logs": f"{homeless}/.ros/log/",
    }.items():  # fmt: skip
        ran = ros.pipros.run(*NOBODY, *command.split())
        ran.check(0, expected)

    assert wait_until(lambda: (homeless / ".ros" / "log" / "homeless.log").is_file())
    assert os.listdir(ros.home / "tmp") == [homeless.name]
    assert not (ros.home / "~").exists()
