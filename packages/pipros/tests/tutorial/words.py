"""Commands of the case study, and their output, as text or patterns."""

TALKER = "rosrun composiv_tryouts composiv_talker.py"
LISTENER = "rosrun composiv_tryouts composiv_listener.py"
TEST = "rosrun composiv_tryouts test_talker.py"
LAUNCH = "roslaunch composiv_tryouts composiv_tryout.launch"
ROSTEST = "rostest composiv_tryouts composiv_tryout.launch"

CORE_IS_UP = r"started core service \[/rosout\]"
SAID = r"\[INFO\] \[\d{10}\.\d{6}\]: %25"
HEARD = r"\[INFO\] \[\d{10}\.\d{6}\]: Battery level of vehicle: %25"

PASSED_TEST = (
    "[Testcase: test_talker_publishing] ... ok\n"
    "-------------------------------------------------------------\n"
    "SUMMARY:\n"
    "\x1b[32m * RESULT: SUCCESS\x1b[0m\n"
    " * TESTS: 1\n"
    " * ERRORS: 0 []\n"
    " * FAILURES: 0 []\n"
    "\n"
)
PASSED_ROSTEST = (
    "[ROSTEST]-----------------------------------------------------------------------\n"
    "\n"
    "[composiv_tryouts.rosunit-test_talker/test_talker_publishing][passed]\n"
    "\n"
    "SUMMARY\n"
    "\x1b[32m * RESULT: SUCCESS\x1b[0m\n"
    " * TESTS: 1\n"
    " * ERRORS: 0\n"
    " * FAILURES: 0\n"
    "\n"
    "rostest log file is in "
)
FAILED_ROSTEST = (
    r"^\[Testcase: testtest_talker\] \.\.\. ok$",
    r"^\[composiv_tryouts\.rosunit-test_talker/test_talker_publishing\]\[FAILURE\]-+$",
    r"^False is not true$", r"test_talker\.py\", line 22, in test_talker_publishing$", r"^SUMMARY$",
    r"^\x1b\[1;31m \* RESULT: FAIL\x1b\[0m$", r"^ \* TESTS: 1$", r"^ \* ERRORS: 0$",
    r"^\x1b\[1;31m \* FAILURES: 1\x1b\[0m$",
)  # fmt: skip
