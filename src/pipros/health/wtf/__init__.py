"""The rules of Noetic's `roswtf`, in its words, on what `pipros.health` gathers.

A rule is a pair of a function and a text. The function takes the context and returns what is wrong, or
something false; `rules.error_rule` and `rules.warning_rule` add that to the context. Plugins bring rules of
their own.
"""
