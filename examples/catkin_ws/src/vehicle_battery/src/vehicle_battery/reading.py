"""The reading of a battery at one time."""

from dataclasses import dataclass

from sensor_msgs.msg import BatteryState

NAN = float("nan")

# Strings of the kernel (Documentation/ABI/testing/sysfs-class-power) and constants of sensor_msgs.
_STATUS = {
    "Charging": BatteryState.POWER_SUPPLY_STATUS_CHARGING,
    "Discharging": BatteryState.POWER_SUPPLY_STATUS_DISCHARGING,
    "Not charging": BatteryState.POWER_SUPPLY_STATUS_NOT_CHARGING,
    "Full": BatteryState.POWER_SUPPLY_STATUS_FULL,
}
_HEALTH = {
    "Good": BatteryState.POWER_SUPPLY_HEALTH_GOOD,
    "Overheat": BatteryState.POWER_SUPPLY_HEALTH_OVERHEAT,
    "Dead": BatteryState.POWER_SUPPLY_HEALTH_DEAD,
    "Over voltage": BatteryState.POWER_SUPPLY_HEALTH_OVERVOLTAGE,
    "Unspecified failure": BatteryState.POWER_SUPPLY_HEALTH_UNSPEC_FAILURE,
    "Cold": BatteryState.POWER_SUPPLY_HEALTH_COLD,
    "Watchdog timer expire": BatteryState.POWER_SUPPLY_HEALTH_WATCHDOG_TIMER_EXPIRE,
    "Safety timer expire": BatteryState.POWER_SUPPLY_HEALTH_SAFETY_TIMER_EXPIRE,
}
_TECHNOLOGY = {
    "NiMH": BatteryState.POWER_SUPPLY_TECHNOLOGY_NIMH,
    "Li-ion": BatteryState.POWER_SUPPLY_TECHNOLOGY_LION,
    "Li-poly": BatteryState.POWER_SUPPLY_TECHNOLOGY_LIPO,
    "LiFe": BatteryState.POWER_SUPPLY_TECHNOLOGY_LIFE,
    "NiCd": BatteryState.POWER_SUPPLY_TECHNOLOGY_NICD,
    "LiMn": BatteryState.POWER_SUPPLY_TECHNOLOGY_LIMN,
}


@dataclass
class Reading:
    """A reading. Unreported values are NaN or ""."""

    percentage: float = NAN  # from 0 to 1
    voltage: float = NAN  # V
    current: float = NAN  # A, negative while discharging
    charge: float = NAN  # Ah
    capacity: float = NAN  # Ah, when full today
    design_capacity: float = NAN  # Ah, when new
    temperature: float = NAN  # degrees Celsius
    status: str = ""
    health: str = ""
    technology: str = ""
    location: str = ""
    serial_number: str = ""
    present: bool = True

    def to_message(self) -> BatteryState:
        """Return the reading as a `BatteryState`, without a header."""
        return BatteryState(
            percentage=self.percentage,
            voltage=self.voltage,
            current=self.current,
            charge=self.charge,
            capacity=self.capacity,
            design_capacity=self.design_capacity,
            temperature=self.temperature,
            power_supply_status=_STATUS.get(self.status, BatteryState.POWER_SUPPLY_STATUS_UNKNOWN),
            power_supply_health=_HEALTH.get(self.health, BatteryState.POWER_SUPPLY_HEALTH_UNKNOWN),
            power_supply_technology=_TECHNOLOGY.get(
                self.technology, BatteryState.POWER_SUPPLY_TECHNOLOGY_UNKNOWN
            ),
            location=self.location,
            serial_number=self.serial_number,
            present=self.present,
        )
