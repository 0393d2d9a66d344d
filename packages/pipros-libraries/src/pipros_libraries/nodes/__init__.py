"""What nodes have in common: parameters, topics and services, periodic work, transforms, and devices.

`docs/guides/libraries.md` shows a complete node. The modules are independent of what a node does, and also
serve nodes of other packages.
"""
