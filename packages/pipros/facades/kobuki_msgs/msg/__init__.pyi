"""Messages of kobuki_msgs, made from their definitions by `pipros stubs`."""

from typing import Final as _Final
from pipros.msg import base as _base

class BumperEvent(_base.Message):
    """A bumper was pressed or released."""
    LEFT: _Final = 0
    """the left bumper"""
    CENTER: _Final = 1
    """the front bumper"""
    RIGHT: _Final = 2
    """the right bumper"""
    RELEASED: _Final = 0
    """nothing touches it any more"""
    PRESSED: _Final = 1
    """something touches it"""
    bumper: int
    """LEFT, CENTER or RIGHT"""
    state: int
    """RELEASED or PRESSED"""
    def __init__(self, bumper: int | None = ..., state: int | None = ...) -> None: ...

class ButtonEvent(_base.Message):
    """A button of the robot was pressed or released."""
    Button0: _Final = 0
    """the first button"""
    Button1: _Final = 1
    """the second button"""
    Button2: _Final = 2
    """the third button"""
    RELEASED: _Final = 0
    """no longer held"""
    PRESSED: _Final = 1
    """held"""
    button: int
    """Button0, Button1 or Button2"""
    state: int
    """RELEASED or PRESSED"""
    def __init__(self, button: int | None = ..., state: int | None = ...) -> None: ...

class CliffEvent(_base.Message):
    """A cliff sensor lost the floor, or found it again."""
    LEFT: _Final = 0
    """the left sensor"""
    CENTER: _Final = 1
    """the front sensor"""
    RIGHT: _Final = 2
    """the right sensor"""
    FLOOR: _Final = 0
    """the floor is there"""
    CLIFF: _Final = 1
    """the floor is missing"""
    sensor: int
    """LEFT, CENTER or RIGHT"""
    state: int
    """FLOOR or CLIFF"""
    bottom: int
    """reading of the distance sensor at this moment"""
    def __init__(self, sensor: int | None = ..., state: int | None = ..., bottom: int | None = ...) -> None: ...

class Led(_base.Message):
    """The colour of an LED of the robot."""
    BLACK: _Final = 0
    """off"""
    GREEN: _Final = 1
    """green"""
    ORANGE: _Final = 2
    """green and red together"""
    RED: _Final = 3
    """red"""
    value: int
    """one of the colours"""
    def __init__(self, value: int | None = ...) -> None: ...

class MotorPower(_base.Message):
    """Turns the motors of the wheels on or off."""
    OFF: _Final = 0
    """the wheels turn freely"""
    ON: _Final = 1
    """the wheels follow commands"""
    state: int
    """OFF or ON"""
    def __init__(self, state: int | None = ...) -> None: ...

class RobotStateEvent(_base.Message):
    """The connection to the robot was made or lost."""
    ONLINE: _Final = 1
    """the robot answers"""
    OFFLINE: _Final = 0
    """the robot does not answer"""
    state: int
    """ONLINE or OFFLINE"""
    def __init__(self, state: int | None = ...) -> None: ...

class Sound(_base.Message):
    """A sound that the robot plays."""
    ON: _Final = 0
    """switched on"""
    OFF: _Final = 1
    """switched off"""
    RECHARGE: _Final = 2
    """charging begins"""
    BUTTON: _Final = 3
    """a button was pressed"""
    ERROR: _Final = 4
    """something failed"""
    CLEANINGSTART: _Final = 5
    """cleaning begins"""
    CLEANINGEND: _Final = 6
    """cleaning ends"""
    value: int
    """one of the sounds"""
    def __init__(self, value: int | None = ...) -> None: ...

class WheelDropEvent(_base.Message):
    """A wheel dropped because it lost contact with the floor, or was raised again."""
    LEFT: _Final = 0
    """the left wheel"""
    RIGHT: _Final = 1
    """the right wheel"""
    RAISED: _Final = 0
    """the wheel carries the robot"""
    DROPPED: _Final = 1
    """the wheel hangs"""
    wheel: int
    """LEFT or RIGHT"""
    state: int
    """RAISED or DROPPED"""
    def __init__(self, wheel: int | None = ..., state: int | None = ...) -> None: ...
