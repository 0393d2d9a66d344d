"""Nodelets in Python. Nodelets share a process, and pass messages to each other as objects.

A nodelet is a class. Its constructor takes a `pipros.node.Node` with the nodelet's name, parameters and
remappings. The class may have a method `close`, which is called when the nodelet is unloaded or the node is
shut down. `pipros.packages.nodelets` finds the class by its plugin name.
"""
