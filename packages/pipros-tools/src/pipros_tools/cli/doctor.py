"""`pipros doctor`: diagnoses why nodes cannot communicate, and recommends remedies."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, Final

from pipros_tools.cli.entry_point import command
from pipros_tools.cli.runner import CommandError, run
from pipros_tools.cli.terminal import has_colours, paragraph, passing_note

if TYPE_CHECKING:
    from pipros_tools.health.examine import Examination
    from pipros_tools.health.finding import Finding
    from pipros_tools.health.self_test import SelfTest

LONGEST_WAIT_S: Final = 3600.0
_COLOURS = {"error": 31, "warning": 33}


@command
def main(argv: Sequence[str] | None = None) -> int:
    options = _parse(list(sys.argv[1:] if argv is None else argv))
    if options.subjects:
        return run(lambda: _examine_subjects(options))
    if options.self_test:
        return run(lambda: _run_self_test(as_json=options.json))
    return run(lambda: _examine_everything(options))


def _parse(argv: Sequence[str]) -> Namespace:
    parser = ArgumentParser(
        prog="pipros doctor",
        description="Check the setup of this machine and the running system: every registered node, topic "
        "and service is queried. Each problem is printed with its solution. Exits with 1 if an error was "
        "found.",
    )
    parser.add_argument(
        "subjects",
        nargs="*",
        metavar="TOPIC|FILE",
        help="only say why no data arrives on a topic, or name the interpreter with which rosrun and "
        "roslaunch start a node's program",
    )
    parser.add_argument("--offline", action="store_true", help="check only the setup of this machine")
    parser.add_argument(
        "--both-ways",
        action="store_true",
        help="check for every subscriber whether it can connect to this machine: each subscribed topic is "
        "advertised for some seconds, and nothing is published (default: only for subscribers without a "
        "connection)",
    )
    parser.add_argument(
        "--timeout",
        type=float,
        default=3.0,
        metavar="SECONDS",
        help="time limit for a node's answer in seconds (default: %(default)s)",
    )
    parser.add_argument(
        "--wait",
        type=float,
        default=3.0,
        metavar="SECONDS",
        help="with a topic: time to receive its messages in seconds (default: %(default)s)",
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument(
        "--self-test",
        action="store_true",
        help="run a master, a talker and a listener for a second and check them",
    )
    options = parser.parse_args(argv)
    if not 0 < options.timeout < float("inf"):
        parser.error(f"--timeout must be a positive, finite number of seconds, got {options.timeout}")
    if not 0 < options.wait <= LONGEST_WAIT_S:
        parser.error(f"--wait must be a positive number up to {LONGEST_WAIT_S:g}, got {options.wait}")
    return options


def _examine_everything(options: Namespace) -> int:
    from pipros_tools.health.examine import examine

    with passing_note("Querying every node, topic and service..."):
        examination = examine(
            is_offline=options.offline, both_ways=options.both_ways, timeout_s=options.timeout
        )
    if options.json:
        _print_json(_examination_as_json(examination))
    else:
        _print_findings(examination.findings)
        _print_nodelets(examination)
        print(_summary(examination))
    return 0 if examination.is_healthy else 1


def _examine_subjects(options: Namespace) -> int:
    """Examine topics or programs. An argument is a program if it is an existing file or cannot be a topic."""
    from pathlib import Path

    from pipros.basics.names import is_legal_topic

    subjects: list[str] = options.subjects
    topics = [each for each in subjects if is_legal_topic(each) and not Path(each).is_file()]
    files = [each for each in subjects if each not in topics]
    if topics and files:
        raise CommandError(
            f"give topics or existing programs, not both: {topics[0]} is a topic, but {files[0]} is not"
        )
    if files:
        return _describe_programs(files, as_json=options.json)
    return _check_topics(topics, options)


def _check_topics(topics: Sequence[str], options: Namespace) -> int:
    from pipros.basics.printable import listed
    from pipros_tools.health.gather_topic import gather_topic
    from pipros_tools.health.topic_check import check_topic

    checks = []
    for topic in topics:
        with passing_note(f"Receiving {topic} for {options.wait:g} s..."):
            checks.append(check_topic(gather_topic(topic, wait_s=options.wait, timeout_s=options.timeout)))
    if options.json:
        _print_json([check.as_json() for check in checks])
        return 1 if any(check.finding for check in checks) else 0
    for check in checks:
        print(f"{listed(check.topic)} ({listed(check.type or 'unknown type')})")
        for step in check.steps:
            if step.finding is None:
                print(f"  {step.name:<12} {listed(step.text)}")
        print()
        if check.finding is None:
            print("Nothing is wrong.")
        else:
            _print_findings([check.finding])
    return 1 if any(check.finding for check in checks) else 0


def _describe_programs(files: Sequence[str], *, as_json: bool) -> int:
    import os
    from pathlib import Path

    from pipros_workspace.program_description import describe_program
    from pipros_workspace.program_start import program_environment

    environment = program_environment(os.environ)
    descriptions = [describe_program(Path(file), environment) for file in files]
    if as_json:
        _print_json([found.as_json() for found in descriptions])
    else:
        for found in descriptions:
            print(f"{found}.")
    return 0 if all(found.is_startable for found in descriptions) else 1


def _run_self_test(*, as_json: bool) -> int:
    from pipros_tools.health.self_test import run_self_test

    with passing_note("Running a master, a talker and a listener..."):
        outcome: SelfTest = run_self_test()
    if as_json:
        findings = [finding.as_json() for finding in outcome.findings]
        _print_json(
            {
                "findings": findings,
                "heard": outcome.heard,
                "first_message_s": round(outcome.first_message_s, 6),
            }
        )
    else:
        _print_findings(outcome.findings)
        if not outcome.findings:
            print(
                f"A master, a talker and a listener ran in this process: {outcome.heard} messages were "
                f"received, the first after {outcome.first_message_s * 1000:.0f} ms. No problems "
                "were found."
            )
    return 1 if outcome.findings else 0


def _print_findings(findings: Iterable[Finding]) -> None:
    from pipros.basics.printable import listed

    is_coloured = has_colours()
    for finding in findings:
        kind = finding.severity.value
        label = f"\x1b[{_COLOURS[kind]};1m{kind.upper()}\x1b[0m" if is_coloured else kind.upper()
        print(label, paragraph(f"{listed(finding.summary)}.", indent=2, taken=len(kind) + 1))
        print("  What to do:", paragraph(listed(finding.cure), indent=4, taken=14))
        print(f"  [{finding.rule}]\n")


def _print_nodelets(examination: Examination) -> None:
    from pipros.basics.printable import listed

    if examination.system is not None and examination.system.nodelets:
        print("Nodelets in Python:")
        for line in examination.system.nodelets:
            print(f"  {listed(line)}")
        print()


def _summary(examination: Examination) -> str:
    kinds = [finding.severity.value for finding in examination.findings]
    if kinds:
        counted = (_plural(kinds.count(kind), kind) for kind in ("error", "warning") if kind in kinds)
        verdict = f"Found {' and '.join(counted)}."
    else:
        verdict = "Nothing is wrong."
    return f"{verdict} Examined: {_scope(examination)}."


def _scope(examination: Examination) -> str:
    system = examination.system
    if system is None:
        return "the setup of this machine"
    nodes, topics = _plural(len(system.nodes), "node"), _plural(len(system.state.topics()), "topic")
    connections = _plural(len(system.pairs()), "connection")
    return (
        f"the setup of this machine, the master at {examination.master_uri}, {nodes}, {topics} with "
        f"{connections}, {_plural(len(system.services), 'service')}"
    )


def _plural(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _examination_as_json(examination: Examination) -> dict[str, Any]:
    system = examination.system
    return {
        "ok": examination.is_healthy,
        "master_uri": examination.master_uri,
        "findings": [finding.as_json() for finding in examination.findings],
        "examined": None
        if system is None
        else {
            "nodes": sorted(system.nodes),
            "topics": system.state.topics(),
            "services": sorted(system.services),
            "connections": len(system.pairs()),
            "nodelets": list(system.nodelets),
        },
    }


def _print_json(value: object) -> None:
    import json

    print(json.dumps(value, indent=2))
