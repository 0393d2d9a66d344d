"""rostest's test nodes: `<test pkg="rostest" type="hztest" …>` and others.

Each node reads the expectations from its private parameters, checks them, and writes a result file like any
test script.
"""
