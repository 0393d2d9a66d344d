"""`rospy.logger_level_service_caller` and `rospy.rosconsole`, on a node in this process."""

from __future__ import annotations

import pytest

from pipros.master.master import Master
from pipros.node.logger_services import serve_loggers
from rospy import rosconsole
from rospy.logger_level_service_caller import LoggerLevelServiceCaller, ROSConsoleException
from tests.support.nodes import MakeNode


@pytest.fixture
def caller(master: Master, make_node: MakeNode, monkeypatch: pytest.MonkeyPatch) -> LoggerLevelServiceCaller:
    monkeypatch.setenv("ROS_MASTER_URI", master.uri)
    serve_loggers(make_node("listener"))
    return LoggerLevelServiceCaller()


def test_levels_are_read_and_set(
    caller: LoggerLevelServiceCaller, capsys: pytest.CaptureFixture[str]
) -> None:
    assert caller.get_node_names() == ["/listener"]
    assert caller.get_levels() == ["debug", "info", "warn", "error", "fatal"]
    logger = caller.get_loggers("/listener")[0]
    assert caller.send_logger_change_message("/listener", logger, "error")
    assert not caller.send_logger_change_message("/listener", logger, "ERROR")
    rosconsole.main(["rosconsole", "get", "/listener", logger])
    assert capsys.readouterr().out == "ERROR\n"
    assert caller.send_logger_change_message("/listener", logger, "info")


def test_unknown_nodes_and_loggers_raise(
    caller: LoggerLevelServiceCaller, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(ROSConsoleException, match="node '/nobody' doesn't exist"):
        caller.get_loggers("/nobody")
    with pytest.raises(KeyError):
        caller.send_logger_change_message("/listener", "nothing", "info")
    with pytest.raises(SystemExit) as end:
        rosconsole.main(["rosconsole", "list", "/nobody"])
    assert end.value.code == 1
    with pytest.raises(SystemExit):
        rosconsole.error(3, "bad")
    assert capsys.readouterr().err.endswith("rosconsole: error: bad\n")
