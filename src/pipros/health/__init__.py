"""Diagnosis of a machine's setup and of a running system, with a cure for each problem.

`gather_machine` and `gather_system` read the environment, the network and every registered node into plain
values. `machine_checks` and `graph_checks` are pure: values in, findings out. `pipros doctor` prints the
findings.
"""
