"""The fuzz targets, on their corpus and on mutations that are the same in every run.

`rpc` has its own file."""

import itertools
from collections.abc import Iterator
from importlib import import_module

import pytest

from tests.fuzz.mutation import Target, TooSlow, bounded, corpus, mutations

COUNTS = {
    "bags": 300, "mcap_files": 150, "bag_indexes": 60, "mcap_indexes": 40, "export_names": 100,
    "definitions": 700, "messages": 1500, "strange_messages": 200, "yaml_texts": 500, "expressions": 1500,
    "cfg_results": 1500, "launch_files": 500, "lidar_streams": 500, "cmake": 500, "edit_methods": 200,
    "bus_answers": 300, "page_messages": 200, "foxglove_requests": 500, "rosbridge": 500, "rtps": 500,
    "rtps_announcements": 100, "fleet_directories": 500, "ros2_bags": 60, "cdr": 1000, "map_files": 150,
    "costmap_inputs": 150, "wheel_files": 150, "replies": 500, "listings": 40,
}  # fmt: skip
"""The number of mutations of each target, which is the `target` of its module, or of its class."""
CLASSES = {"replies": "Replies", "listings": "Listings"}


@pytest.fixture(params=COUNTS)
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def target(name: str) -> Iterator[Target]:
    made = getattr(import_module(f"tests.fuzz.{name}"), CLASSES.get(name, "target"))
    if name not in CLASSES:
        yield made
        return
    instance = made()
    yield instance
    instance.close()


def test_former_findings_stay_fixed(name: str, target: Target) -> None:
    inputs = corpus(name)
    assert inputs
    for data in inputs:
        with bounded():
            target(data)


@pytest.mark.filterwarnings("ignore::SyntaxWarning")  # a warning of Python's parser about `1if x`
def test_mutations_raise_only_documented_errors(name: str, target: Target) -> None:
    words = getattr(import_module(f"tests.fuzz.{name}"), "WORDS", ())
    for data in itertools.islice(mutations(corpus(name), seed=1, words=words), COUNTS[name]):
        with bounded():
            target(data)


def test_an_input_that_takes_too_long_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tests.fuzz.mutation.SECONDS_FOR_ONE", 0.05)

    def run_for_ever(_: bytes) -> None:
        with bounded():
            while True:
                pass

    with pytest.raises(TooSlow):
        run_for_ever(b"")
