"""Call functions of catkin's modules with valid and invalid arguments; see `examine_api_nodes.py`."""

import contextlib
import io
import os
import pathlib
import tempfile

from examination import begin, examine

PASSED = """<testsuite name="s" tests="3" errors="0" failures="1"><testcase name="t1" classname="c"/>
<testcase name="t2" classname="c"><failure type="f">bad</failure></testcase>
<testcase name="t3" classname="c"><skipped/></testcase></testsuite>"""
BROKEN = """<testsuites tests="1" errors="1" failures="0" skip="1"><testsuite name="q">
<testcase name="e1" classname="k"><error>boom</error></testcase></testsuite></testsuites>"""
MANIFEST = """<package format="2"><name>{}</name><version>0.1.0</version><description>d</description>
<maintainer email="me@example.org">me</maintainer><license>l</license></package>"""


def write(path, text):
    file = pathlib.Path(path)
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)


def printed(function):
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
        result = function()
    return result, out.getvalue()


def kind_of_error(function):
    try:
        return function()
    except Exception as error:
        return type(error).__name__


def examine_results():
    import catkin.test_results as results
    import catkin.tidy_xml as tidy

    begin("results")
    for name, text in (("a/x.xml", PASSED), ("y.xml", BROKEN), ("z.xml", "<other/>"), ("n.xml", "nonsense")):
        write(f"results/{name}", text)
        for read in (results.read_junit, results.read_junit2):
            examine(name, lambda: kind_of_error(lambda: read(f"results/{name}")))
    examine("missing", lambda: kind_of_error(lambda: results.read_junit("results/none.xml")))
    for read in (results.test_results, results.test_results2):
        examine("all", lambda: sorted(read("results").items()))
    three, four = {"a": (3, 0, 1)}, {"a": (3, 0, 1, 1), "b": (1, 1, 0, 0), "c": (2, 0, 0, 0)}
    for counts in (three, four):
        for add in (results.aggregate_results, results.aggregate_results2):
            examine("sum", lambda: add(counts))
        for show in (results.print_summary, results.print_summary2):
            for options in ({}, {"show_stable": True}, {"show_unstable": False}):
                examine(f"summary {options}", lambda: printed(lambda: show(counts, **options)))
    examine("no skipped", lambda: printed(lambda: results.print_summary2(four, print_skipped=False)))
    examine("ensured", lambda: printed(lambda: results.ensure_junit_result_exist("results/made.xml")))
    examine("made", lambda: sorted(os.listdir("results")))
    examine("counted", lambda: results.read_junit("results/MISSING-made.xml"))
    results.remove_junit_result("results/made.xml")
    examine("removed", lambda: sorted(os.listdir("results")))
    examine("there", lambda: results.ensure_junit_result_exist("results/a/x.xml"))
    for text in ("<a>\x01\x02ok</a>", "<a>fine</a>"):
        write("tidied.xml", text)
        examine("tidy", lambda: (tidy.tidy_xml("tidied.xml"), pathlib.Path("tidied.xml").read_text()))
    examine("tidy", lambda: tidy.tidy_xml("none.xml"))


def examine_workspaces():
    import catkin.find_in_workspaces
    import catkin.workspace

    begin("workspaces")
    write("sources/deep/p/package.xml", MANIFEST.format("p"))
    write("sources/deep/p/x.txt", "")
    write("over/share/p/here.txt", "")
    write("over/lib/p/program", "")
    write("over/.catkin", f"{os.getcwd()}/sources;{os.getcwd()}/none")
    write("under/share/p/x.txt", "")
    write("under/etc/p/config", "")
    write("under/.catkin", "")
    spaces = [f"{os.getcwd()}/{name}" for name in ("over", "under")]
    here = os.getcwd()

    def shown(paths):
        return [path.replace(here, "…") for path in paths]

    find = catkin.find_in_workspaces.find_in_workspaces
    for arguments in (
        (None, None, None),
        (["share"], None, None),
        (["share"], "p", None),
        (["share"], "p", "x.txt"),
        (None, "p", None),
        (["bin"], "p", None),
        (["libexec"], None, None),
        (["libexec"], "p", None),
        (["nonsense"], None, None),
        ([], "p", None),
        (["etc", "include"], "p", None),
        (None, None, "p"),
        (None, "p", "x.txt"),
    ):
        looked = []
        examine(
            f"{arguments}",
            lambda: (shown(find(*arguments, _workspaces=spaces, considered_paths=looked)), shown(looked)),
        )
    for option in ("first_match_only", "first_matching_workspace_only"):
        examine(option, lambda: shown(find(["share"], "p", _workspaces=spaces, **{option: True})))
    for space in (*spaces, f"{here}/none"):
        examine("sources", lambda: kind_of_error(lambda: shown(catkin.workspace.get_source_paths(space))))


with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    examine_results()
    examine_workspaces()
    os.chdir("/")
