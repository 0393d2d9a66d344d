"""Runs pytest so that coverage also measures the modules that `pipros.pth` imports when Python starts.

Run by `.ci/coverage` with `PIPROS_NO_IMPORT_HOOK=1`. The variable is removed before the tests, whose
programs start as usual.
"""

import os
import sys

import pytest

if __name__ == "__main__":
    del os.environ["PIPROS_NO_IMPORT_HOOK"]
    import pipros.startup  # noqa: F401

    sys.exit(pytest.main())
