"""The rules of Noetic's `roswtf`, with its texts, applied to the data gathered by `pipros.health`.

A rule is a pair of a function and a text. The function takes the context and returns the problems, or a false
value; `rules.error_rule` and `rules.warning_rule` add the result to the context. Plugins define their own
rules.
"""
