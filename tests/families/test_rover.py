"""A family of robots of another package appears everywhere once it is installed."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from realitygap.cli._app import make_app
from realitygap.cli._commands import COMMANDS
from realitygap.errors import RobotError
from realitygap.lab._files import refuse_port
from realitygap.lab.pages._robot import _emulated_families
from realitygap.platforms import emulated_robots, open_target, platform_names, platform_of
from realitygap.robot_families import find_family, port_platforms, ports_by_family
from realitygap.robots import list_ports, open_on, split_port
from realitygap.study import calibrate, gap_between, parse_study
from realitygap.testing import check_robot
from realitygap.world import load_robot, paper_arena, robot_names
from tests.lab.conftest import RunningLab

PORT = "rover:emulator://rover"
QUICK = f"{PORT}?speed=off"
STUDY = """
[study]
name = "on-the-rover"
replicates = 1
[[condition]]
name = "rover"
platform = "rover"
"""


def install(folder: Path, value: str = "tests.families.rover:FAMILY", name: str = "rover") -> None:
    """Install the package of the family, as pip would."""
    about = folder / f"mylab_{name}-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: mylab-{name}\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(f"[realitygap.robots]\n{name} = {value}\n")


@pytest.fixture(autouse=True)
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    place = tmp_path / "site-packages"
    place.mkdir()
    install(place)
    monkeypatch.syspath_prepend(place)


def run(*words: str) -> str:
    commands = [command for command in COMMANDS if command.name == words[0]]
    done = CliRunner().invoke(make_app(commands), list(words), catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.output


def test_rover_is_short() -> None:
    package = Path(__file__).parent / "rover"
    files = [path for path in package.rglob("*") if path.suffix in (".py", ".toml")]
    assert len(files) == 4
    lines = [line for path in files for line in path.read_text("utf-8").splitlines() if line]
    assert len(lines) <= 150


def test_commands_of_robots_know_the_family() -> None:
    assert split_port(PORT) == ("rover", "emulator://rover")
    assert "rover:/dev/ttyUSB7" in [guess.port for guess in list_ports()]
    assert "rover:/dev/ttyUSB7" in run("robot", "list")
    assert "Rover" in run("robot", "info", QUICK)
    assert "rover" in run("platforms")
    assert "rover:PORT" in port_platforms()
    assert "rover:PORT" in ports_by_family()


def test_emulate_has_a_command_of_the_family(monkeypatch: pytest.MonkeyPatch) -> None:
    import importlib

    from realitygap.cli import _emulate

    importlib.reload(_emulate)
    assert "rover" in run("emulate", "--help")
    assert "--witness" in run("emulate", "rover", "--help")


def test_robot_keeps_the_contract() -> None:
    _, robot = open_on(QUICK)
    check_robot(robot)


def test_robot_file_is_found() -> None:
    assert "rover" in robot_names()
    assert load_robot("rover").name == "rover"


def test_pages_of_the_lab_offer_the_family(tmp_path: Path) -> None:
    assert PORT in emulated_robots()
    assert "rover" in [family.name for family in _emulated_families()]
    refuse_port(tmp_path, PORT)
    family = find_family("rover")
    assert family is not None
    assert len(family.range_readings[2]) == 2


def test_page_of_the_robot_shows_the_family(tmp_path: Path) -> None:
    lab = RunningLab(tmp_path / "studies")
    lab.start()
    try:
        assert "Use an emulated Rover" in lab.read("robot")
    finally:
        lab.stop()


def test_studies_can_be_on_the_platform() -> None:
    assert "rover" in platform_names()
    study = parse_study(STUDY, "rover.toml")
    assert study.conditions[0].on.name == "rover"
    assert study.conditions[0].on.base_robot == "rover"
    assert platform_of(PORT).needs_person is False


@pytest.mark.slow
def test_gap_and_calibrate_drive_the_robot(tmp_path: Path) -> None:
    gap = gap_between("sim:rover", QUICK, n_controllers=3, trials=2, observe="track")
    assert gap.study.result.target == QUICK
    with open_target(QUICK, paper_arena()) as target:
        fitted = calibrate("path", target, robot="rover", observe="track", trials_file=tmp_path / "a.sqlite")
    assert fitted.trials > 0


def test_unusable_family_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    place = tmp_path / "other"
    place.mkdir()
    install(place, "tests.families.rover:__name__", "broken")
    monkeypatch.syspath_prepend(place)
    with pytest.raises(RobotError, match="Robot family 'broken' of package mylab-broken"):
        list_ports()
