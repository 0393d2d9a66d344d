"""What is wrong with a machine's setup or with a running system, and what to do about it.

`gather_machine` and `gather_system` read the environment, the network and every registered node into plain
values. `machine_checks` and `graph_checks` are pure: values in, findings out. `pipros doctor` prints them.
"""
