"""The classes of rosunit and rostest that scripts use, on a machine without genuine ROS."""

import io
import sys
import unittest
from pathlib import Path

import pytest

import rosunit
import rosunit.baretest
import rosunit.junitxml
import rosunit.xmlrunner


class Two(unittest.TestCase):
    """Run by the tests below."""

    __test__ = False

    def test_a(self) -> None:
        print("printed")

    def test_b(self) -> None:
        self.fail("no")


@pytest.fixture
def results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "results"
    monkeypatch.setenv("ROS_TEST_RESULTS_DIR", str(folder))
    return folder


def run_quietly(case: unittest.TestCase | unittest.TestSuite) -> unittest.TestResult:
    result = unittest.TestResult()
    case(result)
    return result


def test_a_runner_writes_results_to_a_stream_or_a_file(tmp_path: Path) -> None:
    load = unittest.TestLoader().loadTestsFromTestCase
    stream = io.StringIO()
    assert not rosunit.xmlrunner.XMLTestRunner(stream).run(load(Two)).wasSuccessful()
    assert stream.getvalue().startswith('<testsuite errors="0" failures="1"')
    runner = rosunit.xmlrunner.XMLTestRunner()
    runner.path = str(tmp_path)
    runner.run(load(Two))
    read = rosunit.junitxml.read(str(tmp_path / "TEST-unittest.suite.TestSuite.xml"), "t")
    assert (read.num_tests, read.num_failures) == (2, 1)


def test_the_path_of_results_has_no_blanks_and_its_folder_is_made(results: Path) -> None:
    assert rosunit.xml_results_file("p", "a b/c&d") == str(results / "p" / "rosunit-a_b_c_d.xml")
    assert (results / "p").is_dir()


def test_a_launch_file_is_named_after_its_path() -> None:
    assert rosunit.rostest_name_from_path("/ws/pkg", "/ws/pkg/test/x.test") == "test_x"
    assert rosunit.rostest_name_from_path("/ws/pkg", "/else/x.y.test") == "_else_x.y"


def test_all_results_are_added_up(results: Path) -> None:
    for package in ("p", "q"):
        file = rosunit.xml_results_file(package, "t")
        rosunit.create_xml_runner(package, "t", file).run(unittest.TestLoader().loadTestsFromTestCase(Two))
    assert (results / "q").is_dir()
    assert rosunit.junitxml.read_all().num_tests == 4
    assert rosunit.junitxml.read_all(["q"]).num_failures == 1


def test_a_program_is_a_case_that_leaves_results(results: Path, tmp_path: Path) -> None:
    program = tmp_path / "cases.py"
    program.write_text(
        f"#!{sys.executable}\n"
        "import unittest, rosunit\n"
        "class Cases(unittest.TestCase):\n"
        "    def test_one(self): self.assertEqual(1, 2)\n"
        "rosunit.unitrun('p', 'cases', Cases)\n"
    )
    program.chmod(0o755)
    case = rosunit.baretest.BareTestCase(str(program), [], retry=1, package_name="p")
    assert case.test_name == "cases.py"
    assert run_quietly(case).wasSuccessful()  # it ran, and its results are those of a failure
    assert (case.results.num_tests, case.results.num_failures, case.retry) == (1, 1, 0)
    assert results.is_dir()


@pytest.mark.needs("first lines")
def test_a_program_that_takes_too_long_or_leaves_nothing_is_a_failure(results: Path, tmp_path: Path) -> None:
    program = tmp_path / "sleeps"
    program.write_text("#!/bin/sh\nexec sleep 100\n")
    program.chmod(0o755)
    case = rosunit.baretest.BareTestCase(str(program), [], time_limit=0.2, package_name="p")
    with pytest.raises(rosunit.baretest.TestTimeoutException):
        case.runTest()
    program.write_text("#!/bin/sh\n")
    (failed, text), *_ = run_quietly(case).failures
    assert failed is case
    assert "did not generate test results" in text
    assert results.is_dir()


def test_a_summary_names_the_programs_that_could_not_be_run(capsys: pytest.CaptureFixture[str]) -> None:
    rosunit.print_runner_summary(run_quietly(Two("test_b")), rosunit.junitxml.Result("n"))
    printed = capsys.readouterr().out
    assert "[test_b][failed]" in printed
    assert " * FAILURES: 1" in printed
    assert printed.endswith("ERROR: The following tests failed to run:\n * test_b\n\n")


def test_lazily_loaded_modules_are_attributes_of_their_packages() -> None:
    assert rosunit.rosunit_main.BareTestCase is rosunit.baretest.BareTestCase
    with pytest.raises(AttributeError, match="nope"):
        _ = rosunit.nope
