#!/usr/bin/env python3
import sys

from pipros_tools.cli.entry_point import command
from rosbridge_server.programs import websocket

sys.exit(command(websocket)())
