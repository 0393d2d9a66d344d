"""The decisions of the programs of topic_tools: which messages pass, which topic is selected.

Pure: no topics, no clock. The programs are in `src/topic_tools/nodes`.
"""
