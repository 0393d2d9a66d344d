"""Nodelets in Python. Nodelets share a process, and pass messages to each other as objects.

A nodelet is a class. Its constructor takes a `pipros.node.Node` with the nodelet's name, parameters and
remappings, and it may have a method `close`. `pipros.packages.nodelets` finds the class by its plugin name.
"""
