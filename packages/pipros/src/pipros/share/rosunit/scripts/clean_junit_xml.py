#!/usr/bin/env python3
"""Writes copies of all test results, as well-formed XML, to the subfolder `_hudson` of the results."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import rospkg

from pipros.basics.replaced_file import write_whole
from pipros_tools.cli.entry_point import command
from rosunit import junitxml

FOLDER = "_hudson"


def main() -> int:
    print("[clean_junit_xml]: STARTING")
    results = rospkg.get_test_results_dir()
    print("will read test results from", results)
    target = os.path.join(results, FOLDER)
    if not os.path.exists(target):
        print("creating directory", target)
        os.makedirs(target)
    print(f"[clean_junit_xml]: writing aggregated test results to {target}")
    for package in sorted(os.listdir(results)):
        if package not in (FOLDER, ".svn"):
            print("looking at", package)
            clean(os.path.join(results, package), package, target)
    print("[clean_junit_xml]: FINISHED")
    return 0


def clean(folder: str, package: str, target: str) -> None:
    names = sorted(os.listdir(folder)) if os.path.isdir(folder) else []
    for name in names:
        if not name.endswith(".xml"):
            continue
        test = f"{package}.{name.removesuffix('.xml')}"
        file = os.path.join(target, f"{test}.xml")
        try:
            content = junitxml.read(os.path.join(folder, name), test).xml_element()
        except Exception as error:  # continue with the other files
            print(f"ignoring [{os.path.join(folder, name)}]: {error}", file=sys.stderr)
            continue
        print("re-writing", file)
        write_whole(Path(file), content)


sys.exit(command(main)())
