"""Use the Python API of rosunit and rostest, and print the outcomes; for both implementations.

examine_rostest.py FOLDER: a package `programs` with `prog`, `prog.py` and `t.test`
"""

import contextlib
import io
import json
import os
import re
import sys
import tempfile
import unittest
import xml.dom.minidom

import roslaunch.config
import roslaunch.core
import rostest
import rostest.rostest_main
import rostest.rostest_parent
import rostest.rostestutil
import rostest.runner
import rosunit
import rosunit.baretest
import rosunit.core
import rosunit.junitxml
import rosunit.pyunit
import rosunit.xmlrunner

FOLDER = sys.argv[1]
TESTS = os.path.join(FOLDER, "t.test")
UNSTABLE = re.compile(r"\d+\.\d+|0x[0-9a-f]+|\d{10,}")


def examine(label, function, output=True):
    """Print the outcome of a call, and with `output` its output."""
    streams = io.StringIO(), io.StringIO()
    try:
        with contextlib.redirect_stdout(streams[0]), contextlib.redirect_stderr(streams[1]):
            record = [repr(function())]
        record += [stream.getvalue() for stream in streams] if output else []
    except SystemExit as end:
        record = ["exit", end.code]
    except Exception as error:
        record = ["error", str(error).splitlines()[0]]
    record = [UNSTABLE.sub("N", part) if isinstance(part, str) else part for part in record]
    print("@@" + json.dumps([label, record]), flush=True)


class Two(unittest.TestCase):
    def test_a(self):
        print("out")

    def test_b(self):
        self.fail("no")


def ran(kind):
    result = unittest.TestResult()
    with contextlib.redirect_stdout(io.StringIO()):
        unittest.TestLoader().loadTestsFromTestCase(kind)(result)
    return result


def numbers(result):
    return result.num_tests, result.num_failures, result.num_errors


def examine_rosunit():
    examine("results file", lambda: rosunit.xml_results_file("p", "a b/c&d"))
    examine("folder", lambda: os.path.isdir(os.path.dirname(rosunit.xml_results_file("q", "a"))))
    examine(
        "environment",
        lambda: rosunit.xml_results_file("p", "a", True, env={"ROS_TEST_RESULTS_DIR": FOLDER + "/r"}),
    )
    for path in ("/a/b/c/d.test", "/q/x.y.test"):
        examine("name of " + path, lambda: rosunit.rostest_name_from_path("/a/b", path))
    result = ran(Two)
    examine("summary", lambda: rosunit.print_unittest_summary(result))
    total = rosunit.junitxml.Result("n", 1, 2, 5)
    case = rosunit.junitxml.TestCaseResult("c")
    case.add_failure(rosunit.junitxml.TestFailure("T", "text"))
    total.add_test_case_result(case)
    examine("runner summary", lambda: rosunit.print_runner_summary(result, total))
    examine(
        "good summary",
        lambda: rosunit.print_runner_summary(unittest.TestResult(), rosunit.junitxml.Result("n")),
    )
    logs = rosunit.core.printlog, rosunit.core.printlog_bold, rosunit.core.printerrlog
    for log in (*logs, rostest.rostestutil.printlog):
        examine("log", lambda: log("a %s", 3))
        examine("plain log", lambda: log("a %s"))
    examine("cdata", lambda: [rosunit.xmlrunner.cdata("x"), rosunit.junitxml.cdata("y")])
    examine("unprintable", lambda: rosunit.junitxml.filter_nonprintable_text("a\x01b\u00e9\ufffe"))
    examine("xml runner", written, output=False)
    file = os.path.join(FOLDER, "unitrun.xml")
    examine("unitrun", lambda: rosunit.unitrun("p", "t", Two, sysargs=["x", "--gtest_output=xml:" + file]))
    examine("read", lambda: numbers(rosunit.junitxml.read(file, "t")))
    results = os.environ["ROS_TEST_RESULTS_DIR"] = tempfile.mkdtemp(dir=FOLDER)
    os.mkdir(os.path.join(results, "p"))
    os.replace(file, os.path.join(results, "p", "a.xml"))
    examine("read all", lambda: numbers(rosunit.junitxml.read_all()))
    examine("read some", lambda: numbers(rosunit.junitxml.read_all(["q"])))
    case = rosunit.baretest.BareTestCase(os.path.join(FOLDER, "prog.py"), ["q"], package_name="pp")
    examine(
        "bare", lambda: [case.args, case.test_name, case.package, case.time_limit, case.retry, case.text_mode]
    )
    text = rosunit.baretest.BareTestCase(os.path.join(FOLDER, "prog"), [], text_mode=True, time_limit=3)
    examine("bare text", lambda: [text.args, text.package, text.test_name, text.time_limit])


def written():
    stream = io.StringIO()
    runner = rosunit.xmlrunner.XMLTestRunner(stream)
    result = runner.run(unittest.TestLoader().loadTestsFromTestCase(Two))
    suite = xml.dom.minidom.parseString(stream.getvalue()).documentElement  # noqa: S318
    names = [case.getAttribute("name") for case in suite.getElementsByTagName("testcase")]
    kept = [suite.getAttribute(name) for name in ("tests", "failures", "errors")]
    return suite.tagName, kept, names, result.testsRun, result.wasSuccessful(), runner.path


def examine_rostest():
    examine("fail", lambda: rostest.runner.failRunner("n", "why")(Two("test_a")))
    examine("twice", lambda: rostest.runner.failDuplicateRunner("n")(Two("test_a")))
    examine(
        "before",
        lambda: [
            rostest.runner.getConfig(), numbers(rostest.runner.getResults()), rostest.rostestutil.getErrors(),
        ],
    )  # fmt: skip
    bad = os.path.join(FOLDER, "bad", "r.xml")
    examine("bad name", lambda: rostest.rostest_main.write_bad_filename_failure("/x.test", bad, "out"))
    examine("bad results", lambda: numbers(rosunit.junitxml.read(bad, "out")))
    kind = rostest.runner.createUnitTest("programs", TESTS)
    names = sorted(
        name for name in dir(kind) if name.startswith("test") and name not in ("test_parent", "test_file")
    )
    examine("class", lambda: [kind.__name__, kind.__module__, names])
    result = ran(kind)
    examine("ran", lambda: [result.testsRun, len(result.failures), len(result.errors)])
    examine("which", lambda: sorted(test.id().rpartition(".")[2] for test, _ in result.failures))
    total = rostest.runner.getResults()
    examine("results", lambda: [numbers(total), [case.name for case in total.test_case_results]])
    examine("configuration", lambda: [test.test_name for test in rostest.runner.getConfig().tests])
    examine("summary", lambda: rostest.runner.printRostestSummary(result, total), output=False)
    examine("errors", lambda: rostest.rostestutil.getErrors())
    config = roslaunch.config.load_config_default([TESTS], None)
    parent = rostest.rostest_parent.ROSTestLaunchParent(config, [TESTS])
    examine("too early", parent.launch)
    examine("set up", parent.setUp, output=False)
    examine("launch", lambda: [len(part) for part in parent.launch()], output=False)
    examine("master", lambda: roslaunch.core.Master(uri=config.master.uri).is_running())
    examine("run", lambda: parent.run_test(config.tests[0]), output=False)
    examine("run none", lambda: parent.run_test(config.tests[1]), output=False)
    examine("tear down", parent.tearDown, output=False)
    examine("no master", lambda: roslaunch.core.Master(uri=config.master.uri).is_running())
    examine("no configuration", lambda: rostest.rostest_parent.ROSTestLaunchParent(None, []))


if __name__ == "__main__":
    examine_rosunit()
    examine_rostest()
