"""Myro in Python 3: the functions of the courses "Learning Computing With Robots", on a real or a simulated Scribbler.

    from realitygap.classroom.myro import *

    initialize("sim")          # or the port of a robot: initialize("/dev/rfcomm0")
    forward(1, 2)              # full speed, two seconds
    if getObstacle("center") > 1000:
        turnLeft(.5, 1)
    beep(.5, 880)

Names, arguments and meaning are those of Myro 2.9.9; the page of reference says what is done, what is left out and why.
Programs that say `from myro import *` run unchanged by `python -m realitygap.classroom.myro program.py`.
"""

from __future__ import annotations

from typing import Any

from ._catalog import LEFT_OUT, left_out, names
from ._chance import even, flipCoin, heads, odd, pickOne, pickOneInRange, randomNumber, tails
from ._colors import *
from ._flow import currentTime, doTogether, getFilenames, loop, timer, timeRemaining, wait
from ._functions import *
from ._gamepad import Joystick, gamepad, getGamepad, getGamepadNow, joyStick, joystick
from ._graphics import (
    Circle,
    GraphWin,
    Image,
    Line,
    Oval,
    Point,
    Polygon,
    Rectangle,
    Text,
    distance,
    draw,
    getWindow,
    makeCircle,
    makeImage,
    makeLine,
    makeOval,
    makePoint,
    makePolygon,
    makeRectangle,
    makeText,
    makeWindow,
    undraw,
)
from ._mistakes import MyroError, show_mistakes_plainly
from ._pictures import *
from ._robot import Scribbler, SimScribbler, init, initialize, makeRobot, simulator, stop, stop_robot
from ._show import forget_cells, repaint, show
from ._songs import getNoteFromFrequency, makeSong, readSong, saveSong, song2text, text2song
from ._talk import (
    ask,
    askQuestion,
    makeStory,
    numberGame,
    pickAColor,
    pickAFile,
    pickAFolder,
    speak,
    stopSpeaking,
)

__all__ = [*names(), "MyroError"]


def __getattr__(name: str) -> Any:
    """Return, for a name that this module leaves out of Myro, a function that raises an error with the reason."""
    if name in LEFT_OUT:
        return left_out(name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


show_mistakes_plainly(on_error=stop_robot, on_cell=forget_cells)
