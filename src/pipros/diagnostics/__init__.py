"""What a device's diagnostics count.

How often something happens, and how old stamps are. Times are seconds.
The aggregator of all that is reported: `aggregation.py`, `analyzers.py`. Reports on a machine: `machine.py`.
"""
