"""The test nodes that `<test pkg="rostest" type="hztest" …>` and its kind start.

Each is a node that reads what it is to check from its private parameters, checks it, and leaves
a result file as any test script does.
"""
