"""Read test results from result files into Noetic's classes, and write them as XML."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

from pipros.basics.env import Environment
from pipros.basics.input_file import read_file
from pipros.basics.lazy_names import star_names as _star_names
from pipros_tools.testing.results import Case, Outcome, Suite
from pipros_tools.testing.summary import case_summary
from pipros_tools.testing.xunit import (
    CDATA_END,
    CDATA_START,
    UnreadableResults,
    escape_controls,
    parse_suites,
)

_star_names(
    __name__,
    "char=builtins:chr codecs DomNode=xml.dom:Node ET=xml.etree.ElementTree os xml.dom.minidom:parseString "
    "functools:reduce rospkg io:StringIO",
)

_DASHES = "-" * 80


class TestInfo:
    """The reason why a test case did not pass, as the type and text of the exception."""

    __test__ = False  # pytest must not collect this class
    tag = ""

    def __init__(self, type_: str, text: str) -> None:
        self.type = type_
        self.text = text

    def xml_element(self) -> ElementTree.Element:
        element = ElementTree.Element(self.tag, type=self.type)
        element.text = _cdata(self.text)
        return element

    def xml(self) -> bytes:
        return ElementTree.tostring(self.xml_element())


class TestError(TestInfo):
    tag = "error"


class TestFailure(TestInfo):
    tag = "failure"


class TestCaseResult:
    """The outcome of one test case, which passed if it has neither failures nor errors."""

    __test__ = False

    def __init__(self, name: str) -> None:
        self.name = name
        self.failures: list[TestFailure] = []
        self.errors: list[TestError] = []
        self.time = 0.0
        self.classname = ""

    @property
    def passed(self) -> bool:
        return not self.errors and not self.failures

    @property
    def description(self) -> str:
        """The text that describes the case in a summary."""
        if self.passed:
            return f"[{self.name}][passed]\n"
        return "".join(
            f"{f'[{self.name}][{item.tag.upper()}]':-<80}\n{item.text}\n{_DASHES}\n\n"
            for item in (*self.failures, *self.errors)
        )

    def add_failure(self, failure: TestFailure) -> None:
        self.failures.append(failure)

    def add_error(self, error: TestError) -> None:
        self.errors.append(error)

    def xml_element(self) -> ElementTree.Element:
        element = ElementTree.Element(
            "testcase", classname=self.classname, name=self.name, time=str(self.time)
        )
        element.extend([item.xml_element() for item in (*self.failures, *self.errors)])
        return element

    def xml(self) -> bytes:
        return ElementTree.tostring(self.xml_element())


class Result:
    """The results of one or more test programs."""

    __slots__ = (
        "name",
        "num_errors",
        "num_failures",
        "num_tests",
        "system_err",
        "system_out",
        "test_case_results",
        "time",
    )

    def __init__(self, name: str, num_errors: int = 0, num_failures: int = 0, num_tests: int = 0) -> None:
        self.name = name
        self.num_errors = num_errors
        self.num_failures = num_failures
        self.num_tests = num_tests
        self.test_case_results: list[TestCaseResult] = []
        self.system_out = ""
        self.system_err = ""
        self.time = 0.0

    def accumulate(self, r: Result) -> None:
        """Add the results of another run to these results."""
        self.num_errors += r.num_errors
        self.num_failures += r.num_failures
        self.num_tests += r.num_tests
        self.time += r.time
        self.test_case_results.extend(r.test_case_results)
        self.system_out = "\n".join(filter(None, (self.system_out, r.system_out)))
        self.system_err = "\n".join(filter(None, (self.system_err, r.system_err)))

    def add_test_case_result(self, r: TestCaseResult) -> None:
        """Add a case. The counts passed to the constructor do not change."""
        self.test_case_results.append(r)

    def xml_element(self) -> bytes:
        """Return the results as an XML document."""
        element = ElementTree.Element(
            "testsuite",
            tests=str(self.num_tests),
            failures=str(self.num_failures),
            time=str(self.time),
            errors=str(self.num_errors),
            name=self.name,
        )
        element.extend([test_case_result.xml_element() for test_case_result in self.test_case_results])
        for tag, text in (("system-out", self.system_out), ("system-err", self.system_err)):
            ElementTree.SubElement(element, tag).text = _cdata(text)
        return ElementTree.tostring(element)


def read(test_file: str, test_name: str) -> Result:
    """Return the results in a file as a Result with the name `test_name`.

    If the file cannot be read, print a warning and return an empty Result.
    """
    result = Result(test_name)
    try:
        content = read_file(test_file)
        if not content:
            print(f"WARN: test result file is empty [{test_file}]")
            return result
        suites = parse_suites(content, test_file)
    except OSError as error:
        print(f"WARN: cannot read test result file [{test_file}]: {error.strerror}")
    except UnreadableResults as error:
        print(f"WARN: cannot read test result file [{test_file}]: {error}")
    else:
        path = Path(test_file)
        prefix = f"{path.absolute().parent.name}.{path.stem}"
        for suite in suites:
            result.accumulate(result_of(suite, test_name, prefix))
    return result


def result_of(suite: Suite, test_name: str, prefix: str) -> Result:
    """Convert a suite of `pipros_tools.testing` to Noetic's classes. `prefix` is prepended to case names."""
    result = Result(test_name, suite.errors, suite.failures, suite.tests)
    result.time = suite.seconds
    result.test_case_results = [_from_case(case, test_name, prefix) for case in suite.cases]
    for text, name in ((suite.stdout, "stdout"), (suite.stderr, "stderr")):
        if text:
            section = f"\n{f'[{prefix}] {name}':-<80}\n{text}"
            if name == "stdout":
                result.system_out = section
            else:
                result.system_err = section
    return result


