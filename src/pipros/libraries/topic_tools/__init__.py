"""Logic of topic_tools: message filtering, topic selection, and evaluation of expressions.

No module in this package uses topics or a clock. The executables are in `facades/api/topic_tools/nodes`.
"""
