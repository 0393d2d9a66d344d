"""Logic of diagnostics: frequencies and delays of a device, the aggregator, reports on a machine.

The aggregator is in `aggregation.py` and `analyzers.py`, reports on a machine in `machine.py`. Times are in
seconds.
"""
