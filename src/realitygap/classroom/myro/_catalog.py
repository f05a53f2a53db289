"""Every name that `from myro import *` gave a program in Myro 2.9.9: done here, or left out and why.

A few names of Calico's Myro 3, which courses used after it, are here too: makeRobot, penUp, joystick.

Source: myro/__init__.py, graphics.py, media.py, speech.py, chat.py and system.py of Myro 2.9.9.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NoReturn

from ._mistakes import MyroError

DONE: dict[str, tuple[str, ...]] = {
    "Robots": (
        "initialize", "init", "simulator", "Scribbler", "SimScribbler", "makeRobot", "openConnection",
        "closeConnection", "restart", "requestStop", "update",
    ),
    "Moving": (
        "forward", "backward", "turnLeft", "turnRight", "turn", "move", "translate", "rotate", "motors", "stop",
    ),
    "Driving by hand, in a notebook": ("joyStick", "Joystick", "joystick", "gamepad"),
    "Gamepads": ("getGamepad", "getGamepadNow"),
    "Senses": (
        "getLight", "getIR", "getLine", "getStall", "getObstacle", "getBright", "getBlob", "getBattery",
        "getDistance", "getMicEnvelope", "getAll", "get", "senses", "wall",
    ),
    "Sound": (
        "beep", "playNote", "playSong", "setVolume", "getVolume", "setS2Volume", "setStartSong", "getStartSong",
        "scaleUp", "scaleDown", "beepScale", "computer", "Computer",
    ),
    "Songs": ("makeSong", "text2song", "song2text", "readSong", "saveSong", "getNoteFromFrequency"),
    "Lights": ("setLED", "setLEDFront", "setLEDBack", "set"),
    "Camera": (
        "takePicture", "setPicSize", "configureBlob", "darkenCamera", "manualCamera", "autoCamera",
        "setWhiteBalance",
    ),
    "Who the robot is": (
        "getName", "setName", "getPassword", "setPassword", "getForwardness", "setForwardness", "getInfo",
        "getVersion", "identifyRobot",
    ),
    "Places and paths (Scribbler 2)": (
        "getPosition", "hereIs", "getAngle", "setAngle", "beginPath", "endPath", "moveTo", "moveBy", "turnTo",
        "turnBy", "arcTo", "arcBy", "getEncoders", "getMotorStats",
    ),
    "Fluke": (
        "setIRPower", "sendIRMessage", "getIRMessage", "setCommunicateLeft", "setCommunicateCenter",
        "setCommunicateRight", "setCommunicateAll", "servo", "getFlukeLog", "enablePanNetworking",
    ),
    "Time": ("wait", "currentTime", "timer", "timeRemaining"),
    "Chance and numbers": (
        "randomNumber", "pickOne", "pickOneInRange", "flipCoin", "heads", "tails", "odd", "even",
    ),
    "Questions": ("ask", "askQuestion", "pickAFile", "pickAFolder", "pickAColor"),
    "Speech and stories": ("speak", "stopSpeaking", "makeStory", "numberGame"),
    "Functions together": ("loop", "doTogether", "getFilenames"),
    "Pictures": (
        "Picture", "Pixel", "makePicture", "loadPicture", "copyPicture", "savePicture", "writePictureTo", "show",
        "repaint", "getWidth", "getHeight", "getPixel", "getPixels", "setPixel", "getX", "getY", "getRed",
        "getGreen", "getBlue", "getGray", "getAlpha", "getColor", "getRGB", "getRGBA", "setRed", "setGreen",
        "setBlue", "setGray", "setAlpha", "setColor", "setRGB", "setRGBA", "makeArray", "Array",
    ),
    "Colors": (
        "Color", "makeColor", "makeLighter", "makeDarker", "color_rgb", "rgb_color", "rgb2hsv", "hsv2rgb",
        "rgb2hls", "hls2rgb", "rgb2yiq", "yiq2rgb", "rgb2yuv", "yuv2rgb", "black", "white", "blue", "red", "green",
        "gray", "darkGray", "lightGray", "yellow", "pink", "magenta", "cyan",
    ),
    "Graphics": (
        "GraphWin", "Point", "Line", "Rectangle", "Oval", "Circle", "Polygon", "Text", "Image", "makeWindow",
        "makePoint", "makeLine", "makeRectangle", "makeOval", "makeCircle", "makePolygon", "makeText", "makeImage",
        "getWindow", "draw", "undraw", "distance",
    ),
}  # fmt: skip
"""Functions that exist here, by subject."""

_WINDOW = "It opens a window of its own, which a notebook and a server have no screen for. {instead}"
_VOICE = "No voice comes with realitygap: speak() prints what it would say."
_FILE_SOUND = (
    "It plays a file of sound on the computer's speaker. Play notes with playSong() or computer.playSong()."
)
_CHAT = "It needs the chat server of the institute that made Myro, which is gone."
_FIRMWARE = (
    "It replaces the firmware of robot or Fluke, or Myro itself, from addresses that are gone; a mistake there can "
    "leave a robot useless. Update realitygap with pip, and a robot with its maker's tools."
)
_PEN = (
    "No robot can lift its pen: on a real one a person puts it in, and that of a simulated one always draws. Leave the "
    "line out."
)
_OTHER_ROBOT = (
    "It is another robot, for which there is no driver here. Use Scribbler(port) or SimScribbler()."
)
_INSIDE = "It is a part of Myro's inside that programs of a course do not call."

LEFT_OUT: dict[str, str] = {
    "getKeyPressed": _WINDOW.format(instead="Ask with ask() what to do next."),
    "penUp": _PEN,
    "penDown": _PEN,
    "calibrate": _WINDOW.format(instead="Correct the motors with robot.setFudge(f1, f2, f3, f4)."),
    "Calibrate": _WINDOW.format(instead="Correct the motors with robot.setFudge(f1, f2, f3, f4)."),
    "Entry": _WINDOW.format(instead="Ask with ask() what a reader should enter."),
    "makeEntry": _WINDOW.format(instead="Ask with ask() what a reader should enter."),
    "AskDialog": _WINDOW.format(instead="Ask with ask() or askQuestion()."),
    "moveToTop": _WINDOW.format(instead="Nothing has to be moved to the top."),
    "Pixmap": "It is a picture of the window system. Use makePicture() and Image(point, picture).",
    "makePixmap": "It is a picture of the window system. Use makePicture() and Image(point, picture).",
    "setVoice": _VOICE,
    "getVoice": _VOICE,
    "getVoices": _VOICE,
    "playSpeech": _VOICE,
    "saveSpeech": _VOICE,
    "variables": "Its two stories belong to Myro. Write one of your own and give it to makeStory().",
    "Sound": _FILE_SOUND,
    "makeSound": _FILE_SOUND,
    "play": _FILE_SOUND,
    "playSound": _FILE_SOUND,
    "Song": "In Myro it fails at once: it calls a function that does not exist. Use makeSong() and playSong().",
    "sendPicture": _CHAT,
    "register": _CHAT,
    "Chat": _CHAT,
    "RemoteRobot": _CHAT,
    "LocalRobot": _CHAT,
    "upgrade": _FIRMWARE,
    "upgrade_myro": _FIRMWARE,
    "upgrade_scribbler": _FIRMWARE,
    "upgrade_fluke": _FIRMWARE,
    "Surveyor": _OTHER_ROBOT,
    "Epuck": _OTHER_ROBOT,
    "watch": _OTHER_ROBOT,
    "Robot": _INSIDE + " Robots are made by Scribbler(port).",
    "BackgroundThread": _INSIDE + " doTogether() runs functions at the same time.",
    "Column": _INSIDE + " makeArray(picture)[x] is one.",
    "GraphicsObject": _INSIDE,
    "GraphicsError": _INSIDE + " Mistakes are MyroError here.",
    "Transform": _INSIDE,
}
"""Functions that are left out, with the reason, which each of them reports when called."""


def names() -> list[str]:
    """Return every name that is done or left out."""
    return [name for group in DONE.values() for name in group] + list(LEFT_OUT)


def left_out(name: str) -> Callable[..., NoReturn]:
    """Return a function of this name that refuses with its reason.

    Raises:
        KeyError: Nothing of that name is left out.
    """
    reason = LEFT_OUT[name]

    def function(*args: object, **kwargs: object) -> NoReturn:
        raise MyroError(f"{name}() is left out. {reason}")

    function.__name__ = function.__qualname__ = name
    function.__doc__ = f"Left out. {reason}"
    return function
