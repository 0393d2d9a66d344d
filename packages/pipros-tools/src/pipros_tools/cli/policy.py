"""`pipros policy check`: explains a policy in sentences, and tests it against a bag."""

from __future__ import annotations

import math
import sys
from argparse import ArgumentParser
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from pipros_server.policy.model import EACH, RUNS, ActKind, ActRule, FieldRule, FieldTree, Policy
from pipros_tools.cli.entry_point import command
from pipros_tools.cli.runner import run

if TYPE_CHECKING:
    from pipros_tools.bag.policy_check import BagCheck


@command
def main(argv: Sequence[str] | None = None) -> int:
    parser = ArgumentParser(
        prog="pipros policy check",
        description="Read a policy (docs/guides/policy.md), and say in sentences what it allows. With a bag, "
        "decide about each recorded message on its topics as if a client had published it. Exits with 1 if "
        "the policy is invalid, or refuses a message in the bag.",
    )
    parser.add_argument("check", choices=["check"], help="the only subcommand")
    parser.add_argument("file", metavar="FILE", help="the policy")
    parser.add_argument("--bag", metavar="BAG", help="a recording of messages that clients published")
    options = parser.parse_args(list(sys.argv[1:] if argv is None else argv))

    def body() -> int:
        from pipros_server.policy.policy_file import read_policy

        policy = read_policy(options.file)
        print("\n".join(sentences(policy)))
        if options.bag is None:
            return 0
        from pipros_tools.bag.policy_check import check_bag

        result = check_bag(policy, options.bag)
        print("\n".join(_result(result)))
        return 1 if result.refused else 0

    return run(body)


def _result(result: BagCheck) -> Iterator[str]:
    """Yield the lines that describe the result for a bag."""
    from pipros.basics.printable import printable

    refused = sum(each.count for each in result.refused.values())
    total = result.passed + refused
    yield f"\n{total} messages on topics of the policy: {result.passed} pass, {refused} are refused."
    for rule, each in result.refused.items():
        yield f"  {each.count} by {rule}, the first one {each.first_s:.3f} s after the start:"
        yield f"    {each.first}"
    if result.other_topics:
        total = sum(result.other_topics.values())
        names = ", ".join(map(printable, sorted(result.other_topics)))
        yield f"{total} messages on topics that the policy does not name were not tested: {names}"


_VERBS = {
    ActKind.TOPIC: "publish {type} on {name}",
    ActKind.SERVICE: "call {name} ({type})",
    ActKind.PARAMETER: "set {name} ({type})",
    ActKind.LAUNCH: "start {name}",
    ActKind.RECORD: "record {name}",
}


def sentences(policy: Policy) -> Iterator[str]:
    """Yield lines that explain a policy in sentences."""
    for rule in policy.rules.values():
        action, _, part = rule.name.rpartition("/")
        if rule.kind is not ActKind.TOPIC or action not in policy.actions:
            yield f"Clients may {_VERBS[rule.kind].format(type=rule.type, name=rule.name)}:"
            yield from _limits(rule, rule.fields)
        elif part == "goal":
            yield f"Clients may send goals to {action} ({policy.actions[action]}), and cancel them:"
            yield from _limits(rule, rule.fields.below["goal"])
    for condition in policy.conditions.values():
        path = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in condition.path)
        value = f"{path.lstrip('.')} of the" if path else "there is a"
        holds = f" is {_values(condition.rule)}, and the message is" if path else ""
        yield (
            f"The condition {condition.name} holds if {value} last message on {condition.topic}{holds} "
            f"at most {condition.max_age_s:g} s old."
        )
    yield "Clients may do nothing else."


def _limits(rule: ActRule, tree: FieldTree) -> Iterator[str]:
    if rule.kind is ActKind.PARAMETER:
        if tree.rule is not None and _values(tree.rule):
            yield f"  {_values(tree.rule)}"
    elif rule.kind in RUNS:
        yield from _fields(tree, "")
    elif tree.rule is not None and tree.rule.is_any:
        yield "  with any values"
    else:
        named = list(_fields(tree, ""))
        yield from named
        if rule.message_class.__slots__:
            yield f"  {'other' if named else 'all'} fields must be zero or empty"
    if rule.per_minute is not None:
        yield f"  at most {rule.per_minute} times a minute"
    if rule.requires:
        yield f"  only while these conditions hold: {', '.join(rule.requires)}"
    if rule.stop is not None:
        is_zero = rule.stop == rule.message_class()
        values = "of zeros" if is_zero else f"with {' '.join(str(rule.stop).split())}"
        is_topic = rule.kind is ActKind.TOPIC
        yield f"  a {'message' if is_topic else 'request'} {values} stops, and always passes"
        if rule.time_limit_s is not None:
            end = "message, or when the client leaves" if is_topic else "call, or when the server ends"
            yield f"  stopped {rule.time_limit_s:g} s after the last {end}"
    if rule.kind in RUNS:
        yield f"  ended {rule.time_limit_s:g} s after the start, or when the server ends"
    if rule.cancel is not None and rule.time_limit_s is not None:
        yield f"  cancelled {rule.time_limit_s:g} s after it was sent, or when the client leaves"
        if rule.halt is not None:
            yield f"  {rule.halt[0]} is stopped when a goal is cancelled, and when no goal is left"


def _fields(tree: FieldTree, path: str) -> Iterator[str]:
    if tree.rule is not None:
        yield f"  {path}: {_values(tree.rule)}"
    for key, below in tree.below.items():
        step = f"{path}[]" if key == EACH else f"{path}[{key}]" if isinstance(key, int) else f"{path}.{key}"
        yield from _fields(below, step.lstrip("."))


def _values(rule: FieldRule) -> str:
    parts = ["any value"] if rule.is_any else []
    if rule.one_of:
        parts.append(" or ".join(map(repr, rule.one_of)))
    if math.isfinite(rule.least) and math.isfinite(rule.most):
        parts.append(rule.shown_range)
    elif rule.has_range:
        end, word = (rule.least, "at least") if math.isfinite(rule.least) else (rule.most, "at most")
        parts.append(f"{word} {rule.unit.shown(end)}")
    if rule.change_per_s is not None:
        change, start = rule.unit.shown(rule.change_per_s), rule.unit.shown(rule.start)
        parts.append(f"changing by at most {change} per second, beginning at {start}")
    if rule.count is not None:
        parts.append(f"at most {rule.count} elements")
    return ", ".join(parts)
