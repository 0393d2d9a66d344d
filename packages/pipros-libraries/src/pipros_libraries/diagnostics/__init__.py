"""Diagnostics: a device's frequencies and delays, the aggregator, and reports on a machine.

The aggregator is in `aggregation.py` and `analyzers.py`, reports on a machine in `machine.py`. Times are in
seconds.
"""
