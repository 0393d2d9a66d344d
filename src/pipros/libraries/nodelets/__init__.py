"""Nodelets in Python: classes that share a process, and hand messages over to each other as objects.

A nodelet is a class whose constructor takes a `pipros.node.Node`, with the nodelet's names, parameters and
remappings, and which may have a method `close`. `pipros.packages.nodelets` finds it by its plugin name.
"""
