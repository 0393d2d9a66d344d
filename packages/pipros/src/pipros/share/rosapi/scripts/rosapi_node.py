#!/usr/bin/env python3
import sys

from pipros_tools.cli.entry_point import command
from rosapi.node import main

sys.exit(command(main)())
