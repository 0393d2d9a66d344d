"""Result files in xUnit format: a writer compatible with rosunit, and a reader for files from any program.

In genuine files, an escaped CDATA marker surrounds the program's output. Dashboards and genuine
`catkin_test_results` expect the marker, so this module writes it, too.
"""

from __future__ import annotations

from collections.abc import Iterator
from xml.sax.saxutils import escape, quoteattr

from pipros.basics.errors import PiprosError
from pipros.safe.xml import Element, XmlError, parse
from pipros_tools.testing.results import Case, Outcome, Suite

_TAG_OF = {Outcome.FAILURE: "failure", Outcome.ERROR: "error"}
CDATA_START = "<![CDATA[\n"
CDATA_END = "\n]]>"


class UnreadableResults(PiprosError):
    """A result file is not XML, or not in xUnit format."""


def format_suite(suite: Suite) -> str:
    """Return the content of a suite's result file."""
    cases = "".join(_format_case(case) for case in suite.cases)
    return (
        '<?xml version="1.0" encoding="utf-8"?>\n'
        f'<testsuite errors="{suite.errors}" failures="{suite.failures}" name={quoteattr(suite.name)}'
        f' tests="{len(suite.cases)}" time="{suite.seconds:.3f}">{cases}'
        f"<system-out>{_format_printed(suite.stdout)}</system-out>"
        f"<system-err>{_format_printed(suite.stderr)}</system-err></testsuite>"
    )


def _format_case(case: Case) -> str:
    class_name, name = quoteattr(escape_controls(case.class_name)), quoteattr(escape_controls(case.name))
    head = f'<testcase classname={class_name} name={name} time="{case.seconds:.4f}"'
    if case.outcome is Outcome.PASSED:
        return head + " />"
    tag = _TAG_OF[case.outcome]
    return (
        f"{head}><{tag} type={quoteattr(case.kind)}>{escape(escape_controls(case.text))}</{tag}></testcase>"
    )


def _format_printed(text: str) -> str:
    return escape(CDATA_START + escape_controls(text) + CDATA_END)


def escape_controls(text: str) -> str:
    """Replace carriage returns, and characters that XML forbids, with visible references."""
    return "".join(
        char if char in "\n\t" or (char >= " " and not _is_outside_xml(char)) else f"&#x{ord(char):04X};"
        for char in text
    )


def _is_outside_xml(char: str) -> bool:
    return "\ud800" <= char <= "\udfff" or char in "\ufffe\uffff"


def parse_suites(content: bytes, file: str) -> list[Suite]:
    """Return the suites in a result file, which has one `<testsuite>` or, from gtest, a `<testsuites>`.

    Raises:
        UnreadableResults: the content is not a result file.
    """
    try:
        root = parse(content, file)
    except XmlError as error:
        raise UnreadableResults(f"the test result file is not XML: {error}") from None
    if root.tag == "testsuite":
        return [_parse_suite(root)]
    if root.tag == "testsuites":
        return [_parse_suite(element) for element in root.all("testsuite")]
    raise UnreadableResults(
        f"{file}:{root.line}: test results must start with <testsuite> or <testsuites>, got <{root.tag}>"
    )


def _parse_suite(element: Element) -> Suite:
    return Suite(
        name=element.attributes.get("name", ""),
        cases=tuple(_parse_case(case) for case in element.all("testcase")),
        seconds=_seconds(element),
        stdout=_parse_printed(element, "system-out"),
        stderr=_parse_printed(element, "system-err"),
        stated_tests=_stated(element, "tests"),
        stated_failures=_stated(element, "failures"),
        stated_errors=_stated(element, "errors"),
    )


def _stated(element: Element, name: str) -> int:
    """Return the number in one of a suite's attributes, or 0 if the attribute is missing."""
    text = element.attributes.get(name, "")
    if text and not (text.isdecimal() and len(text) < 10):
        raise UnreadableResults(
            f"line {element.line}: {name} must be a whole number below 10^9, got [{text}]"
        )
    return int(text or "0")


def _parse_case(element: Element) -> Case:
    outcome, kind, text = Outcome.PASSED, "", ""
    for worse, tag in _TAG_OF.items():
        # gtest writes one <failure> per failed expectation. Keep all of them.
        found = list(element.all(tag))
        if found:
            outcome = worse
            kind = found[0].attributes.get("type", "")
            text = "\n".join(_parts(found))
    return Case(
        class_name=element.attributes.get("classname", ""),
        name=element.attributes.get("name", ""),
        seconds=_seconds(element),
        outcome=outcome,
        kind=kind,
        text=text,
    )


def _parts(found: list[Element]) -> Iterator[str]:
    for element in found:
        yield element.text or element.attributes.get("message", "")


def _parse_printed(element: Element, tag: str) -> str:
    found = element.first(tag)
    text = found.text if found else ""
    return text.removeprefix(CDATA_START).removesuffix(CDATA_END)


def _seconds(element: Element) -> float:
    try:
        return float(element.attributes.get("time", "0"))
    except ValueError:
        return 0.0
