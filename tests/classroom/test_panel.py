"""What a panel does with the messages of its page, and without them."""

import math
import time

import pytest

from realitygap.classroom import DrivePanel, WorldPanel
from realitygap.classroom import _panel as panels
from realitygap.classroom.jyro import Camera, JyroWorld, Pioneer
from realitygap.errors import RealityGapError, RobotError
from realitygap.world import paper_arena


class Driven:
    """Keeps what it was told."""

    def __init__(self):
        self.told = []

    def drive(self, ahead, turn):
        self.told.append((ahead, turn))

    def stop(self):
        self.told.append("stop")


@pytest.fixture(autouse=True)
def _patient(monkeypatch):
    """A panel that is told nothing for a while stops its robot: not where a busy machine is late."""
    monkeypatch.setattr(panels, "HOLD_S", 60.0)


def tell(panel, kind, **content):
    """Send a message as a page does; the answers."""
    answers = []
    panel.widget.send = answers.append
    panel._hear(panel.widget, {"kind": kind, "n": 7, **content}, [])
    return answers


def world_panel(**options):
    world = JyroWorld(paper_arena())
    world.add(Pioneer(0.5, 0.3)).add(Camera())
    return WorldPanel(world, **options)


def test_a_held_handle_drives_and_a_released_one_stops():
    driven = Driven()
    panel = DrivePanel(driven.drive, driven.stop)
    assert tell(panel, "drive", ahead=0.5, turn=-2.0) == [{"kind": "heard", "n": 7}]
    assert tell(panel, "release") == [{"kind": "heard", "n": 7}]
    assert driven.told == [(0.5, -1.0), "stop"]


def test_a_silent_page_stops_the_robot_once(monkeypatch):
    driven = Driven()
    panel = DrivePanel(driven.drive, driven.stop)
    for wait in (60.0, 60.0, 0.05):
        monkeypatch.setattr(panels, "HOLD_S", wait)
        tell(panel, "drive", ahead=1.0, turn=0.0)
    deadline = time.monotonic() + 60
    while "stop" not in driven.told and time.monotonic() < deadline:
        time.sleep(0.01)
    time.sleep(0.1)
    assert driven.told == [(1.0, 0.0)] * 3 + ["stop"]


@pytest.mark.parametrize("value", [None, "1", math.nan, math.inf, [1]])
def test_values_that_are_no_numbers_give_no_command(value):
    driven = Driven()
    panel = DrivePanel(driven.drive, driven.stop)
    tell(panel, "drive", ahead=value)
    tell(panel, "release")
    assert driven.told == [(0.0, 0.0), "stop"]


def test_a_robot_that_fails_is_told_and_the_page_is_answered():
    def fail(*_):
        raise RobotError("No answer on COM3.")

    panel = DrivePanel(fail, fail)
    assert tell(panel, "drive", ahead=1.0, turn=0.0) == [{"kind": "heard", "n": 7}]
    assert panel.widget.problem == "No answer on COM3."
    panel._timer.cancel()


def test_a_world_moves_only_when_the_page_asks():
    panel = world_panel(speed=0.2, turn=1.0)
    robot, before = panel.robot, panel.robot.pose
    tell(panel, "drive", ahead=1.0, turn=0.5)
    assert (robot.speed, robot.turn_rate) == (0.2, 0.5)
    assert robot.pose == before
    tell(panel, "step")
    assert robot.pose.x > before.x
    assert panel.widget.clock == "0.1 s, step 1"
    tell(panel, "release")
    assert (robot.speed, robot.turn_rate) == (0.0, 0.0)
    tell(panel, "reset")
    assert (robot.pose, panel.world.n_steps) == (before, 0)


def test_a_world_of_short_steps_runs_as_fast_as_time():
    world = JyroWorld(paper_arena(), step_s=0.02)
    world.add(Pioneer(0.5, 0.3))
    panel = WorldPanel(world)
    tell(panel, "run")
    assert world.n_steps == 5


def test_another_robot_can_be_chosen_and_the_first_one_stops():
    panel = world_panel()
    second = panel.world.add(Pioneer(0.8, 0.3, name="second"))
    assert panel.widget.camera.startswith("data:image/png;base64,")
    tell(panel, "drive", ahead=1.0, turn=0.0)
    tell(panel, "choose", robot="second")
    assert panel.robot is second
    assert panel.world.robots[0].speed == 0.0
    assert panel.widget.camera == ""


def test_a_world_without_robots_and_numbers_below_0_are_refused():
    with pytest.raises(ValueError, match="The world has no robot"):
        WorldPanel(JyroWorld(paper_arena()))
    with pytest.raises(ValueError, match="speed is 0, expected a number above 0"):
        world_panel(speed=0)


def test_panel_without_anywidget_names_the_package_to_install(monkeypatch):
    def refuse(name):
        raise ImportError(name)

    panels.panel_class.cache_clear()
    monkeypatch.setattr("realitygap.playback._player.import_module", refuse)
    with pytest.raises(RealityGapError, match=r"(--extra |\[)notebook"):
        world_panel()
