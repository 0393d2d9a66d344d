"""Prints turns as the vendor's library returns them: degrees, mm, qualities. Arguments: PORT COUNT FILE."""

import json
import math
import sys
from pathlib import Path

import pyrplidarsdk

driver = pyrplidarsdk.RplidarDriver(port=sys.argv[1], baudrate=115200)
assert driver.connect()
assert driver.start_scan()
turns = []
while len(turns) < int(sys.argv[2]):
    found = driver.get_scan_data()
    if found:
        angles, ranges, qualities = found
        rows = zip(map(math.degrees, angles), (1000 * each for each in ranges), qualities, strict=True)
        turns.append(list(rows))
driver.stop_scan()
driver.disconnect()
Path(sys.argv[3]).write_text(json.dumps(turns))
