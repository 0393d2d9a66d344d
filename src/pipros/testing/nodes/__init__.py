"""The test nodes of rostest: `<test pkg="rostest" type="hztest" …>` and others.

Each reads from its private parameters what to check, checks it, and writes
a result file as any test script does.
"""
