"""Download each PyPI project of the table of Python keys once, with pip's settings of this machine.

python -m tests.support.python_keys
"""

import subprocess
import sys
import tempfile

from pipros_wheels.python_keys import PYTHON_KEYS


def main() -> int:
    """Print a line for each project. Return 1 if one could not be downloaded."""
    failed = False
    for requirement in sorted({value for value in PYTHON_KEYS.values() if value}):
        with tempfile.TemporaryDirectory() as folder:
            pip = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check"]
            ended = subprocess.run([*pip, "--no-deps", "--dest", folder, requirement], capture_output=True)
        failed |= ended.returncode != 0
        print(f"{'failed' if ended.returncode else 'found '}  {requirement}", flush=True)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
