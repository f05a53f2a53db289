"""`realitygap robot` with a Thymio."""

import json
from types import SimpleNamespace

import pytest
from serial.tools import list_ports
from typer.testing import CliRunner

from realitygap.cli._robot import robot
from realitygap.errors import RobotError
from realitygap.families.thymio import Playground
from realitygap.families.thymio._ports import label_of
from realitygap.families.thymio.playground._playground import why_not
from realitygap.robots import open_on, split_port


def device(name, vendor, product):
    return SimpleNamespace(device=name, vid=vendor, pid=product, description="", hwid="")


def test_the_list_names_a_thymio_and_its_dongle(monkeypatch):
    found = [device("/dev/ttyACM0", 0x0617, 0x000A), device("/dev/ttyACM1", 0x0617, 0x000C)]
    monkeypatch.setattr(list_ports, "comports", lambda: [*found, device("/dev/ttyUSB0", None, None)])
    done = CliRunner().invoke(robot, ["list", "--json"])
    seems = {each["port"]: each["seems"] for each in json.loads(done.stdout)}
    assert seems["thymio:/dev/ttyACM0"] == "a Thymio"
    assert seems["thymio:/dev/ttyACM1"] == "a Thymio's dongle"
    assert "/dev/ttyACM0" not in seems
    assert "/dev/ttyUSB0" in seems


def test_a_port_without_a_family_is_that_of_a_scribbler():
    assert split_port("/dev/rfcomm0") == ("scribbler", "/dev/rfcomm0")
    assert split_port("emulator://s2?fluke=2") == ("scribbler", "emulator://s2?fluke=2")
    assert split_port("thymio:socket://127.0.0.1:1") == ("thymio", "socket://127.0.0.1:1")


def test_only_a_serial_device_with_a_battery_is_real():
    assert label_of("/dev/ttyACM0", {"_vbat": (0, 2)}) == "REAL"
    assert label_of("/dev/ttyACM0", {}) == "EMULATED"
    assert label_of("/dev/pts/3", {"_vbat": (0, 2)}) == "EMULATED"
    assert label_of("socket://10.0.0.5:33333", {"_vbat": (0, 2)}) == "EMULATED"


@pytest.mark.parametrize(
    ("port", "message"),
    [
        ("thymio:", "expected thymio:PORT"),
        ("thymio:/dev/no-such", "plugged in"),
        ("thymio:socket://127.0.0.1:1", "does a playground listen"),
    ],
)
def test_a_port_that_cannot_be_opened_has_one_message(port, message):
    with pytest.raises(RobotError, match=message):
        open_on(port)


@pytest.mark.slow
@pytest.mark.skipif(bool(why_not(8.0)), reason=why_not(8.0) or "-")
def test_commands_work_on_a_playground():
    def run(*words):
        return CliRunner().invoke(robot, list(words))

    with Playground(speed=8.0) as playground:
        port = f"thymio:{playground.port}"
        assert json.loads(run("info", port, "--json").stdout)["name"] == "thymio-II"
        assert len(json.loads(run("sense", port, "--json").stdout)["prox.horizontal"]) == 7
        before = playground.pose()
        assert run("drive", port, "--seconds", "0.5", "--", "-0.5").exit_code == 0
        # 35 mm on an idle machine; the playground leaves out time in which it did not run
        assert playground.pose().x < before.x - 0.005
        assert run("stop", port).stdout == "The motors are off.\n"
        assert "no reading of its battery" in str(run("battery", port).exception)
        assert "has no picture" in str(run("picture", port).exception)
