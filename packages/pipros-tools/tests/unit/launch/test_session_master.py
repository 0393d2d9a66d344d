from __future__ import annotations

import pytest

from pipros_tools.launch.console import Console
from pipros_tools.launch.model import LaunchError
from pipros_tools.launch.session_master import choose_run_id


@pytest.mark.parametrize(
    ("requested", "running", "chosen"),
    [("one", None, "one"), ("one", "", "one"), ("one", "one", "one"), (None, "two", "two")],
)
def test_a_requested_run_id_precedes_that_of_the_master(
    requested: str | None, running: str | None, chosen: str
) -> None:
    assert choose_run_id(requested, running, Console()) == chosen


@pytest.mark.parametrize("running", [None, ""])
def test_without_either_a_new_run_id_is_created(running: str | None) -> None:
    assert choose_run_id(None, running, Console()) != choose_run_id(None, running, Console())


def test_a_run_id_of_the_master_that_is_not_a_folder_name_is_not_used(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert "/" not in choose_run_id(None, "../../etc", Console())
    assert "/run_id on the parameter server must be" in capsys.readouterr().err


@pytest.mark.parametrize(("requested", "running", "complaint"), [
    ("../../etc", None, "--run_id must be up to 64 letters"),
    ("one", "two", "run_id on parameter server does not match declared run_id: two vs one"),
])  # fmt: skip
def test_an_invalid_requested_run_id_is_refused(requested: str, running: str | None, complaint: str) -> None:
    with pytest.raises(LaunchError, match=complaint):
        choose_run_id(requested, running, Console())