def _from_case(case: Case, test_name: str, prefix: str) -> TestCaseResult:
    result = TestCaseResult(f"{prefix}/{case.name}")
    result.classname = f"{test_name}.{case.class_name}"
    result.time = case.seconds
    if case.outcome is Outcome.FAILURE:
        result.add_failure(TestFailure(case.kind, case.text))
    elif case.outcome is Outcome.ERROR:
        result.add_error(TestError(case.kind, case.text))
    return result


def test_failure_junit_xml(
    test_name: str,
    message: str,
    stdout: str | None = None,
    class_name: str = "Results",
    testcase_name: str = "test_ran",
) -> bytes:
    """Return the contents of a result file that reports one failed test and the reason."""
    suite, case = _one_case(test_name, class_name, testcase_name, failures=1)
    ElementTree.SubElement(case, "failure", message=escape_controls(message), type="")
    if stdout:
        ElementTree.SubElement(suite, "system-out").text = _cdata(stdout)
    return ElementTree.tostring(suite)


def test_success_junit_xml(
    test_name: str, class_name: str = "Results", testcase_name: str = "test_ran"
) -> bytes:
    """Return the contents of a result file that reports one passed test."""
    return ElementTree.tostring(_one_case(test_name, class_name, testcase_name, failures=0)[0])


test_failure_junit_xml.__test__ = test_success_junit_xml.__test__ = False  # type: ignore[attr-defined]


def _one_case(
    test_name: str, class_name: str, testcase_name: str, failures: int
) -> tuple[ElementTree.Element, ElementTree.Element]:
    suite = ElementTree.Element(
        "testsuite", tests="1", failures=str(failures), time="1", errors="0", name=test_name
    )
    case = ElementTree.SubElement(
        suite, "testcase", name=testcase_name, status="run", time="1", classname=class_name
    )
    return suite, case


def print_summary(junit_results: Result, runner_name: str = "ROSUNIT") -> None:
    """Print all cases, and the numbers of tests, errors and failures."""
    cases = "".join(
        test_case_result.description for test_case_result in junit_results.test_case_results
    ).splitlines()
    numbers = junit_results.num_tests, junit_results.num_errors, junit_results.num_failures
    print("\n".join(case_summary(cases, *numbers, runner_name)))


def read_all(filter_: Sequence[str] = ()) -> Result:
    """Return all results in the test results folder, or only the results of the packages in `filter_`."""
    total = Result("ros")
    folder = Environment.from_os().test_results_dir
    for package in sorted(path for path in folder.glob("*") if path.is_dir()):
        if not filter_ or package.name in filter_:
            for file in sorted(package.glob("*.xml")):
                total.accumulate(read(str(file), package.name))
    return total


def cdata(cdata_text: str) -> str:
    """Return the text as a CDATA section."""
    return CDATA_START + cdata_text + CDATA_END


def filter_nonprintable_text(text: str) -> str:
    """Replace each character forbidden in XML with readable text such as `&#x0007;`."""
    return escape_controls(text)


def invalid_char_replacer(m: re.Match[str]) -> str:
    """Return readable text such as `&#x0007;` for the matched character."""
    return f"&#x{ord(m.group(0)):04X};"


def _cdata(text: str) -> str:
    return cdata(filter_nonprintable_text(text))
