"""A lock for `ast.parse`, and for compiling trees, wherever other threads may do the same.

Until Python 3.12, all threads of an interpreter count the depth of a tree in one place (CPython's issue
106905): if a collection of garbage lets another thread parse meanwhile, both end with SystemError.
"""

from threading import RLock

SYNTAX_TREES = RLock()
