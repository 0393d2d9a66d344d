"""The services of laser_assembler, which pipros compiles when they are used."""

from pipros.startup import give_way as _give_way

_give_way(__name__)
