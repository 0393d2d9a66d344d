"""Interpreter for the subset of CMake that packages without compiled code use.

CMake itself (a wheel of 30 MB) is not used: it would also need catkin's modules and message generators, which
only Debian packages provide, and builds with them take about ten times as long
(`benchmarks/startup.py --only build`).
"""
