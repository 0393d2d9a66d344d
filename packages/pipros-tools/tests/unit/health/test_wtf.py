"""Rules and plugins of `roswtf`."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import roswtf
import roswtf.context
import roswtf.model
import roswtf.rules
from pipros_tools.health import graph_checks, machine_checks
from pipros_tools.health.finding import Findings, FindingSeverity, findings_of, warning
from pipros_tools.health.system_report import SystemReport
from pipros_tools.health.wtf.graph import check_graph
from pipros_tools.health.wtf.plugins import load_plugins
from pipros_tools.health.wtf.rules import Rule, problems_of
from pipros_tools.health.wtf.subject import Subject
from roswtf import main
from tests.unit.health.test_graph_checks import HEALTHY, UNCONNECTED

RULE = (lambda _: None, "about %(pkg)s:")


def subject(system: SystemReport | None = None) -> Subject:
    return replace(Subject.from_variables({"ROS_HOME": "/not/there"}), system=system)


def context(system: SystemReport | None = None) -> roswtf.context.WtfContext:
    found = roswtf.context.WtfContext()
    found.set_subject(subject(system))
    return found


@pytest.mark.parametrize(("result", "text"), [
    ("bad", "about None:bad"), (["a", "b"], "about None:\n * a\n * b\n"), (("a",), "about None:\n * a\n"),
    (True, "about None:"), ({"k": 1}, "about None:"),
])  # fmt: skip
def test_results_of_rules_are_formatted_as_text(result: Any, text: str) -> None:
    ctx = context()
    roswtf.rules.error_rule(RULE, result, ctx)
    roswtf.rules.warning_rule(RULE, result, ctx)
    assert [(error.msg, error.format_msg, error.return_val) for error in ctx.errors] == [
        (text, RULE[1], result)
    ]
    assert isinstance(ctx.warnings[0], roswtf.model.WtfWarning)


@pytest.mark.parametrize("result", [None, False, "", [], 0])
def test_without_findings_nothing_is_printed(result: Any) -> None:
    ctx = context()
    roswtf.rules.error_rule(RULE, result, ctx)
    assert ctx.errors == []


def test_a_healthy_system_passes_all_rules() -> None:
    assert [problem for problem in check_graph(subject(HEALTHY)) if problem.is_error] == []
    ctx = context(HEALTHY)
    assert ctx.unconnected_subscriptions == {"/listener": ["/rosout"]}  # the example has no publisher of it
    assert ctx.expected_edges == ctx.actual_edges == {("/talker", "/listener", "/chatter")}
    assert ctx.uri_node_map == {"http://10.0.0.1:1001/": "/talker", "http://10.0.0.2:1002/": "/listener"}
    assert (ctx.topics, ctx.service_providers) == (["/chatter", "/rosout"], ["/talker"])


def test_a_missing_connection_is_an_error_with_its_remedy() -> None:
    (problem,) = [found for found in check_graph(subject(UNCONNECTED)) if found.is_error]
    assert problem.text.startswith(
        "[/listener] does not receive [/chatter] from [/talker], though both answer. "
    )
    assert "ROS_IP" in problem.text


def test_an_unknown_package_cannot_be_checked() -> None:
    with pytest.raises(roswtf.context.WtfException, match="no_such_package"):
        roswtf.context.WtfContext.from_package("no_such_package")


def test_results_as_yaml(capsys: pytest.CaptureFixture[str]) -> None:
    ctx = context()
    ctx.warnings.append(roswtf.model.WtfWarning("w1"))
    roswtf.yaml_results(ctx)
    assert capsys.readouterr().out == "errors: {}\nwarnings:\n  w1: true\n\n"


PLUGIN = """
from roswtf.rules import error_rule, warning_rule

def roswtf_plugin_static(ctx):
    warning_rule((len, "static says: "), "careful", ctx)

def roswtf_plugin_online(ctx):
    error_rule((len, "online says:"), sorted(ctx.nodes), ctx)
"""


@pytest.fixture
def plugin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, module in {"good_plugin": PLUGIN, "bad_plugin": "1 / 0"}.items():
        folder = tmp_path / name
        folder.mkdir()
        (folder / "package.xml").write_text(
            f"<package format='2'><name>{name}</name><exec_depend>roswtf</exec_depend>"
            f"<export><roswtf plugin='{name}_module'/></export></package>"
        )
        (tmp_path / f"{name}_module.py").write_text(module)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path)


@pytest.mark.usefixtures("plugin")
def test_plugins_are_found_by_their_export(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--offline"]) == 0
    captured = capsys.readouterr()
    assert captured.out.splitlines()[0] == "Loaded plugin good_plugin_module"
    assert "WARNING static says: careful\n" in captured.out
    assert (
        "Unable to load plugin [bad_plugin_module] from package [bad_plugin]: division by zero"
        in captured.err
    )


@pytest.mark.usefixtures("plugin")
def test_plugins_can_be_left_out(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--offline", "--no-plugins"]) == 0
    assert "careful" not in capsys.readouterr().out


@pytest.mark.usefixtures("plugin")
def test_plugins_see_the_running_system() -> None:
    _, online = load_plugins()
    ctx = context(HEALTHY)
    for check in online:
        check(ctx)
    assert [error.return_val for error in ctx.errors] == [["/listener", "/talker"]]


# One check that fails does not end the others, in the doctor and in roswtf.


PLACES = pytest.mark.parametrize("place", range(3), ids=["first", "middle", "last"])


def good(report: str) -> Findings:
    yield warning("good", f"{report} is good", "")


def broken(report: str) -> Findings:
    yield warning("half", f"{report} is half done", "")
    raise ZeroDivisionError("of nothing")


@PLACES
def test_of_the_doctor(place: int) -> None:
    checks = [good, good]
    checks.insert(place, broken)
    found = findings_of(checks, "system")
    assert [each.rule for each in found].count("good") == 2
    (failed,) = (each for each in found if each.rule == "check-failed")
    assert failed.severity is FindingSeverity.ERROR
    assert failed.summary == "The check broken failed: ZeroDivisionError: of nothing"
    assert "half" in [each.rule for each in found]


@pytest.mark.parametrize(
    ("module", "check"), [(graph_checks, "check_graph"), (machine_checks, "check_machine")]
)
def test_both_parts_of_the_doctor_go_on(module: Any, check: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "CHECKS", (broken, good))
    assert [each.rule for each in getattr(module, check)("report")] == ["half", "check-failed", "good"]


@PLACES
def test_of_roswtf(place: int) -> None:
    def fail(_: Any) -> Any:
        raise KeyError("nothing")

    rules: list[Rule] = [(lambda _: True, "found one"), (lambda _: True, "found two")]
    rules.insert(place, (fail, "never"))

    class Subject:
        words: dict[str, str] = {}  # noqa: RUF012

    problems = problems_of(Subject(), rules, [])
    texts = [each.text for each in problems]
    assert texts[place] == "the rule fail failed: KeyError: 'nothing'"
    assert [text for text in texts if text.startswith("found")] == ["found one", "found two"]
    assert [each.is_error for each in problems].count(True) == 1
