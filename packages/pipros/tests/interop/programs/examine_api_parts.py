"""Types of fields, definitions given in parts, addresses, result files; see `examine_api_nodes.py`."""

import contextlib
import io
import os
import sys
import tempfile
import warnings

from examination import begin, examine
from std_msgs.msg import String

import genmsg.msgs
import roslib.msgs
import roslib.rosenv
import rospy.msg
import rosunit.junitxml

warnings.simplefilter("ignore")

TYPES = ["a[", "string[", "a]", "a[]]", "a[[]", "a[3", "[", "[]", "[3]", "a[]b", "a[b]", "a[-1]", "a[3]"]
TYPES += ["a[][]", "a/b[", "a[]", "int32[", "time[x", "a[+1]", "a[1_0]"]
HEADERS = ["Header", "Header[]", "std_msgs/Header", "std_msgs/Header[]", "std_msgs/Header[2]"]
HEADERS += ["roslib/Header[]"]
SUITES = (
    '<testsuite tests="3" errors="1" failures="0" name="n" time="1"></testsuite>',
    '<testsuite tests="3" errors="1" failures="2"><testcase classname="c" name="a" time="1"/></testsuite>',
    '<testsuites><testsuite tests="3" errors="1"/><testsuite tests="1" failures="1"/></testsuites>',
    '<testsuite tests="1" errors="2"/>',
    '<testsuite errors="2"/>',
    "<testsuite/>",
)
ARGUMENTS = (
    ["__master:="], ["__master:=a:=b"], ["__master:=http://x:1", "__master:=http://y:2"],
    ["__master:=http://x:1"], ["x:=y"],
)  # fmt: skip


def types():
    for kind in TYPES:
        examine(f"parse_type {kind}", lambda: genmsg.msgs.parse_type(kind))
        examine(f"Field {kind}", lambda: sorted(vars(genmsg.msgs.Field("f", kind)).items()))
        examine(f"MsgSpec {kind}", lambda: genmsg.msgs.MsgSpec([kind], ["n"], [], "", "p/N").types)
        examine(f"roslib parse_type {kind}", lambda: roslib.msgs.parse_type(kind))
    for kind in HEADERS:
        examine(f"header {kind}", lambda: genmsg.msgs.Field("foo", kind).is_header)
        examine(f"roslib header {kind}", lambda: roslib.msgs.is_header_type(kind))


def addresses():
    for arguments in ARGUMENTS:
        sys.argv = ["program", *arguments]
        examine(f"process {arguments}", lambda: roslib.rosenv.get_master_uri(False, {}))
        examine(f"given {arguments}", lambda: roslib.rosenv.get_master_uri(False, {}, arguments))


def results():
    for suite in SUITES:
        handle, path = tempfile.mkstemp()
        os.write(handle, suite.encode())
        os.close(handle)

        def numbers():
            with contextlib.redirect_stdout(io.StringIO()):
                found = rosunit.junitxml.read(path, "name")
            return found.num_tests, found.num_errors, found.num_failures, len(found.test_case_results)

        examine(suite, numbers)


def buffers():
    closed = io.BytesIO()
    closed.close()
    for label, buffer in (("none", None), ("text", "x"), ("closed", closed), ("short", io.BytesIO(b"\0\0"))):
        examine(label, lambda: rospy.msg.deserialize_messages(buffer, [], String))
    buffer = io.BytesIO()
    rospy.msg.serialize_message(buffer, 1, String("x"))
    examine("no class", lambda: rospy.msg.deserialize_messages(buffer, [], None))


for part in (types, addresses, results, buffers):
    begin(part.__name__)
    part()
