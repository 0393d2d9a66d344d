"""The fuzz target of XML-RPC over HTTP, on its corpus and on mutations that are the same in every run."""

import itertools

from tests.fuzz import rpc
from tests.fuzz.mutation import corpus, mutations


def test_former_findings_stay_fixed() -> None:
    inputs = corpus("rpc")
    assert inputs
    for data in inputs:
        rpc.target(data)


def test_mutations_raise_only_documented_errors() -> None:
    for data in itertools.islice(mutations(corpus("rpc"), seed=1, words=rpc.WORDS), 1000):
        rpc.target(data)
