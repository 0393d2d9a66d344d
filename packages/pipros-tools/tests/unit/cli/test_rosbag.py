import errno
import io
import os
import signal
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from sensor_msgs.msg import Image
from std_msgs.msg import Header, Int32, String

from pipros.basics.replaced_file import replaced_file
from pipros_tools.bag import BagReader
from pipros_tools.cli.rosbag import main
from pipros_tools.cli.rosbag.progress import Progress
from tests.support.bags import bag_bytes, old_bag_bytes, rows_of, some_rows, values
from tests.support.full_disk import files_limited_to

ROWS = some_rows()


@pytest.fixture
def bag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A bag of several chunks in the working directory."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "run.bag"
    path.write_bytes(bag_bytes(ROWS, chunk_bytes=300))
    return path


def contents(path: str | Path) -> list[Any]:
    with BagReader(path) as reader:
        return rows_of(reader)


def compression_of(path: str | Path) -> set[str]:
    with BagReader(path) as reader:
        return {reader.chunk_header(number).compression for number in range(len(reader.chunks))}


def test_info_prints_the_contents_of_a_bag(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", "run.bag"]) == 0

    out = capsys.readouterr().out
    assert out.startswith("path:        run.bag\nversion:     2.0\nduration:    2.0s\n")
    assert "messages:    30\n" in out
    assert out.endswith("/b   15 msgs    : std_msgs/String\n")


def test_info_prints_frequencies_keys_and_several_bags(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main(["info", "--freq", "run.bag"])
    assert "15 msgs @ 500.0 kHz : std_msgs/Int32" in capsys.readouterr().out
    assert main(["info", "-y", "-k", "messages", "run.bag", "run.bag"]) == 0
    assert capsys.readouterr().out == "30\n---\n30\n"
    main(["info", "-y", "-k", "topics[1].type", "run.bag"])
    assert capsys.readouterr().out == "std_msgs/String\n"
    assert main(["info", "-y", "-k", "topics[7]", "run.bag"]) == 0
    assert capsys.readouterr().err == 'Error getting key "topics[7]"\n'


def test_info_of_what_cannot_be_read_ends_with_1(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("cut.bag").write_bytes(bag.read_bytes()[:4300])

    assert main(["info", "cut.bag"]) == 1
    assert capsys.readouterr().err == "ERROR bag unindexed: cut.bag.  Run rosbag reindex.\n"
    assert main(["info", "none.bag"]) == 1
    assert "ERROR reading none.bag: [Errno 2] No such file or directory" in capsys.readouterr().err


@pytest.mark.parametrize(
    "words", [["merge", "run.bag", "-o"], ["convert", "run.bag"], ["fix", "run.bag"], ["filter", "run.bag"]]
)
def test_a_missing_folder_of_an_output_is_named(bag: Path, words: list[str], capsys) -> None:
    rest = ["True"] if words[0] == "filter" else []

    assert main([*words, "no/where/out.bag", *rest]) == 1

    printed = capsys.readouterr().err
    assert f"there is no folder {Path('no/where')}: " in printed
    assert ".active" not in printed


@pytest.mark.parametrize(
    "words", [["info"], ["check"], ["play", "--pause"], ["filter"], ["compress"], ["fix"]]
)
def test_an_unfinished_recording_is_named_if_its_bag_is_requested(words: list[str], bag, capsys) -> None:
    bag.rename("run.bag.active")
    more = {"filter": ["new.bag", "True"], "fix": ["new.bag"]}.get(words[0], [])
    assert main([*words, "run.bag", *more]) != 0
    error, advice = capsys.readouterr().err.splitlines()[-2:]
    assert "run.bag" in error
    assert advice.startswith("There is an unfinished recording, run.bag.active: ")
    assert advice.endswith("repair it with rosbag reindex run.bag.active, and rename it")


@pytest.mark.parametrize(("options", "name"), [([], "bz2"), (["-j"], "bz2"), (["--lz4"], "lz4")])
def test_compress_keeps_the_old_bag_and_all_messages(options: list[str], name: str, bag: Path) -> None:
    old = bag.read_bytes()

    assert main(["compress", *options, "run.bag"]) == 0

    assert Path("run.orig.bag").read_bytes() == old
    assert (contents("run.bag"), compression_of("run.bag")) == (values(ROWS), {name})
    assert main(["decompress", "-f", "run.bag"]) == 0
    assert (contents("run.bag"), compression_of("run.bag")) == (values(ROWS), {"none"})
    assert sorted(os.listdir()) == ["run.bag", "run.orig.bag"]


def test_decompress_needs_no_option(bag: Path) -> None:
    main(["compress", "run.bag"])
    Path("run.orig.bag").unlink()

    assert main(["decompress", "run.bag"]) == 0
    assert (contents("run.bag"), compression_of("run.bag")) == (values(ROWS), {"none"})


@pytest.mark.needs("handled signals")
@pytest.mark.parametrize("number", [signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM)])
def test_a_rewriting_that_a_signal_ends_leaves_nothing_behind(
    number: signal.Signals, bag: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    old = bag.read_bytes()
    found: list[list[str]] = []

    def recompress(*_: object) -> None:
        found.append(sorted(os.listdir()))
        assert signal.getsignal(number) is not signal.SIG_DFL
        signal.raise_signal(number)

    monkeypatch.setattr("pipros_tools.cli.rosbag.rewriting.recompress", recompress)
    before = signal.signal(number, signal.SIG_DFL)
    try:
        with pytest.raises(SystemExit) as end:
            main(["compress", "run.bag"])
        assert signal.getsignal(number) is signal.SIG_DFL
    finally:
        signal.signal(number, before)

    assert end.value.code == 128 + number
    assert found == [["run.bag", "run.new.bag.active"]]
    assert (os.listdir(), bag.read_bytes()) == (["run.bag"], old)


def test_a_signal_that_is_ignored_stays_ignored(bag: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "pipros_tools.cli.rosbag.rewriting.recompress", lambda *_: signal.raise_signal(signal.SIGTERM)
    )
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        assert main(["compress", "run.bag"]) == 0
    finally:
        signal.signal(signal.SIGTERM, before)


@pytest.mark.parametrize(("name", "module"), [("record", "recording"), ("play", "playing")])
def test_a_background_job_of_a_script_ends_on_sigint(name: str, module: str, monkeypatch) -> None:
    """Shells start such jobs with SIGINT ignored; genuine rosbag handles it nevertheless."""
    found: list[object] = []

    def run(_: object) -> int:
        found.append(signal.getsignal(signal.SIGINT))
        return 0

    monkeypatch.setattr(f"pipros_tools.cli.rosbag.{module}.{name}", run)
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        assert main([name, "run.bag"]) == 0
    finally:
        signal.signal(signal.SIGINT, before)
    assert found == [signal.default_int_handler]


def test_a_backup_is_not_overwritten_unless_forced(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("run.orig.bag").write_bytes(b"precious")

    assert main(["compress", "run.bag"]) == 0

    assert Path("run.orig.bag").read_bytes() == b"precious"
    assert capsys.readouterr().err == "Skipping run.bag. Backup path run.orig.bag already exists.\n"


def test_an_output_folder_takes_the_new_bags(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("out").mkdir()
    assert main(["compress", "--output-dir=out", "run.bag"]) == 0
    assert (contents("out/run.bag"), compression_of("run.bag")) == (values(ROWS), {"none"})
    assert main(["compress", "--output-dir=.", "run.bag"]) == 1
    assert "the output would be the input itself" in capsys.readouterr().err
    assert contents("run.bag") == values(ROWS)


def test_bags_of_format_1_2_can_be_compressed_too(bag: Path) -> None:
    Path("old.bag").write_bytes(old_bag_bytes(ROWS))

    assert main(["compress", "old.bag"]) == 0

    assert (contents("old.bag"), compression_of("old.bag")) == (values(ROWS), {"bz2"})


@pytest.mark.parametrize("more", [[], *([["--ros2", "jazzy"]] if find_spec("pipros_ros2") else [])])
def test_convert_says_that_mcap_files_cannot_have_bz2(more: list[str], bag: Path, capsys) -> None:
    assert main(["convert", "-q", "--compression", "bz2", *more, "run.bag", "out.mcap"]) == 0
    assert "WARNING: MCAP does not support bz2; out.mcap is compressed with zstd\n" in capsys.readouterr().err
    assert main(["convert", "-q", "--compression", "bz2", "-f", "run.bag", "again.bag"]) == 0
    assert (compression_of("again.bag"), capsys.readouterr().err) == ({"bz2"}, "")


@pytest.mark.parametrize("compression", ["none", "lz4"])
def test_reindex_restores_complete_messages(compression: str, bag: Path, capsys) -> None:
    whole = bag_bytes(ROWS, chunk_bytes=300, compression=compression)
    end = BagReader(io.BytesIO(whole)).layout.chunks[-1].position
    Path("cut.bag").write_bytes(whole[: end + 100])

    assert main(["reindex", "cut.bag"]) == 0

    found = contents("cut.bag")
    assert found == values(ROWS)[: len(found)]
    assert len(found) > 20
    assert Path("cut.orig.bag").read_bytes() == whole[: end + 100]
    assert "WARNING: cut.bag, byte" in capsys.readouterr().err
    main(["reindex", "-q", "-f", "cut.bag"])
    assert (contents("cut.bag"), capsys.readouterr().err) == (found, "")


def test_reindex_of_a_damaged_bag_keeps_the_chunks_behind_the_damage(bag: Path) -> None:
    whole = bytearray(bag.read_bytes())
    with BagReader(bag) as reader:
        damaged = reader.chunks[1]
        lost = sum(damaged.counts.values())
    whole[damaged.position + 4 : damaged.position + 20] = bytes(16)
    bag.write_bytes(whole)

    main(["reindex", "-q", "run.bag"])

    assert len(contents("run.bag")) == len(ROWS) - lost


@pytest.mark.parametrize(("expression", "chosen"), [
    ("topic == '/a'", lambda row: row[0] == "/a"), ('topic in ["/b", "/c"]', lambda row: row[0] == "/b"),
    ("t.secs <= 10", lambda row: row[2] <= 10),
    ("t.to_sec() >= 11.000005", lambda row: row[2:] >= (11, 5000)),
    ("m._type == 'std_msgs/String' and m.data.endswith('3')", lambda row: str(row[1]).endswith("3")),
    ("topic != '/a' or (m.data > 5 and m.data < 9)", lambda row: row[0] != "/a" or 5 < row[1] < 9),
    ("any(topic.startswith(x) for x in ('/b', '/z'))", lambda row: row[0] == "/b"),
    ("hasattr(m, 'data') and m.data == 7 or hasattr(m, 'header')", lambda row: row[1] == 7),
    ("True", lambda row: True),
])  # fmt: skip
def test_filter_keeps_the_messages_that_match_an_expression(expression: str, chosen: Any, bag: Path) -> None:
    assert main(["filter", "run.bag", "out.bag", expression]) == 0

    assert contents("out.bag") == [row for row in values(ROWS) if chosen(row)]


def test_filter_prints_and_leaves_nothing_after_an_error(bag: Path, capsys) -> None:
    main(["filter", "run.bag", "out.bag", "m.data == 2 and topic == '/a'", "--print", "m.data"])
    assert capsys.readouterr().out.splitlines()[:3] == ["NO MATCH 0", "NO MATCH text 1", "MATCH 2"]
    Path("out.bag").unlink()

    for wrong in ("m.none", "topic ==", "__import__('os')", "m.__class__", "().__class__"):
        assert main(["filter", "run.bag", "out.bag", wrong]) == 1
        assert "in the expression" in capsys.readouterr().err
    assert os.listdir() == ["run.bag"]
    assert main(["filter", "none.bag", "out.bag", "True"]) == 2
    assert main(["filter", "run.bag", "run.bag", "True"]) == 3


@pytest.mark.parametrize(("command", "error"), [
    ("filter run.bag run.bag/b True", "cannot filter: Not a directory: 'run.bag/b'"),
    ("export run.bag run.bag/folder", "cannot export: Not a directory: 'run.bag/folder'"),
])  # fmt: skip
def test_a_file_that_cannot_be_written_is_named(command: str, error: str, bag: Path, capsys) -> None:
    assert (main(command.split()), capsys.readouterr().err) == (1, f"ERROR: {error}\n")
    assert contents(bag) == values(ROWS)


def test_the_error_about_a_full_disk_names_the_file(tmp_path: Path) -> None:
    with (
        pytest.raises(OSError, match=r"No space left on device: '.*new\.bag'"),
        replaced_file(tmp_path / "new.bag"),
    ):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert not list(tmp_path.iterdir())


@pytest.mark.needs("resource limits")
@pytest.mark.parametrize(("form", "lost"), [("csv", ["image", "text"]), ("npz", ["image"])])
def test_an_export_to_a_full_disk_leaves_out_topics_and_keeps_old_files(
    form: str, lost: list[str], bag: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = Image(height=30, width=30, step=90, encoding="rgb8", data=os.urandom(2700))
    messages = {"/a": Int32(1), "/image": picture, "/text": String("x" * 3000), "/z": Int32(2)}
    bag.write_bytes(bag_bytes([(topic, message, 5, 0) for topic, message in messages.items()]))
    Path("out").mkdir()
    for name in ("a", "image", "text"):
        Path("out", f"{name}.{form}").write_text("old")

    with files_limited_to(2000):
        assert main(["export", "--format", form, "run.bag", "out"]) == 1

    told = capsys.readouterr()
    for name in lost:
        file = "out/image/5.000000000.png" if (name, form) == ("image", "csv") else f"out/{name}.{form}"
        reason = f"[Errno {errno.EFBIG}] {os.strerror(errno.EFBIG)}: '{file}'"
        assert f"WARNING: /{name} is left out: {reason}" in told.err.splitlines()
        assert Path("out", f"{name}.{form}").read_text() == "old"
    assert told.err.count("\n") == len(lost)
    assert {line.partition(":")[0] for line in told.out.splitlines()} == set(messages) - {
        f"/{name}" for name in lost
    }
    assert all(Path("out", f"{name}.{form}").read_bytes()[:3] != b"old" for name in "az")
    assert not list(Path("out").rglob("*.active"))


def test_filter_keeps_connection_headers_and_times(bag: Path) -> None:
    bag.write_bytes(bag_bytes([("/h", Header(frame_id="x"), 7, 8), ("/i", Int32(1), 7, 9)]))

    main(["filter", "run.bag", "out.bag", "m._type == 'std_msgs/Header'"])

    with BagReader("run.bag") as before, BagReader("out.bag") as after:
        assert after.connections[0].header == before.connections[0].header
        assert [message[1:4] for message in after.raw_messages()] == [
            message[1:4] for message in before.raw_messages()
        ][:1]


def test_encryption_is_refused_with_a_reason(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["decrypt", "run.bag"]) == 1
    assert "is not encrypted, so there is nothing to decrypt" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["info", "compress", "decompress", "reindex", "filter", "decrypt"])
def test_every_subcommand_needs_a_bag_and_has_help(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main([command])
    assert ended.value.code == 2
    with pytest.raises(SystemExit) as ended:
        main([command, "--help"])
    assert ended.value.code == 0
    assert f"Usage: rosbag {command} " in capsys.readouterr().out


def test_an_unknown_subcommand_lists_the_known_ones(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["frobnicate"]) == main(["help", "frobnicate"]) == 0
    assert capsys.readouterr().err.startswith("Unknown command: 'frobnicate'\nAvailable subcommands:\n")
    assert main([]) == 0
    assert capsys.readouterr().out.startswith("Usage: rosbag <subcommand> [options] [args]\n")


def test_progress_is_shown_on_a_terminal_only(capsys: pytest.CaptureFixture[str], monkeypatch) -> None:
    Progress("run.bag", 1000).finish()
    assert capsys.readouterr().out == ""
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    progress = Progress("run.bag", 2048)
    progress(1024)
    progress.finish()
    out = capsys.readouterr().out
    assert " 50%     1.0 KB /    2.0 KB" in out
    assert out.endswith("\n")


def test_a_closed_pipe_ends_info_silently(bag: Path) -> None:
    call = "import sys; from pipros_tools.cli.rosbag import main; sys.exit(main())"
    reader, writer = os.pipe()
    os.close(reader)
    try:
        ended = subprocess.run(
            [sys.executable, "-u", "-c", call, "info", "run.bag"], stdout=writer, stderr=subprocess.PIPE,
            text=True, timeout=50,
        )  # fmt: skip
    finally:
        os.close(writer)
    assert (ended.returncode, ended.stderr) == (0, "")
