from __future__ import annotations

import pytest

from pipros_workspace.catkin.project import Project
from pipros_workspace.catkin.project import TestEntry as Entry
from pipros_workspace.make_targets import is_wanted, label, names, results_label

ROSTEST = Entry("rostest", "/src/p/test/x.test", (), "test/x.test")


@pytest.mark.parametrize(("test", "name", "results"), [
    (ROSTEST, "test_x.test", "test_x"),
    (Entry("rostest", "", ("a:=1", "b:=c/d"), "test/x.test"), "x__a_1__b_c_d.test", "x__a_1__b_c_d"),
    (Entry("rostest", "", ("a:=0.5",), "x.test"), "x__a_0.5.test", "x__a_0"),
    (Entry("roslaunch", "", ("-i", "a:=1"), "launch/x.launch"), "x__a_1.launch", "x__a_1"),
    (Entry("roslaunch", "", ("-i",), "launch"), "launch", "launch"),
    (Entry("python", "", (), "test/sub/test_it.py"), "test.sub.test_it.py", "test"),
    (Entry("gtest", "my_test", target="my_test"), "my_test", "my_test"),
])  # fmt: skip
def test_tests_have_the_names_of_catkin(test: Entry, name: str, results: str) -> None:
    assert (label(test), results_label(test)) == (name, results)


@pytest.mark.parametrize(("targets", "wanted"), [
    (["run_tests"], True), (["test"], True), (["run_tests_p"], True), (["run_tests_p_rostest"], True),
    (["run_tests_p_rostest_test_x.test"], True), (["run_tests_other"], False),
    (["run_tests_p_nosetests"], False), (["all", "install"], False), ([], False),
])  # fmt: skip
def test_a_target_selects_its_tests(targets: list[str], wanted: bool) -> None:
    assert is_wanted(ROSTEST, "p", targets) is wanted


def test_all_targets_are_known() -> None:
    project = Project("p", "/src/p", "/src/p/CMakeLists.txt", tests=[ROSTEST], targets={"docs"})
    known = set(names({"p": project}))
    assert {"all", "install", "p", "docs", "run_tests_p", "clean_test_results_p"} <= known
    assert {"run_tests_p_rostest", "run_tests_p_rostest_test_x.test"} <= known
