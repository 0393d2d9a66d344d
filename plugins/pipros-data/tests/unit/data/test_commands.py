"""`rosbag table` and `rosbag query`: output, exit codes, and what queries cannot do."""

import csv
import io
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pyarrow
import pyarrow.parquet
import pytest
from sensor_msgs.msg import CompressedImage, JointState, LaserScan
from std_msgs.msg import Header, Int32, String
from tf2_msgs.msg import TFMessage

import rosbag as rosbag_module
import rospy
from pipros.basics.plugins import verbs
from pipros_tools.cli.complete.options import options, words_after
from pipros_tools.cli.rosbag import main as rosbag
from tests.support.bags import Row, bag_bytes
from tests.support.waiting import wait_until
from tf.msg import tfMessage


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    rows: list[Row] = []
    for n in range(1, 6):
        rows.append(("/n", Int32(n), n, 0))
        rows.append(("/arm/joints", JointState(name=["a", 'b"'], position=[n, 0.5]), n, 500_000_000))
        rows.append(("/camera", CompressedImage(format="jpeg", data=b"\xff\xd8"), n, 600_000_000))
    Path("run.bag").write_bytes(bag_bytes(rows))


def failure(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """Return the error of a command that must fail."""
    assert rosbag(list(arguments)) == 1
    text = capsys.readouterr().err
    assert text.startswith("ERROR: ")
    assert "Traceback" not in text
    return text


def test_a_topic_becomes_a_file_of_each_format(capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("out.parquet", "out.arrow", "out.csv"):
        assert rosbag(["table", "run.bag", "/arm/joints", "-o", name]) == 0
    assert capsys.readouterr().out == ""

    table = pyarrow.parquet.read_table("out.parquet")
    assert pyarrow.ipc.open_file("out.arrow").read_all().equals(table)
    assert table["position"].to_pylist() == [[n, 0.5] for n in range(1, 6)]
    with Path("out.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [json.loads(row["position"]) for row in rows] == table["position"].to_pylist()
    assert (json.loads(rows[0]["name"]), rows[2]["_time"]) == (["a", 'b"'], "3500000000")


def test_several_topics_are_joined() -> None:
    command = ["table", "run.bag", "/n", "/arm/*", "-o", "out.parquet", "--direction", "forward"]
    assert rosbag([*command, "--tolerance", "0.5", "--start", "2", "--end", "4.2"]) == 0

    table = pyarrow.parquet.read_table("out.parquet")
    assert table["data"].to_pylist() == [2, 3, 4]
    assert table["arm/joints.position"].to_pylist() == [[2, 0.5], [3, 0.5], None]


def test_dates_and_every_nth_message_are_chosen() -> None:
    assert rosbag(["table", "run.bag", "/n", "-o", "out.csv", "--every", "2", "--datetimes"]) == 0
    assert Path("out.csv").read_text().splitlines() == [
        '"_time","data"', "1970-01-01 00:00:01.000000000,1", "1970-01-01 00:00:03.000000000,3",
        "1970-01-01 00:00:05.000000000,5",
    ]  # fmt: skip


def test_columns_of_bytes_are_left_out_of_csv(capsys: pytest.CaptureFixture[str]) -> None:
    assert rosbag(["table", "run.bag", "/camera", "-o", "out.csv"]) == 0
    assert capsys.readouterr().err == "data is left out, because CSV cannot store bytes\n"
    columns = '"_time","header.seq","header.stamp","header.frame_id","format"'
    assert Path("out.csv").read_text().splitlines()[0] == columns


def test_errors_of_table_are_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    Path("copy.parquet").write_bytes(Path("run.bag").read_bytes())
    for arguments, reason in (
        ("run.bag /x -o o.csv", "the topics are /arm/joints, /camera, /n"),
        ("no.bag /x -o o.csv", "no such bag: no.bag"),
        ("run.bag /n -o o.txt", "must end in one of .parquet, .arrow, .csv"),
        ("run.bag /n -o o.csv --every=0", "--every must be >= 1"),
        ("run.bag /n /camera -o o.csv --on header", "has no header; use on='receipt'"),
        ("run.bag /n /camera -o o.csv --on x", "on must be receipt or header"),
        ("run.bag /n -o o.csv --start 90", "no message was received from 90.0 to inf: the bags cover "),
        ("copy.parquet /n -o copy.parquet", "the output must not be one of the bags"),
    ):
        assert reason in failure(capsys, "table", *arguments.split())
    assert Path("copy.parquet").read_bytes() == Path("run.bag").read_bytes()
    assert not Path("o.csv").exists()
    with pytest.raises(SystemExit) as ended:
        rosbag(["table", "run.bag", "/n"])
    assert ended.value.code == 2


def test_queries_select_rows_of_topics(capfdbinary: Any) -> None:
    joined = '"/n" n ASOF JOIN arm_joints j ON j._time <= n._time'
    sql = f"SELECT n.data, j.position[1] AS p FROM {joined} WHERE n.data > 3 ORDER BY n.data"  # noqa: S608
    assert rosbag(["query", "run.bag", sql]) == 0
    assert capfdbinary.readouterr().out == b'"data","p"\n4,3\n5,4\n'
    assert rosbag(["query", "run.bag", "SELECT data FROM n WHERE data > 9"]) == 0
    assert capfdbinary.readouterr().out == b'"data"\n'
    assert rosbag(["query", "run.bag", "SELECT data, _time FROM N", "-o", "out.parquet", "--start=4"]) == 0
    made = pyarrow.parquet.read_table("out.parquet").to_pydict()
    assert made == {"data": [4, 5], "_time": [4 * 10**9, 5 * 10**9]}


def test_errors_about_names_list_the_topics(capsys: pytest.CaptureFixture[str]) -> None:
    for sql in ("SELECT 1 FROM nix", "SELECT arm.joints FROM n"):
        assert "Tables have the names of topics: /arm/joints, " in failure(capsys, "query", "run.bag", sql)


@pytest.mark.parametrize(("sql", "reason"), [
    ("SELECT * FROM read_csv('/etc/passwd')", "disabled"), ("SELECT * FROM '/etc/passwd'", "does not exist"),
    ("SELECT * FROM glob('/etc/*')", "disabled"), ("SELECT * FROM read_text('/etc/passwd')", "disabled"),
    ("SELECT * FROM read_blob('/etc/passwd')", "disabled"), ("SELECT getenv('HOME')", "getenv"),
    ("COPY (SELECT 1) TO 'stolen.csv'", "must be a single SELECT"),
    ("COPY n TO 'stolen.csv'", "must be a single SELECT"),
    ("SELECT 1; COPY n TO 'stolen.csv'", "must be a single SELECT"),
    ("EXPORT DATABASE 'stolen'", "must be a single SELECT"), ("LOAD httpfs", "must be a single SELECT"),
    ("SELECT 1; SELECT 2", "must be a single SELECT"),
    ("SET enable_external_access = true", "must be a single SELECT"),
    ("ATTACH 'other.db'", "must be a single SELECT"), ("INSTALL httpfs", "must be a single SELECT"),
    ("CREATE TABLE x AS SELECT 1", "must be a single SELECT"),
    ("SELECT * FROM nothing", "nothing does not exist"), ("SELEC 1", "syntax error"),
    ("SELECT 1 / data + unknown FROM n", "unknown"), ("SELECT error('so ' || data) FROM n", "so 1"),
])  # fmt: skip
def test_queries_cannot_leave_the_bag(sql: str, reason: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert reason in failure(capsys, "query", "run.bag", sql)
    assert sorted(path.name for path in Path().iterdir()) == ["run.bag"]


def test_a_hostile_name_of_a_topic_stays_a_name(capfdbinary: Any) -> None:
    topic = '/x" AS SELECT 1; DROP TABLE "y'
    Path("run.bag").write_bytes(bag_bytes([(topic, String("safe"), 1, 0)]))
    quoted = topic.replace('"', '""')
    sql = f'SELECT data FROM "{quoted}"'  # noqa: S608
    assert (rosbag(["query", "run.bag", sql]), capfdbinary.readouterr().out) == (0, b'"data"\n"safe"\n')


def test_help_and_completion_name_the_commands(capsys: pytest.CaptureFixture[str]) -> None:
    assert rosbag(["help"]) == 0
    listing = capsys.readouterr().out
    assert "   table  \tWrite topics as a table: Parquet, Arrow or CSV.\n" in listing
    assert "   query  \tSelect rows of topics with SQL.\n" in listing
    assert listing.index("   play ") < listing.index("   query ") < listing.index("   record ")
    assert {"table", "query", "play"} <= set(words_after("rosbag"))
    assert "--tolerance" in options("rosbag", ["table"])
    assert (set(verbs("rosbag")), verbs("rostopic")) == ({"table", "query"}, {})


@pytest.mark.parametrize(
    "command", [["table", "run.bag", "/n", "-o", "o.csv"], ["query", "run.bag", "SELECT 1 FROM n"]]
)
def test_progress_is_shown_on_a_terminal_only(command: list[str], capsys, monkeypatch) -> None:
    assert rosbag(command) == 0
    assert "100%" not in capsys.readouterr().out
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    assert rosbag(command) == 0
    assert "/n " in (shown := capsys.readouterr().out)
    assert "100%" in shown
    assert rosbag([*command, "--quiet"]) == 0
    assert "100%" not in capsys.readouterr().out


def test_nothing_else_is_printed_when_the_command_ends() -> None:
    code = "import sys; from pipros_tools.cli.rosbag import main; sys.exit(main(sys.argv[1:]))"
    for sql, status in (("SELECT data FROM n WHERE data = 3", 0), ("SELECT", 1)):
        command = [sys.executable, "-c", code, "query", "run.bag", sql]
        ended = subprocess.run(command, capture_output=True, text=True, check=False)
        assert (ended.returncode, ended.stdout) == (status, '"data"\n3\n' if status == 0 else "")
        assert ended.stderr.count("ERROR: ") == status
        assert "leak" not in ended.stderr


def test_an_interrupted_table_does_not_succeed(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object, **__: object) -> Any:
        raise KeyboardInterrupt

    Path("out.csv").write_text("before")
    monkeypatch.setattr("pipros_data.bags.Bags._tables", interrupted)
    for command in (["table", "run.bag", "/n", "-o", "out.csv"], ["query", "run.bag", "SELECT 1 FROM n"]):
        with pytest.raises(SystemExit) as ended:
            rosbag(command)
        assert ended.value.code == 130
    assert Path("out.csv").read_text() == "before"
    assert not Path("out.csv.active").exists()


@pytest.mark.parametrize("delay_s", [0, 0.04, 0.08])
def test_ctrl_c_ends_a_query_that_would_take_days(tmp_path: Path, delay_s: float) -> None:
    code = "import sys; from pipros_tools.cli.rosbag import main; sys.exit(main(sys.argv[1:]))"
    sql = "SELECT sum(a.range * b.range * n.data) FROM range(100000000) a, range(100000000) b, n"
    folder = tmp_path / "temporary"
    folder.mkdir()
    command = [sys.executable, "-c", code, "query", "run.bag", sql]
    environment = {**os.environ, "TMPDIR": str(folder)}
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment) as process:
        wait_until(lambda: [*folder.glob("*/topics.db")] or process.poll() is not None)
        time.sleep(delay_s)
        process.send_signal(signal.SIGINT)
        try:
            errors = process.communicate(timeout=30)[1]
        finally:
            process.kill()
    assert (process.returncode, errors, [*folder.iterdir()]) == (130, "", [])


def test_rospy_imports_none_of_the_libraries() -> None:
    code = (
        "import sys, rospy, rosbag, pipros_tools.cli.rosbag; "
        "print({'numpy', 'pyarrow', 'duckdb'} & set(sys.modules))"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ended.stdout == "set()\n"


@pytest.mark.parametrize("missing", ["numpy", "pyarrow", "duckdb"])
def test_a_missing_library_is_named_in_one_line(missing: str) -> None:
    code = f"import sys; sys.modules[{missing!r}] = None; "
    code += "from pipros_tools.cli.rosbag import main; sys.exit(main(sys.argv[1:]))"
    table, query = ["table", "run.bag", "/n", "-o", "o.parquet"], ["query", "run.bag", "SELECT data FROM n"]
    for arguments in [query] if missing == "duckdb" else [table, query]:
        command = [sys.executable, "-c", code, *arguments]
        ended = subprocess.run(command, capture_output=True, text=True, check=False)
        assert (ended.returncode, ended.stdout) == (1, "")
        assert f"needs {missing}, which is not installed. Try: " in ended.stderr
        assert len(ended.stderr.splitlines()) == 1


def test_a_name_that_is_not_a_file_is_a_topic_whatever_it_looks_like(capsys) -> None:
    topics = ["imu", "/run.bag", "/etc", "~odd/db3"]
    Path("odd.bag").write_bytes(bag_bytes([(topic, Int32(7), 1, 0) for topic in topics]))

    for topic in topics:
        assert rosbag(["table", "odd.bag", topic, "-o", "one.csv"]) == 0
        assert Path("one.csv").read_text().splitlines()[1:] == ["1000000000,7"]
    assert rosbag(["table", topics[0], "odd.bag", topics[1], "-o", "one.csv"]) == 0
    assert "no such bag: none.bag" in failure(capsys, "table", "odd.bag", "none.bag", "-o", "o.csv")
    assert "no bag has the topic [none]" in failure(capsys, "table", "odd.bag", "none", "-o", "o.csv")


def test_queries_print_no_warnings_of_libraries(capfd: pytest.CaptureFixture[str]) -> None:
    scan = LaserScan(header=Header(frame_id="odd"), ranges=[1.0] * 100)  # its ranges begin at an odd byte
    Path("odd.bag").write_bytes(bag_bytes([("/scan", scan, 1, 0)]))

    assert (rosbag(["query", "odd.bag", "FROM scan"]), capfd.readouterr().err) == (0, "")


def test_a_topic_is_found_without_the_slash_at_its_beginning() -> None:
    assert rosbag(["table", "run.bag", "n", "arm/*", "-o", "out.parquet"]) == 0
    assert "arm/joints.position" in pyarrow.parquet.read_schema("out.parquet").names


def test_a_type_that_was_renamed_stays_one_type(capsys: pytest.CaptureFixture[str]) -> None:
    with rosbag_module.Bag("tf.bag", "w") as bag:
        bag.write("/tf", tfMessage(), rospy.Time(1))
        bag.write("/tf", TFMessage(), rospy.Time(2))
        bag.write("/n", Int32(), rospy.Time(1))
        bag.write("/n", String(), rospy.Time(2))
    assert rosbag(["table", "tf.bag", "/tf", "-o", "out.parquet"]) == 0
    assert pyarrow.parquet.read_table("out.parquet").num_rows == 2
    error = failure(capsys, "table", "tf.bag", "/n", "-o", "out.parquet")
    assert "rosbag filter selects those of one type by m._md5sum" in error
    assert rosbag(["filter", "tf.bag", "n.bag", f"m._md5sum == '{Int32._md5sum}'"]) == 0
    assert rosbag(["table", "n.bag", "/n", "-o", "out.parquet"]) == 0


def test_a_query_sends_no_control_characters_to_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    Path("words.bag").write_bytes(bag_bytes([("/words", String("é\x1b[2J\r\nb"), 1, 0)]))
    terminal = Terminal()
    monkeypatch.setattr(sys, "stdout", terminal)
    assert rosbag(["query", "-q", "words.bag", "SELECT data FROM words"]) == 0
    assert terminal.getvalue() == '"data"\n"é\\x1b[2J\\r\nb"\n'
