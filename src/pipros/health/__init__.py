"""Diagnoses a machine's setup and a running system, and recommends a solution for each problem.

`gather_machine` and `gather_system` read the environment, the network and every registered node into plain
values. `machine_checks` and `graph_checks` do no I/O: they take these values and return findings. `pipros
doctor` prints the findings.
"""
