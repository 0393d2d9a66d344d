"""The test nodes in the package rostest, such as hztest: `<test pkg="rostest" type="hztest" …>`.

Each node reads its expectations from private parameters, checks them, and writes a result file like any
test script.
"""
