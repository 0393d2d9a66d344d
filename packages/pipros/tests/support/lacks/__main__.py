"""Run pytest with what another system lacks taken away."""

import os
import subprocess
import sys

from tests.support.lacks import SYSTEMS, environment

if len(sys.argv) < 2 or sys.argv[1] not in SYSTEMS:
    raise SystemExit(f"usage: python -m tests.support.lacks {'|'.join(SYSTEMS)} [ARGUMENT OF PYTEST…]")
command = [sys.executable, "-m", "pytest", *sys.argv[2:]]
sys.exit(subprocess.run(command, env={**os.environ, **environment(sys.argv[1])}).returncode)
