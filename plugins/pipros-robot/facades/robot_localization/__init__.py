"""The services of robot_localization, which pipros compiles when they are used."""

from pipros.startup import give_way as _give_way

_give_way(__name__)
