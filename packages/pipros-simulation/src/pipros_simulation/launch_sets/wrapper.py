"""A launch file that starts pipros_sim as the robot of another launch file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any
from xml.sax.saxutils import escape, quoteattr

import yaml

from pipros_simulation.launch_sets.expected_robot import Expected


def wrapper_text(file: str, arguments: Mapping[str, str], expected: Expected) -> str:
    """Return the launch file.

    Args:
        file: the full path of the launch file that it includes.
        arguments: values for arguments of that file.
    """
    return "\n".join(_lines(file, arguments, expected)) + "\n"


def _lines(file: str, arguments: Mapping[str, str], expected: Expected) -> Iterator[str]:
    yield "<launch>"
    yield f"  <!-- {_comment(file)} on pipros_sim. Where the values come from:"
    yield from (f"       {_comment(each)}" for each in expected.notes)
    if expected.unknown:
        yield "       Not found out:"
        yield from (f"       {_comment(each)}" for each in expected.unknown)
    yield "  -->"
    yield '  <arg name="headless" default="false"/>'
    yield '  <arg name="speed" default="1.0"/>'
    yield '  <arg name="lockstep" default="[]"/>'
    yield '  <rosparam param="/lockstep" subst_value="true">$(arg lockstep)</rosparam>'
    yield f"  <include file={quoteattr(file)}>"
    for name, value in arguments.items():
        yield f"    <arg name={quoteattr(name)} value={quoteattr(value)}/>"
    yield "  </include>"
    yield '  <param name="/use_sim_time" value="true"/>'
    for name, value in expected.overrides.items():
        yield f"  <param name={quoteattr(name)} value={quoteattr(str(value))}/>"
    yield '  <node pkg="pipros_sim" type="sim" name="sim" output="screen">'
    for name, topic in expected.topics.items():
        if topic != f"/{name.lstrip('/')}":
            yield f"    <remap from={quoteattr(name)} to={quoteattr(topic)}/>"
    yield '    <param name="headless" value="$(arg headless)"/>'
    yield '    <param name="speed" value="$(arg speed)"/>'
    for name, value in expected.params.items():
        yield f"    <rosparam param={quoteattr(name)}>{escape(_yaml(value))}</rosparam>"
    yield "  </node>"
    yield "</launch>"


def _yaml(value: Any) -> str:
    return yaml.safe_dump(value, default_flow_style=True, sort_keys=False).removesuffix("\n...\n").strip()


def _comment(text: str) -> str:
    return text.replace("--", "- -")
