"""The package `myro` 3.0.0 itself, in an environment of its own: what of it works in Python 3 must work here."""

import subprocess
import sys
import venv

import pytest

PROGRAM = """
import sys
from myro.robots.scribbler import Scribbler

robot = Scribbler(sys.argv[1])
model, fluke = sys.argv[2:]
assert robot.robotinfo == {"s1": "Scribbler", "s2": "Scribbler2"}[model]
assert robot.dongle == {"none": None, "2": "3.0.5"}[fluke]
robot.set("name", "Rosie")
assert robot.get("name") == "Rosie"
robot.set("password", "hush")
assert robot.get("password") == "hush"
assert len(robot.get("light")) == 3
assert robot.get("ir") in ([0, 0], [0, 1], [1, 0], [1, 1])
assert len(robot.get("line")) == 2
assert robot.get("stall") == 0
robot.setData(5, 77)
assert robot.getData(5) == 77
robot.setSingleData(6, 8)
assert robot.getData(6) == 8
for light in ("left", "center", "right", "all"):
    robot.set("led", light, "on")
    robot.set("led", light, "off")
robot.set("volume", "on")
robot.set("volume", "off")
robot.beep(0.05, 440)
robot.beep(0.05, 440, 880)
robot.move(0.5, 0.2)
robot.stop()
robot.hardStop()
robot.setFudge(1.1, 1, 1, 1)
robot.loadFudge()
assert len(robot.getLastSensors()["light"]) == 3
if model == "s2":
    robot.setHereIs(100, -50)
    robot.setAngle(90)
    robot.setBeginPath()
    robot.setTurn(10, "by", "deg")
    robot.setMove(20, 0, "by")
    robot.setEndPath()
    robot.stop()
    robot.setS2Volume(50)
    assert robot.getMotorStats()["Ready"] == [True]
    if fluke == "none":
        assert all(0 <= value <= 99 for value in robot.getDistance())
assert robot.ser.inWaiting() == 0
print("all calls answered")
import os
os._exit(0)
"""


@pytest.fixture(scope="module")
def python(tmp_path_factory):
    folder = tmp_path_factory.mktemp("myro")
    venv.create(folder, with_pip=True)
    python = folder / ("Scripts" if sys.platform == "win32" else "bin") / "python"
    subprocess.run([python, "-m", "pip", "install", "--quiet", "myro==3.0.0", "pillow", "numpy"], check=True)
    return python


@pytest.mark.long
@pytest.mark.parametrize(("model", "fluke"), [("s1", "none"), ("s2", "none"), ("s2", "2")])
def test_myro_of_the_package_index_drives_the_emulator(tmp_path, python, model, fluke):
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    emulate = [sys.executable, "-m", "realitygap", "emulate", "scribbler", "--model", model, "--fluke", fluke]
    done = subprocess.run(
        [*emulate, "--exec", f"{python} -W ignore {program} {{port}} {model} {fluke}"],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "all calls answered" in done.stdout
