"""The fuzz targets, on their corpus and on mutations that are the same in every run.

`rpc` has its own file."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import pytest

from tests.fuzz import (
    bag_indexes,
    bags,
    bus_answers,
    cdr,
    cfg_results,
    cmake,
    costmap_inputs,
    definitions,
    edit_methods,
    export_names,
    expressions,
    fleet_directories,
    foxglove_requests,
    launch_files,
    lidar_streams,
    listings,
    map_files,
    mcap_files,
    mcap_indexes,
    messages,
    page_messages,
    replies,
    ros2_bags,
    rosbridge,
    rtps,
    rtps_announcements,
    strange_messages,
    wheel_files,
    yaml_texts,
)
from tests.fuzz.mutation import Target, TooSlow, bounded, corpus, mutations


@dataclass(frozen=True)
class Subject:
    """A target for a test: its creation and cleanup, and the number of mutations."""

    make: Callable[[], Target]
    words: Sequence[bytes]
    count: int


SUBJECTS = {
    "bags": Subject(lambda: bags.target, bags.WORDS, 300),
    "mcap_files": Subject(lambda: mcap_files.target, mcap_files.WORDS, 150),
    "bag_indexes": Subject(lambda: bag_indexes.target, bag_indexes.WORDS, 60),
    "mcap_indexes": Subject(lambda: mcap_indexes.target, mcap_indexes.WORDS, 40),
    "export_names": Subject(lambda: export_names.target, export_names.WORDS, 100),
    "definitions": Subject(lambda: definitions.target, definitions.WORDS, 700),
    "messages": Subject(lambda: messages.target, (), 1500),
    "strange_messages": Subject(lambda: strange_messages.target, strange_messages.WORDS, 200),
    "yaml_texts": Subject(lambda: yaml_texts.target, yaml_texts.WORDS, 500),
    "expressions": Subject(lambda: expressions.target, expressions.WORDS, 1500),
    "cfg_results": Subject(lambda: cfg_results.target, cfg_results.WORDS, 1500),
    "launch_files": Subject(lambda: launch_files.target, launch_files.WORDS, 500),
    "lidar_streams": Subject(lambda: lidar_streams.target, lidar_streams.WORDS, 500),
    "cmake": Subject(lambda: cmake.target, cmake.WORDS, 500),
    "edit_methods": Subject(lambda: edit_methods.target, edit_methods.WORDS, 200),
    "bus_answers": Subject(lambda: bus_answers.target, bus_answers.WORDS, 300),
    "page_messages": Subject(lambda: page_messages.target, page_messages.WORDS, 200),
    "foxglove_requests": Subject(lambda: foxglove_requests.target, foxglove_requests.WORDS, 500),
    "rosbridge": Subject(lambda: rosbridge.target, rosbridge.WORDS, 500),
    "rtps": Subject(lambda: rtps.target, rtps.WORDS, 500),
    "rtps_announcements": Subject(lambda: rtps_announcements.target, rtps_announcements.WORDS, 100),
    "fleet_directories": Subject(lambda: fleet_directories.target, fleet_directories.WORDS, 500),
    "ros2_bags": Subject(lambda: ros2_bags.target, ros2_bags.WORDS, 60),
    "cdr": Subject(lambda: cdr.target, (), 1000),
    "map_files": Subject(lambda: map_files.target, map_files.WORDS, 150),
    "costmap_inputs": Subject(lambda: costmap_inputs.target, costmap_inputs.WORDS, 150),
    "wheel_files": Subject(lambda: wheel_files.target, wheel_files.WORDS, 150),
    "replies": Subject(replies.Replies, replies.WORDS, 500),
    "listings": Subject(listings.Listings, listings.WORDS, 40),
}


@pytest.fixture(params=SUBJECTS)
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def target(name: str) -> Iterator[Target]:
    made = SUBJECTS[name].make()
    yield made
    if isinstance(made, (replies.Replies, listings.Listings)):
        made.close()


def test_former_findings_stay_fixed(name: str, target: Target) -> None:
    inputs = corpus(name)
    assert inputs
    for data in inputs:
        with bounded():
            target(data)


@pytest.mark.filterwarnings("ignore::SyntaxWarning")  # a warning of Python's parser about `1if x`
def test_mutations_raise_only_documented_errors(name: str, target: Target) -> None:
    subject = SUBJECTS[name]
    for data in itertools.islice(mutations(corpus(name), seed=1, words=subject.words), subject.count):
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
