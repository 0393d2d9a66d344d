"""The recorded answers of roscpp, with which all readers of parameters are compared, are those of roscpp."""

from __future__ import annotations

import json
import subprocess

from pipros.basics.env import Environment
from pipros.node import Node
from tests.golden.test_roscpp_parameters import ROWS, value_of
from tests.support.environments import file_of_tests, genuine_environment
from tests.support.ros import RosSystem
from tests.support.roscpp import compile_program


def test_roscpp_converts_parameters_as_recorded(ros: RosSystem) -> None:
    program = compile_program(file_of_tests("golden/roscpp_parameters.cpp"))
    ros.serve_master()
    with Node("setter", environment=Environment(master_uri=ros.master_uri)) as node:
        node.params.set("/rows", {f"r{index}": value_of(row) for index, row in enumerate(ROWS)})
    environment = genuine_environment(ros.home, ros.master_uri)
    ended = subprocess.run([program], env=environment, capture_output=True, text=True, timeout=60, check=True)

    answers = [json.loads(line) for line in ended.stdout.splitlines()]
    assert answers == [{kind: row[kind] for kind in row if kind != "value"} for row in ROWS]
