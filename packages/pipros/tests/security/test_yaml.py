"""Untrusted YAML that would crash the process, or exhaust memory or time, is refused."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from pipros.safe.yaml import YamlError, load
from tests.support.ros import RosSystem

MODULUS = (1 << 61) - 1
"""Python gives all multiples of it the same hash."""


@pytest.mark.parametrize(
    "text",
    ["[" * 40_000, "{a: " * 40_000, "- " * 40_000, "? " * 40_000, "[" * 40_000 + "]" * 40_000],
    ids=["lists", "mappings", "lines", "keys", "closed lists"],
)
def test_deep_nesting_does_not_crash_the_process(text: str, tmp_path: Path) -> None:
    file = tmp_path / "deep.yaml"
    file.write_text(text)
    code = f"from pipros.safe.yaml import load; load(open({str(file)!r}), 'deep.yaml')"

    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)

    assert done.returncode == 1, done.returncode
    assert "YamlError: deep.yaml:1:" in done.stderr
    assert "nested more than 100 deep" in done.stderr


def test_roslaunch_refuses_a_file_that_is_nested_too_deep(ros: RosSystem, tmp_path: Path) -> None:
    (tmp_path / "deep.yaml").write_text("[" * 40_000)
    launch = tmp_path / "deep.launch"
    launch.write_text(f'<launch><rosparam file="{tmp_path}/deep.yaml"/></launch>')

    run = ros.pipros.run("roslaunch", "--dump-params", launch)

    assert run.returncode == 0  # like genuine roslaunch, which prints only the error
    assert "nested more than 100 deep" in run.output


def test_merged_mappings_do_not_grow_exponentially() -> None:
    lines = ["a0: &a0 {x: 1}", *(f"a{n}: &a{n} {{<<: [*a{n - 1}, *a{n - 1}]}}" for n in range(1, 60))]

    with pytest.raises(YamlError, match="expands to more than 1000000 values"):
        load("\n".join(lines))


def test_keys_with_one_hash_are_refused() -> None:
    text = "".join(f"{MODULUS * (n + 1)}: 0\n" for n in range(20_000))

    with pytest.raises(YamlError, match="more than 1000 numbers are longer than 20 digits"):
        load(text)


def test_sexagesimal_numbers_are_limited() -> None:
    with pytest.raises(YamlError, match="longer than 4300 digits"):
        load("1" + ":1" * 300_000)


def test_directives_are_not_compared_without_end() -> None:
    text = "".join(f"%TAG !{n}! x:\n" for n in range(60_000)) + "--- 1\n"

    for content in (text, text.encode(), text.encode("utf-16")):
        with pytest.raises(YamlError, match="more than 100 %TAG directives"):
            load(content)
