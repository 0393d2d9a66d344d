"""Diagnostics: the frequencies and delays of a device, the aggregator, and reports on a machine.

The aggregator is in `aggregation.py` and `analyzers.py`, reports on a machine in `machine.py`. Times are in
seconds.
"""
