"""The fuzz targets of messages on their corpus and on some mutations of it, the same in every run."""

from __future__ import annotations

import itertools

import pytest

from tests.fuzz import definitions, messages
from tests.fuzz.mutation import Target, corpus, mutations

TARGETS = {"definitions": (definitions.target, definitions.WORDS), "messages": (messages.target, ())}


@pytest.mark.parametrize("name", TARGETS)
def test_what_was_once_found_stays_fixed(name: str) -> None:
    target, _ = TARGETS[name]
    inputs = corpus(name)
    assert inputs
    for data in inputs:
        target(data)


@pytest.mark.parametrize("name", TARGETS)
def test_mutations_meet_the_promised_errors_only(name: str) -> None:
    target: Target
    target, words = TARGETS[name]
    for data in itertools.islice(mutations(corpus(name), seed=1, words=words), 1500):
        target(data)
