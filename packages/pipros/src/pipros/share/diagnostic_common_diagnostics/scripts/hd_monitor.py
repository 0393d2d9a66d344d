#!/usr/bin/env python3
import sys

from diagnostic_common_diagnostics.nodes.hd_monitor import main
from pipros_tools.cli.entry_point import command

sys.exit(command(main)())
