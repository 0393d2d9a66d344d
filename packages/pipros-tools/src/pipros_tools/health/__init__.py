"""Diagnose a machine's setup and a running system, and recommend a solution for each problem.

`gather_machine` and `gather_system` query the environment, the network and every registered node, and return
plain values. `machine_checks` and `graph_checks` perform no I/O: they take these values and return findings.
`pipros doctor` prints the findings.
"""
