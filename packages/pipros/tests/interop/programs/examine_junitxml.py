"""Result files written and read by rosunit.junitxml, and its summary."""

from pathlib import Path

from examination import begin, examine

from rosunit import junitxml

FILE = """<testsuite name="n" tests="2" failures="1" errors="0" time="2.5">
<testcase name="case" classname="k.C" time="1.5"><failure type="AssertionError">why</failure></testcase>
<testcase name="ok" classname="k" time="1"/>
<system-out>out</system-out><system-err>err</system-err></testsuite>"""


def outcome(result):
    cases = [
        (
            test_case_result.name, test_case_result.classname, test_case_result.time, test_case_result.passed,
            [(info.type, info.text) for info in test_case_result.failures],
        )
        for test_case_result in result.test_case_results
    ]  # fmt: skip
    sums = result.num_tests, result.num_errors, result.num_failures, result.time
    return result.name, sums, cases, result.system_out, result.system_err


def made():
    case = junitxml.TestCaseResult("case")
    case.classname = "k.C"
    examine("passed", lambda: (case.passed, case.description, case.xml()))
    case.add_failure(junitxml.TestFailure("AssertionError", "f<\x01>"))
    case.add_error(junitxml.TestError("ValueError", "e"))
    examine("broken", lambda: (case.passed, case.description, case.xml()))
    result = junitxml.Result("n", 1, 2, 3)
    result.system_out = "said"
    examine("result", lambda: (outcome(result), result.xml_element()))
    examine("failure", lambda: junitxml.test_failure_junit_xml("T", "M<sg>"))
    examine("failure named", lambda: junitxml.test_failure_junit_xml("T", "M", "out", "C", "tc"))
    examine("success", lambda: junitxml.test_success_junit_xml("T"))


def read():
    folder = Path("results")
    folder.mkdir(exist_ok=True)
    file = folder / "file.xml"
    file.write_text(FILE)
    result = junitxml.read(str(file), "name")
    examine("read", lambda: outcome(result))
    result.accumulate(junitxml.read(str(file), "other"))
    examine("accumulated", lambda: outcome(result))
    junitxml.print_summary(result)
    for text in ("", "<a/>", "junk"):
        file.write_text(text)
        examine(f"read {text}", lambda: outcome(junitxml.read(str(file), "name")))
    file.unlink()
    examine("read nothing", lambda: outcome(junitxml.read(str(file), "name")))


for part in (made, read):
    begin(part.__name__)
    part()
