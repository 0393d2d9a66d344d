"""Drivers of lidars: RPLIDAR over serial ports, TCP and UDP, and Hokuyo's (SCIP 2) over TCP and serial ports.

The modules `rplidar_node.py` and `urg_node.py` are nodes. `rplidar/samples.py`, `rplidar/turns.py` and
`urg/scip.py` perform no I/O.
"""
