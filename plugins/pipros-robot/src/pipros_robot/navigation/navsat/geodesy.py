"""Convert latitude and longitude to plane coordinates and back, on the ellipsoid WGS84.

- Transverse Mercator (UTM): C. F. F. Karney, Transverse Mercator with an accuracy of a few nanometers,
  Journal of Geodesy 85 (2011), equations 7 to 36, with the series up to the fourth power of the third
  flattening; the error is less than 0.1 µm within a zone.
- Polar stereographic (UPS): J. P. Snyder, Map Projections, USGS Professional Paper 1395 (1987), chapter 21.

Angles are in degrees, lengths in metres. Zones are 1 to 60, and 0 for UPS.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from pipros.basics.errors import PiprosError

A: Final = 6378137.0
F: Final = 1 / 298.257223563
_E2: Final = F * (2 - F)
_E: Final = math.sqrt(_E2)
_N: Final = F / (2 - F)
_RADIUS: Final = A / (1 + _N) * (1 + _N**2 / 4 + _N**4 / 64)
_SCALE, _EASTING, _NORTHING = 0.9996, 500_000.0, 10_000_000.0
_UPS_SCALE, _UPS_SHIFT = 0.994, 2_000_000.0
_UPS_RADIUS: Final = 2 * _UPS_SCALE * A / ((1 - F) * math.exp(_E * math.atanh(_E)))
_FORWARD: Final = (
    _N / 2 - _N**2 * 2 / 3 + _N**3 * 5 / 16 + _N**4 * 41 / 180,
    _N**2 * 13 / 48 - _N**3 * 3 / 5 + _N**4 * 557 / 1440,
    _N**3 * 61 / 240 - _N**4 * 103 / 140,
    _N**4 * 49561 / 161280,
)
_REVERSE: Final = (
    _N / 2 - _N**2 * 2 / 3 + _N**3 * 37 / 96 - _N**4 / 360,
    _N**2 / 48 + _N**3 / 15 - _N**4 * 437 / 1440,
    _N**3 * 17 / 480 - _N**4 * 37 / 840,
    _N**4 * 4397 / 161280,
)
_BANDS: Final = "CDEFGHJKLMNPQRSTUVWX"


class OutOfRange(PiprosError, ValueError):
    """A position has no coordinates, or the name of a zone is invalid."""


@dataclass(frozen=True, slots=True)
class GridPosition:
    """A position on the grid of a zone.

    Attributes:
        convergence: clockwise angle in degrees from true north to grid north.
    """

    zone: int
    is_north: bool
    x: float
    y: float
    convergence: float


def standard_zone(latitude: float, longitude: float) -> int:
    """Return the zone of a position, with the exceptions for Norway and Svalbard."""
    if not -80 <= latitude < 84:
        return 0
    degree = math.floor(math.remainder(longitude, 360.0))
    degree = -180 if degree == 180 else degree
    zone = (degree + 186) // 6
    if 56 <= latitude < 64 and zone == 31 and degree >= 3:
        return 32
    if latitude >= 72 and 0 <= degree < 42:
        return 2 * ((degree + 183) // 12) + 1
    return zone


def zone_of_name(name: str) -> tuple[int, bool]:
    """Return the number and hemisphere of a grid zone such as `31U`, or of an MGRS coordinate.

    Raises:
        OutOfRange: the text is not the name of a zone.
    """
    digits = len(name) - len(name.lstrip("0123456789"))
    band = name[digits : digits + 1].upper()
    zone = int(name[:digits]) if 0 < digits <= 2 else 0
    if (digits and 1 <= zone <= 60 and band and band in _BANDS) or (not digits and band and band in "ABYZ"):
        return zone, band >= "N"
    raise OutOfRange(f"a UTM zone must be a number from 1 to 60 and a band, such as 31U, got {name!r}")


def to_grid(
    latitude: float, longitude: float, zone: int | None = None, is_north: bool | None = None
) -> GridPosition:
    """Return the coordinates in a zone and a hemisphere, which default to the position's own.

    A position beyond the equator has a y below 0 or above 10,000 km. Zone 0 is always the nearer pole's.

    Raises:
        OutOfRange: the latitude is not between -90 and 90, the longitude is not finite, or the position is
            too far from the zone.
    """
    _require_place(latitude, longitude)
    zone = standard_zone(latitude, longitude) if zone is None else zone
    if is_north is None or zone == 0:
        is_north = math.copysign(1.0, latitude) > 0
    if zone == 0:
        return _to_ups(latitude, longitude, is_north)
    angle = math.remainder(longitude - (6 * zone - 183), 360.0)
    if abs(angle) > 60.0:
        raise OutOfRange(f"longitude {longitude} is more than 60 degrees from the centre of UTM zone {zone}")
    turn, tangent = math.radians(angle), _conformal(math.tan(math.radians(latitude)))
    cosine, sine = math.cos(turn), math.sin(turn)
    xi, eta = math.atan2(tangent, cosine), math.asinh(sine / math.hypot(tangent, cosine))
    north, east, real, imaginary = xi, eta, 1.0, 0.0
    for j, factor in enumerate(_FORWARD, 1):
        north += factor * math.sin(2 * j * xi) * math.cosh(2 * j * eta)
        east += factor * math.cos(2 * j * xi) * math.sinh(2 * j * eta)
        real += 2 * j * factor * math.cos(2 * j * xi) * math.cosh(2 * j * eta)
        imaginary += 2 * j * factor * math.sin(2 * j * xi) * math.sinh(2 * j * eta)
    convergence = math.atan2(sine * tangent, cosine * math.hypot(1.0, tangent)) + math.atan2(imaginary, real)
    x = _EASTING + _SCALE * _RADIUS * east
    if not 0.0 <= x <= 2 * _EASTING:
        raise OutOfRange(f"longitude {longitude} is too far from UTM zone {zone}")
    y = _SCALE * _RADIUS * north + (0.0 if is_north else _NORTHING)
    return GridPosition(zone, is_north, x, y, math.degrees(convergence))


def from_grid(zone: int, is_north: bool, x: float, y: float) -> tuple[float, float]:
    """Return the latitude and longitude of coordinates in a zone.

    Raises:
        OutOfRange: a coordinate is not finite, or too large for any place on earth.
    """
    if not (abs(x) <= 2 * _NORTHING and abs(y) <= 2 * _NORTHING):
        raise OutOfRange(f"the coordinates in zone {zone} must be at most {2 * _NORTHING:g} m, got {x}, {y}")
    if zone == 0:
        return _from_ups(is_north, x, y)
    north = (y - (0.0 if is_north else _NORTHING)) / (_SCALE * _RADIUS)
    east = (x - _EASTING) / (_SCALE * _RADIUS)
    xi, eta = north, east
    for j, factor in enumerate(_REVERSE, 1):
        xi -= factor * math.sin(2 * j * north) * math.cosh(2 * j * east)
        eta -= factor * math.cos(2 * j * north) * math.sinh(2 * j * east)
    tangent = math.sin(xi) / math.hypot(math.sinh(eta), math.cos(xi))
    longitude = math.degrees(math.atan2(math.sinh(eta), math.cos(xi))) + 6 * zone - 183
    return math.degrees(math.atan(_geodetic(tangent))), math.remainder(longitude, 360.0)


def _require_place(latitude: float, longitude: float) -> None:
    if not (abs(latitude) <= 90.0 and math.isfinite(longitude)):
        raise OutOfRange(
            f"latitude must be between -90 and 90 and longitude finite, got {latitude}, {longitude}"
        )


def _to_ups(latitude: float, longitude: float, is_north: bool) -> GridPosition:
    tangent = _conformal(math.tan(math.radians(abs(latitude))))
    reach = _UPS_RADIUS / (math.hypot(1.0, tangent) + tangent)
    turn = math.radians(longitude)
    y = reach * math.cos(turn) * (-1.0 if is_north else 1.0)
    convergence = math.remainder(longitude if is_north else -longitude, 360.0)
    return GridPosition(0, is_north, _UPS_SHIFT + reach * math.sin(turn), _UPS_SHIFT + y, convergence)


def _from_ups(is_north: bool, x: float, y: float) -> tuple[float, float]:
    east, north = x - _UPS_SHIFT, y - _UPS_SHIFT
    part = math.hypot(east, north) / _UPS_RADIUS
    latitude = math.degrees(math.atan(_geodetic((1 / part - part) / 2))) if part else 90.0
    longitude = math.degrees(math.atan2(east, -north if is_north else north))
    return (latitude if is_north else -latitude), longitude


def _conformal(tangent: float) -> float:
    """Convert tan(latitude) to tan(conformal latitude) (Karney's equations 7 to 9)."""
    root = math.hypot(1.0, tangent)
    sigma = math.sinh(_E * math.atanh(_E * tangent / root))
    return tangent * math.hypot(1.0, sigma) - sigma * root


def _geodetic(conformal: float) -> float:
    """Convert tan(conformal latitude) to tan(latitude) by Newton's method."""
    tangent = conformal / (1 - _E2)
    for _ in range(6):
        image = _conformal(tangent)
        step = (conformal - image) / math.hypot(1.0, image)
        step *= (1 + (1 - _E2) * tangent**2) / ((1 - _E2) * math.hypot(1.0, tangent))
        tangent += step
    return tangent


class LocalPlane:
    """Local east, north and up coordinates at an origin, computed via earth-centred coordinates.

    Creating a plane and `forward` raise `OutOfRange` if the latitude is not between -90 and 90 or the
    longitude is not finite.
    """

    def __init__(self, latitude: float, longitude: float, altitude: float = 0.0) -> None:
        self._origin = _to_earth(latitude, longitude, altitude)
        self._sines = math.sin(math.radians(latitude)), math.sin(math.radians(longitude))
        self._cosines = math.cos(math.radians(latitude)), math.cos(math.radians(longitude))

    def forward(self, latitude: float, longitude: float, altitude: float) -> tuple[float, float, float]:
        """Return the local coordinates of a position."""
        earth = _to_earth(latitude, longitude, altitude)
        x, y, z = (value - start for value, start in zip(earth, self._origin, strict=True))
        (slat, slon), (clat, clon) = self._sines, self._cosines
        outwards = clon * x + slon * y
        return clon * y - slon * x, clat * z - slat * outwards, clat * outwards + slat * z

    def reverse(self, east: float, north: float, up: float) -> tuple[float, float, float]:
        """Return the latitude, longitude and altitude of local coordinates."""
        (slat, slon), (clat, clon) = self._sines, self._cosines
        outwards = clat * up - slat * north
        x = self._origin[0] + clon * outwards - slon * east
        y = self._origin[1] + slon * outwards + clon * east
        z = self._origin[2] + clat * north + slat * up
        distance = math.hypot(x, y)
        latitude = math.atan2(z, distance * (1 - _E2))
        for _ in range(10):  # each iteration reduces the error by a factor of at least 149 (at the equator)
            curvature = A / math.sqrt(1 - _E2 * math.sin(latitude) ** 2)
            latitude = math.atan2(z + _E2 * curvature * math.sin(latitude), distance)
        curvature = A / math.sqrt(1 - _E2 * math.sin(latitude) ** 2)
        sine, cosine = math.sin(latitude), math.cos(latitude)
        altitude = distance * cosine + z * sine - A * A / curvature
        return math.degrees(latitude), math.degrees(math.atan2(y, x)), altitude


def _to_earth(latitude: float, longitude: float, altitude: float) -> tuple[float, float, float]:
    """Return earth-centred coordinates, with x towards longitude 0 and z towards the north pole."""
    _require_place(latitude, longitude)
    phi, turn = math.radians(latitude), math.radians(longitude)
    curvature = A / math.sqrt(1 - _E2 * math.sin(phi) ** 2)
    outwards = (curvature + altitude) * math.cos(phi)
    z = ((1 - _E2) * curvature + altitude) * math.sin(phi)
    return outwards * math.cos(turn), outwards * math.sin(turn), z
