"""Lidar drivers: RPLIDAR over serial ports, TCP and UDP, and Hokuyo (SCIP 2) over serial ports and TCP.

The modules `rplidar_node.py` and `urg_node.py` are nodes. `rplidar/samples.py`, `rplidar/turns.py` and
`urg/scip.py` perform no I/O.
"""
