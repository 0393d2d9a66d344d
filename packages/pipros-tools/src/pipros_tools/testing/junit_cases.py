"""Write the cases of a `<test>` into pytest's JUnit file, which otherwise has only one case per item.

The number of cases is known only after the test has run, in another process if pytest-xdist is used.
Therefore, the item records its cases as a property, which pytest writes, and this module then replaces the
item's element.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from xml.etree import ElementTree

from pipros_tools.testing.results import Case, Outcome
from pipros_tools.testing.xunit import escape_controls

PROPERTY = "pipros.cases"
_TAGS = {Outcome.FAILURE: "failure", Outcome.ERROR: "error"}


def as_property(cases: Iterable[Case]) -> tuple[str, str]:
    """Return the name and value of a property that contains the cases."""
    rows = [
        [case.class_name, case.name, case.seconds, case.outcome.value, case.kind, case.text] for case in cases
    ]
    return PROPERTY, json.dumps(rows)


def with_cases(text: str) -> str:
    """Return the JUnit file, in which each item with the property is replaced by the item's cases.

    The output of the item is kept in its first case.
    """
    root = ElementTree.fromstring(text)  # noqa: S314 # pytest has written it
    for suite in root.iter("testsuite"):
        for item in suite.findall("testcase"):
            cases = _cases_of(item)
            if cases:
                position = list(suite).index(item)
                suite.remove(item)
                for offset, element in enumerate(_elements(item, cases)):
                    suite.insert(position + offset, element)
        for count, tag in (("tests", "testcase"), ("failures", "*/failure"), ("errors", "*/error")):
            suite.set(count, str(len(suite.findall(tag))))
    return '<?xml version="1.0" encoding="utf-8"?>' + ElementTree.tostring(root, encoding="unicode")


def _cases_of(item: ElementTree.Element) -> list[Case]:
    found = item.find(f"properties/property[@name='{PROPERTY}']")
    rows = [] if found is None else json.loads(found.get("value", "[]"))
    return [Case(row[0], row[1], row[2], Outcome(row[3]), row[4], row[5]) for row in rows]


def _elements(item: ElementTree.Element, cases: Sequence[Case]) -> list[ElementTree.Element]:
    place = f"{item.get('classname', '')}.{item.get('name', '')}".strip(".")
    elements = []
    for case in cases:
        attributes = {
            "classname": f"{place}.{case.class_name}",
            "name": escape_controls(case.name),
            "time": f"{case.seconds:.3f}",
        }
        element = ElementTree.Element("testcase", attributes)
        if case.outcome in _TAGS:
            message = escape_controls(case.text.strip().partition("\n")[0])
            problem = ElementTree.SubElement(
                element, _TAGS[case.outcome], {"type": case.kind, "message": message}
            )
            problem.text = escape_controls(case.text)
        elements.append(element)
    elements[0].extend(child for child in item if child.tag in ("system-out", "system-err"))
    return elements
