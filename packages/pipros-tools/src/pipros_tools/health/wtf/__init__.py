"""`roswtf`: the checks of `pipros doctor`, of packages and launch files, and of plugins, in Noetic's form.

A rule is a pair of a function and a message. The function takes the `Subject` and returns the problems, or
a value that counts as false. The facade `roswtf` runs the rules from plugins.
"""
