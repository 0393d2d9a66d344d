"""Read the batteries of this computer from /sys/class/power_supply (Linux only)."""

import os

from vehicle_battery.reading import NAN, Reading

ROOT = "/sys/class/power_supply"


class NoBattery(Exception):
    """A power supply does not exist, or is not a battery."""


def find_batteries(root=ROOT):
    """Return the sorted names of all batteries, or an empty list if there are none."""
    try:
        names = sorted(os.listdir(root))
    except OSError:
        return []
    return [name for name in names if _properties(os.path.join(root, name)).get("TYPE") == "Battery"]


class PowerSupply:
    """A battery that the kernel reports.

    Raises:
        NoBattery: `name` is not one of `find_batteries(root)`.
    """

    def __init__(self, name, root=ROOT):
        self._name = name
        self._folder = os.path.join(root, name)
        batteries = find_batteries(root)
        if name not in batteries:
            there = ", ".join(batteries) or "there is none"
            raise NoBattery(f"{name} is not a battery of this computer (batteries below {root}: {there})")

    def advance(self, seconds):
        """Do nothing: a real battery discharges by itself."""

    def read(self):
        """Return the current reading. Values that the battery does not report are NaN or empty.

        Some batteries report ampere hours, others watt hours. Watt hours are divided by the design voltage
        or, if it is unknown, by the present voltage.
        """
        properties = _properties(self._folder)

        def number(name, unit):
            try:
                return float(properties[name]) * unit
            except (KeyError, ValueError):
                return NAN

        voltage = number("VOLTAGE_NOW", 1e-6)
        nominal = _first(number("VOLTAGE_MIN_DESIGN", 1e-6), voltage)

        def charge(kind):
            return _first(number("CHARGE_" + kind, 1e-6), number("ENERGY_" + kind, 1e-6) / nominal)

        current = abs(_first(number("CURRENT_NOW", 1e-6), number("POWER_NOW", 1e-6) / voltage))
        status = properties.get("STATUS", "")
        return Reading(
            percentage=_first(charge("NOW") / charge("FULL"), number("CAPACITY", 0.01)),
            voltage=voltage,
            current=-current if status == "Discharging" else current,
            charge=charge("NOW"),
            capacity=charge("FULL"),
            design_capacity=charge("FULL_DESIGN"),
            temperature=number("TEMP", 0.1),
            status=status,
            health=properties.get("HEALTH", ""),
            technology=properties.get("TECHNOLOGY", ""),
            location=self._name,
            serial_number=properties.get("SERIAL_NUMBER", "").strip(),
            present=properties.get("PRESENT", "1") == "1",
        )


def _properties(folder):
    """Return the properties in the file `uevent`, without their prefix; none if the battery was removed."""
    try:
        with open(os.path.join(folder, "uevent"), encoding="utf-8", errors="replace") as file:
            lines = file.read().splitlines()
    except OSError:
        return {"PRESENT": "0"}
    pairs = (line.partition("=") for line in lines)
    return {name[len("POWER_SUPPLY_") :]: value for name, _, value in pairs}


def _first(*values):
    """Return the first value that is not NaN."""
    return next((value for value in values if value == value), NAN)
