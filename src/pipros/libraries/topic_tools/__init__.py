"""The rules of topic_tools: which messages pass, which topic is selected, how expressions are evaluated.

No module of this package uses topics or a clock. The executables are in `facades/api/topic_tools/nodes`.
"""
