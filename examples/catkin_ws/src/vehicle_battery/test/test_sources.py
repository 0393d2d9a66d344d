import math
import os
import tempfile
import unittest

from sensor_msgs.msg import BatteryState
from vehicle_battery.driver import open_source
from vehicle_battery.power_supply import NoBattery, PowerSupply, find_batteries
from vehicle_battery.simulated_pack import SimulatedPack

# A laptop's battery as reported by the kernel, in watt hours and in ampere hours.
IN_WATTS = """POWER_SUPPLY_NAME=BAT0
POWER_SUPPLY_TYPE=Battery
POWER_SUPPLY_STATUS=Discharging
POWER_SUPPLY_PRESENT=1
POWER_SUPPLY_TECHNOLOGY=Li-poly
POWER_SUPPLY_VOLTAGE_MIN_DESIGN=10000000
POWER_SUPPLY_VOLTAGE_NOW=12500000
POWER_SUPPLY_POWER_NOW=25000000
POWER_SUPPLY_ENERGY_FULL_DESIGN=60000000
POWER_SUPPLY_ENERGY_FULL=50000000
POWER_SUPPLY_ENERGY_NOW=20000000
POWER_SUPPLY_CAPACITY=40
POWER_SUPPLY_SERIAL_NUMBER= 1234
"""
IN_AMPERES = """POWER_SUPPLY_TYPE=Battery
POWER_SUPPLY_STATUS=Charging
POWER_SUPPLY_VOLTAGE_NOW=12000000
POWER_SUPPLY_CURRENT_NOW=1500000
POWER_SUPPLY_CHARGE_FULL=4000000
POWER_SUPPLY_CHARGE_NOW=1000000
POWER_SUPPLY_TEMP=305
POWER_SUPPLY_HEALTH=Good
"""


class PowerSupplies(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = folder.name

    def add(self, name, uevent):
        os.makedirs(os.path.join(self.root, name), exist_ok=True)
        with open(os.path.join(self.root, name, "uevent"), "w") as file:
            file.write(uevent)

    def test_are_found_among_other_supplies(self):
        self.add("AC", "POWER_SUPPLY_TYPE=Mains\n")
        self.add("BAT1", IN_AMPERES)
        self.add("BAT0", IN_WATTS)
        self.assertEqual(find_batteries(self.root), ["BAT0", "BAT1"])
        self.assertEqual(find_batteries(os.path.join(self.root, "none")), [])

    def test_in_watt_hours_are_read_in_ampere_hours(self):
        self.add("BAT0", IN_WATTS)
        reading = PowerSupply("BAT0", self.root).read()
        self.assertAlmostEqual(reading.percentage, 0.4)
        self.assertAlmostEqual(reading.current, -2.0)
        self.assertAlmostEqual(reading.charge, 2.0)
        self.assertAlmostEqual(reading.capacity, 5.0)
        self.assertAlmostEqual(reading.design_capacity, 6.0)
        self.assertTrue(math.isnan(reading.temperature))
        message = reading.to_message()
        self.assertEqual(message.power_supply_technology, BatteryState.POWER_SUPPLY_TECHNOLOGY_LIPO)
        self.assertEqual(message.power_supply_status, BatteryState.POWER_SUPPLY_STATUS_DISCHARGING)
        self.assertEqual((message.location, message.serial_number), ("BAT0", "1234"))

    def test_in_ampere_hours_are_read_unchanged(self):
        self.add("BAT1", IN_AMPERES)
        reading = PowerSupply("BAT1", self.root).read()
        self.assertAlmostEqual(reading.percentage, 0.25)
        self.assertAlmostEqual(reading.current, 1.5)
        self.assertAlmostEqual(reading.temperature, 30.5)
        self.assertEqual(reading.to_message().power_supply_health, BatteryState.POWER_SUPPLY_HEALTH_GOOD)

    def test_without_values_have_empty_readings(self):
        self.add("BAT0", "POWER_SUPPLY_TYPE=Battery\nPOWER_SUPPLY_VOLTAGE_NOW=?\n")
        reading = PowerSupply("BAT0", self.root).read()
        self.assertTrue(math.isnan(reading.percentage))
        self.assertTrue(math.isnan(reading.voltage))

    def test_that_are_removed_are_not_present(self):
        self.add("BAT0", IN_WATTS)
        supply = PowerSupply("BAT0", self.root)
        os.remove(os.path.join(self.root, "BAT0", "uevent"))
        self.assertFalse(supply.read().present)

    def test_that_do_not_exist_are_refused_with_the_existing_ones(self):
        self.add("BAT1", IN_AMPERES)
        with self.assertRaisesRegex(NoBattery, "BAT7 is not a battery of this computer .*: BAT1"):
            PowerSupply("BAT7", self.root)


class Pack(unittest.TestCase):
    def test_is_discharged_under_load_and_then_charged(self):
        pack = SimulatedPack(percentage=0.02)
        seen = []
        for _ in range(40):
            pack.advance(60)
            seen.append(pack.read())
        self.assertEqual(seen[0].status, "Discharging")
        self.assertLess(seen[0].current, 0)
        self.assertEqual(min(reading.percentage for reading in seen), 0.0)
        self.assertEqual(seen[-1].status, "Charging")
        self.assertGreater(seen[-1].current, 0)

    def test_has_a_lower_voltage_at_a_lower_charge(self):
        volts = [SimulatedPack(percentage=step / 20).read().voltage for step in range(21)]
        self.assertEqual(volts, sorted(volts))
        self.assertGreater(volts[0], 11)
        self.assertLess(volts[-1], 17)

    def test_with_the_same_seed_are_equal(self):
        packs = SimulatedPack(seed=7), SimulatedPack(seed=7)
        for pack in packs:
            pack.advance(10)
        self.assertEqual(packs[0].read(), packs[1].read())

    def test_accepts_a_charge_from_0_to_1(self):
        with self.assertRaisesRegex(ValueError, "percentage must be from 0 to 1, got 25"):
            open_source("simulated", 25)


if __name__ == "__main__":
    unittest.main()
