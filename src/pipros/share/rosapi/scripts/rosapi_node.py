#!/usr/bin/env python3
import sys

from pipros.cli.streams import command
from rosapi.node import main

sys.exit(command(main)())
