"""The rules of Noetic's `roswtf`, with its texts, applied to what `pipros.health` gathers.

A rule is a pair of a function and a text. The function takes the context and returns what is wrong, or a
false value; `rules.error_rule` and `rules.warning_rule` add the result to the context. Plugins have rules of
their own.
"""
