"""The messages of costmap_2d, which pipros compiles when they are used."""

from pipros.startup import give_way as _give_way

_give_way(__name__)
