"""Every name of Myro is done or left out with a reason."""

import importlib.util
import inspect
from pathlib import Path

import pytest

import realitygap.classroom.myro as myro
from realitygap.classroom.myro import MyroError
from realitygap.classroom.myro._catalog import DONE, LEFT_OUT, names

# What `from myro import *` gives in Myro 2.9.9, less modules, constants of its inside and functions that begin with _.
# Source: myro/__init__.py, graphics.py, media.py, speech.py, chat.py, system.py.
MYRO = """
timer timeRemaining sendPicture register setPassword wait currentTime pickOne pickOneInRange heads tails flipCoin
randomNumber gamepad getGamepad getGamepadNow ask BackgroundThread Robot Computer computer requestStop initialize init
simulator translate rotate move forward backward turn turnLeft turnRight stop getPosition hereIs getAngle setAngle
beginPath moveTo moveBy turnTo turnBy arcTo arcBy endPath getMicEnvelope getMotorStats getEncoders openConnection
closeConnection get getVersion getLight getIR getDistance getLine getStall getInfo getAll getName getPassword
getForwardness getStartSong getVolume update beep scaleDown scaleUp set setLED setName setForwardness setVolume
setS2Volume setStartSong motors restart joyStick calibrate playSong playNote getBright getBlob getObstacle setIRPower
getBattery identifyRobot getIRMessage sendIRMessage setCommunicateLeft setCommunicateRight setCommunicateCenter
setCommunicateAll configureBlob setWhiteBalance darkenCamera manualCamera autoCamera setLEDFront setLEDBack setPicSize
servo getFlukeLog enablePanNetworking Column Array makeArray takePicture loadPicture copyPicture makePicture
writePictureTo savePicture show repaint getWindow draw undraw getWidth getHeight getPixel getPixels setPixel getX getY
getRed getGreen getBlue getColor getGray setRGB setRGBA getRGB getRGBA setRed setGreen setBlue setGray setAlpha getAlpha
setColor makeColor makeDarker makeLighter odd even wall loop doTogether beepScale getFilenames Scribbler Surveyor watch
Epuck SimScribbler getNoteFromFrequency song2text saveSong makeSong text2song readSong Song speak stopSpeaking setVoice
getVoice getVoices playSpeech playSound saveSpeech makeStory variables numberGame RemoteRobot LocalRobot Chat upgrade
upgrade_myro upgrade_scribbler upgrade_fluke GraphicsError moveToTop distance AskDialog askQuestion pickAFile pickAColor
pickAFolder GraphWin Transform GraphicsObject Point Rectangle Oval Circle Line Polygon Text Entry makePixmap Picture
Pixel Color Image Pixmap color_rgb rgb_color black white blue red green gray darkGray lightGray yellow pink magenta cyan
makeWindow makeImage makeEntry makePoint makeRectangle makeOval makeCircle makeLine makePolygon makeText Sound makeSound
play Joystick senses Calibrate rgb2hsv hls2rgb hsv2rgb rgb2hls rgb2yiq yiq2rgb yuv2rgb rgb2yuv
""".split()  # noqa: SIM905


def test_every_name_of_myro_is_done_or_left_out():
    assert set(MYRO) - set(names()) == set()


def test_names_beyond_myro_are_those_of_calico():
    # these are of Calico's Myro 3
    assert set(names()) - set(MYRO) == {"makeRobot", "penUp", "penDown", "joystick", "getKeyPressed"}


def test_no_name_is_listed_twice():
    assert len(names()) == len(set(names()))


def test_a_star_import_gives_every_name():
    space = {}
    exec("from realitygap.classroom.myro import *", space)
    assert {*names(), "MyroError"} == set(space) - {"__builtins__"}


def test_functions_that_are_left_out_give_a_reason_when_called():
    for name, reason in LEFT_OUT.items():
        assert reason.strip().endswith("."), name
        with pytest.raises(MyroError, match=rf"^{name}\(\) is left out\. "):
            getattr(myro, name)()


def test_every_supported_function_is_documented():
    for name in (name for group in DONE.values() for name in group):
        item = getattr(myro, name)
        if callable(item):
            assert inspect.getdoc(item), name
            other_names = ("init", "text2song", "writePictureTo")
            assert item.__name__ == name or inspect.isclass(item) or name in other_names, name


def test_functions_have_the_arguments_of_the_methods_without_the_robot():
    assert (
        str(inspect.signature(myro.forward))
        == "(speed: 'float' = 1, seconds: 'float | None' = None) -> 'None'"
    )


def test_the_page_of_reference_has_every_name(monkeypatch):
    path = Path(__file__).parents[3] / "docs" / "reference_pages.py"
    monkeypatch.syspath_prepend(path.parent)  # it imports its neighbors
    spec = importlib.util.spec_from_file_location("reference_pages_of_myro", path)
    pages = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(pages)
    page = pages.myro_functions()
    for name in names():
        assert f"`{name}`" in page or f"`{name}(" in page, name
    assert "| `forward(speed=1, seconds=None)` | Drive straight ahead. |" in page


def test_other_names_are_missing_as_usual():
    with pytest.raises(AttributeError, match="no attribute 'fly'"):
        _ = myro.fly
