"""rostest's test nodes: `<test pkg="rostest" type="hztest" …>` and others.

Each node reads its expectations from private parameters, checks them, and writes a result file like any
test script.
"""
