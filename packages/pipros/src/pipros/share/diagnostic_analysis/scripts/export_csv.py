#!/usr/bin/env python3
import sys

from diagnostic_analysis.export_csv import main
from pipros_tools.cli.entry_point import command

sys.exit(command(main)())
