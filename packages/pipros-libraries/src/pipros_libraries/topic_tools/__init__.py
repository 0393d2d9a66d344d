"""Logic of topic_tools: message filtering, topic selection, and evaluation of expressions.

Only `lazy.py` uses topics, and no module uses a clock. The executables are in
`facades/api/topic_tools/nodes`.
"""
