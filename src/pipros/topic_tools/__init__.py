"""What the programs of topic_tools decide: which messages pass, which topic is selected, what is computed.

Pure: no topics, no clock. The programs are in `src/topic_tools/nodes`.
"""
