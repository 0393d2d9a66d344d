"""`python -m pipros.testing.unittests PATH RESULTS`: the unit tests of a file or folder, where pytest is not.

As nose did for `catkin_add_nosetests`: modules called `test…`, cases of `unittest`.
"""

from __future__ import annotations

import sys
import unittest
from collections.abc import Sequence
from pathlib import Path

from pipros.testing.runner import XmlRunner


def main(argv: Sequence[str] | None = None) -> int:
    """Returns 0 when all passed, else 1; the result file tells which did not."""
    path, results = map(Path, sys.argv[1:] if argv is None else argv)
    folder, pattern = (path, "test*.py") if path.is_dir() else (path.parent, path.name)
    suite = unittest.TestLoader().discover(str(folder), pattern)
    return 0 if XmlRunner(results).run(suite).wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())
