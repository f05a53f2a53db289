"""Myro's functions that speak to the robot in use, or play tones on the computer if there is none."""

from __future__ import annotations

import builtins
import sys
from typing import Any

from realitygap._version import __version__

from . import _robot
from ._mistakes import MyroError, number
from ._robot import Scribbler, of_robot
from ._sound import Plays

forward = of_robot(Scribbler.forward)
backward = of_robot(Scribbler.backward)
turnLeft = of_robot(Scribbler.turnLeft)
turnRight = of_robot(Scribbler.turnRight)
turn = of_robot(Scribbler.turn)
move = of_robot(Scribbler.move)
translate = of_robot(Scribbler.translate)
rotate = of_robot(Scribbler.rotate)
motors = of_robot(Scribbler.motors)
requestStop = of_robot(Scribbler.requestStop)

getLight = of_robot(Scribbler.getLight)
getIR = of_robot(Scribbler.getIR)
getLine = of_robot(Scribbler.getLine)
getStall = of_robot(Scribbler.getStall)
getObstacle = of_robot(Scribbler.getObstacle)
getBright = of_robot(Scribbler.getBright)
getBlob = of_robot(Scribbler.getBlob)
getBattery = of_robot(Scribbler.getBattery)
getDistance = of_robot(Scribbler.getDistance)
getMicEnvelope = of_robot(Scribbler.getMicEnvelope)
getAll = of_robot(Scribbler.getAll)
get = of_robot(Scribbler.get)
getVersion = of_robot(Scribbler.getVersion)
senses = of_robot(Scribbler.senses)
wall = of_robot(Scribbler.wall)
update = of_robot(Scribbler.update)

setVolume = of_robot(Scribbler.setVolume)
getVolume = of_robot(Scribbler.getVolume)
setS2Volume = of_robot(Scribbler.setS2Volume)
setStartSong = of_robot(Scribbler.setStartSong)
getStartSong = of_robot(Scribbler.getStartSong)
playNote = of_robot(Scribbler.playNote)
playSong = of_robot(Scribbler.playSong)

setLED = of_robot(Scribbler.setLED)
setLEDFront = of_robot(Scribbler.setLEDFront)
setLEDBack = of_robot(Scribbler.setLEDBack)

takePicture = of_robot(Scribbler.takePicture)
setPicSize = of_robot(Scribbler.setPicSize)
configureBlob = of_robot(Scribbler.configureBlob)
darkenCamera = of_robot(Scribbler.darkenCamera)
manualCamera = of_robot(Scribbler.manualCamera)
autoCamera = of_robot(Scribbler.autoCamera)
setWhiteBalance = of_robot(Scribbler.setWhiteBalance)

getName = of_robot(Scribbler.getName)
setName = of_robot(Scribbler.setName)
getPassword = of_robot(Scribbler.getPassword)
setPassword = of_robot(Scribbler.setPassword)
getForwardness = of_robot(Scribbler.getForwardness)
setForwardness = of_robot(Scribbler.setForwardness)
identifyRobot = of_robot(Scribbler.identifyRobot)
restart = of_robot(Scribbler.restart)
openConnection = of_robot(Scribbler.openConnection)
closeConnection = of_robot(Scribbler.closeConnection)

getPosition = of_robot(Scribbler.getPosition)
hereIs = of_robot(Scribbler.hereIs)
getAngle = of_robot(Scribbler.getAngle)
setAngle = of_robot(Scribbler.setAngle)
beginPath = of_robot(Scribbler.beginPath)
endPath = of_robot(Scribbler.endPath)
moveTo = of_robot(Scribbler.moveTo)
moveBy = of_robot(Scribbler.moveBy)
turnTo = of_robot(Scribbler.turnTo)
turnBy = of_robot(Scribbler.turnBy)
arcTo = of_robot(Scribbler.arcTo)
arcBy = of_robot(Scribbler.arcBy)
getEncoders = of_robot(Scribbler.getEncoders)
getMotorStats = of_robot(Scribbler.getMotorStats)

setIRPower = of_robot(Scribbler.setIRPower)
sendIRMessage = of_robot(Scribbler.sendIRMessage)
getIRMessage = of_robot(Scribbler.getIRMessage)
setCommunicateLeft = of_robot(Scribbler.setCommunicateLeft)
setCommunicateCenter = of_robot(Scribbler.setCommunicateCenter)
setCommunicateRight = of_robot(Scribbler.setCommunicateRight)
setCommunicateAll = of_robot(Scribbler.setCommunicateAll)
servo = of_robot(Scribbler.servo)
getFlukeLog = of_robot(Scribbler.getFlukeLog)
enablePanNetworking = of_robot(Scribbler.enablePanNetworking)


def beep(duration: Any = 0.5, frequency1: Any = None, frequency2: Any = None) -> None:
    """Play a tone on the robot, or on the computer if there is no robot; return when it has ended.

    Args:
        duration: Duration [s]. A list of frequencies here plays each for half a second.
        frequency1: Frequency [Hz]. Default: a random one. A list plays each in turn.
        frequency2: Frequency of a second tone at the same time [Hz].
    """
    (_robot.robot_or_none() or computer).beep(duration, frequency1, frequency2)


def scaleUp(loopCount: int) -> None:
    """Play half a second, the higher the number: 200 Hz and 200 Hz more for each. For `loop`."""
    beep(0.5, 200 + 200 * loopCount)


def scaleDown(loopCount: int) -> None:
    """Play half a second, the lower the number: 9000 Hz and 200 Hz less for each. For `loop`."""
    beep(0.5, 9000 - 200 * loopCount)


def getInfo(*item: str) -> str | list[str] | dict[str, str]:
    """Return the robot's identity and versions, by name; without a robot only Myro's version."""
    robot = _robot.robot_or_none()
    if robot is not None:
        return robot.getInfo(*item)
    return {"myro": __version__}


def set(*args: Any) -> Any:
    """Set something of the robot by its name: `set("led", "left", "on")`, `set("name", "Rosa")`.

    With one value or none it is Python's own `set`, whose name Myro took.

    Raises:
        MyroError: There is no such thing to set, or no robot.
    """
    if len(args) < 2:
        return builtins.set(*args)
    if len(args) > 3:
        raise MyroError(
            f"set() was given {len(args)} values, expected an item, a position and perhaps a value."
        )
    return _robot.robot_for("set").set(*args)


class Computer(Plays):
    """The computer as a player of tones: it rings the terminal's bell and waits as long as the tone lasts."""

    def _tone(self, duration: float, hz: float, hz2: float | None) -> None:
        if hz:
            sys.stdout.write("\a")
            sys.stdout.flush()
        _robot.sleep(duration)

    def speak(self, message: object, async_: bool = False) -> None:
        """Print what the computer would say."""
        print(message)


computer = Computer()


def beepScale(duration: float, start: float, stop: float, factor: float = 2) -> None:
    """Let the computer play tones from one frequency to another; `factor` is the ratio of neighboring tones."""
    if number("beepScale: the factor", factor) <= 1 or number("beepScale: the start", start) <= 0:
        raise MyroError(
            f"beepScale: starts at {start!r} and grows by {factor!r}, expected a start above 0 and a factor above 1."
        )
    hz = start
    while hz <= stop:
        computer.beep(duration, hz)
        hz *= factor
