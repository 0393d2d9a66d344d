"""The rules of Noetic's `roswtf`, with its wording, applied to the data gathered by `pipros.health`.

A rule is a pair of a function and a message. The function takes the `Subject` and returns the problems, or
a value that counts as false. The facade `roswtf` runs the rules from plugins.
"""
