"""A robot that is watched does what it does alone, and the page hears of all of it."""

from types import SimpleNamespace

import numpy as np
import pytest

import realitygap.emulator  # noqa: F401 - makes its ports known
from realitygap import Condition
from realitygap.errors import RealityGapError
from realitygap.families.scribbler import Scribbler
from realitygap.platforms import JyroRobot
from realitygap.playback import WatchedRobot, _live, play
from realitygap.robots import Command, Robot
from realitygap.runs import genome_of, run_replicates
from realitygap.testing import check_robot
from realitygap.trials import NoiseKey, drive_trial
from realitygap.world import Pose
from tests.trials.fake_robot import FakeRobot

from .trials import straight


@pytest.fixture
def heard(monkeypatch):
    """What pages are told, and no waiting."""
    messages = []
    monkeypatch.setattr(_live, "_sleep", lambda seconds: None)
    monkeypatch.setattr(_live, "PERIOD_S", 0.0)

    def listen(watched):
        monkeypatch.setattr(watched.widget, "send", lambda content, buffers=None: messages.append(content))
        return watched

    listen.messages = messages
    return listen


def told(messages):
    return [message for message in messages if message["kind"] == "now"]


def test_a_network_drives_it_as_it_drives_the_robot_alone(heard):
    condition = Condition(name="novelty-50", selection="novelty", noise=0.5)
    row = run_replicates(condition, 3, 1).row(33, named=True)
    key = NoiseKey(row["key"], row["replicate"], row["generation"], row["individual"])
    platform = condition.on.model_copy(update={"precision": "double"})
    make = lambda: JyroRobot(platform, noise=0.5, noise_key=key)  # noqa: E731
    alone = make()
    network = genome_of(condition, row).network()
    plain = drive_trial(alone, network, 87)
    network.reset()
    watched = heard(WatchedRobot(make()))
    assert isinstance(watched, Robot)
    again = drive_trial(watched, network, 87)
    np.testing.assert_array_equal(again.readings, plain.readings)
    assert watched.coverage == alone.coverage
    trial = watched.trial
    assert trial.cells == alone.visited_cells
    assert trial.n_steps == 87
    assert tuple(trial.poses[-1]) == tuple(alone.pose)
    assert int(trial.stalled.sum()) == plain.n_stalls
    cells = [cell for message in told(heard.messages) for cell in message["cells"]]
    assert tuple(cells) == alone.visited_cells, "each cell is told once"
    assert told(heard.messages)[-1]["step"] == 87
    assert watched.widget.live is False
    assert len(watched.widget.trials[0]["poses"]) == 88, "and can be played again"


def test_it_meets_the_contract_of_robots(heard):
    assert check_robot(heard(WatchedRobot(JyroRobot()))) is None or True
    watched = heard(WatchedRobot(JyroRobot()))
    with watched as robot:
        robot.reset(Pose(0.5, 0.3, 1.0))
        assert tuple(robot.trial.poses[0]) == pytest.approx((0.5, 0.3, 1.0))
        with pytest.raises(ValueError, match="move is 2"):
            robot.drive(Command(2.0, 0.0))
        assert robot.trial.n_steps == 0


@pytest.fixture
def clock(monkeypatch):
    """Time that passes only when a test lets it, so that a busy machine does not count."""
    clock = SimpleNamespace(now=10.0, slept=[], monotonic=lambda: clock.now)
    monkeypatch.setattr(_live, "time", clock)
    monkeypatch.setattr(_live, "_sleep", clock.slept.append)
    return clock


def test_pages_hear_at_most_twenty_times_a_second_and_miss_nothing(monkeypatch, clock):
    watched = WatchedRobot(JyroRobot(), speed=None)
    messages = []
    monkeypatch.setattr(watched.widget, "send", lambda content, buffers=None: messages.append(content))
    watched.reset()
    began, n_steps = clock.now, 200
    for _ in range(n_steps):
        clock.now += 0.002
        watched.drive(Command(0.1, 0.2))
    seconds = clock.now - began
    assert clock.slept == [], "it is not held back"
    assert seconds / _live.PERIOD_S - 1 <= len(told(messages)) <= seconds / _live.PERIOD_S + 2
    watched._asked(None, {"kind": "all"}, None)
    assert [message["kind"] for message in messages[-2:]] == ["begin", "now"]
    assert len(messages[-1]["trail"]) >= n_steps
    assert messages[-1]["cells"] == list(watched.robot.visited_cells)


def test_a_simulated_robot_is_held_back_and_a_real_one_never(monkeypatch, clock):
    robot = JyroRobot()
    drive = robot.drive

    def drive_slowly(command):
        clock.now += 0.02
        drive(command)

    monkeypatch.setattr(robot, "drive", drive_slowly)
    watched = WatchedRobot(robot, speed=2.0)
    watched.reset()
    watched.drive(Command(0.1, 0.0))
    assert clock.slept == pytest.approx([0.03])
    real = WatchedRobot(FakeRobot())
    real.label = "REAL"
    real.reset()
    real.drive(Command(0.1, 0.0))
    assert len(clock.slept) == 1


def test_an_emulated_scribbler_is_seen_by_its_witness(heard):
    with Scribbler("emulator://s2?fluke=2&speed=off") as robot:
        watched = heard(WatchedRobot(robot))
        watched.reset()
        start = watched.trial.poses[0]
        assert watched.label == "EMULATED"
        seen = watched.observe()
        assert len(seen.readings) == len(watched.trial.shape.mounts)
        for _ in range(4):
            watched.drive(Command(0.8, 0.0))
        watched.stop()
        trial = watched.trial
        assert np.hypot(*(trial.poses[-1] - start)[:2]) > 0.1
        assert trial.arena.grid.n_cells == 72
        assert told(heard.messages)[-1]["pose"][0] != pytest.approx(start[0])
        assert watched._thread is None


def test_a_robot_of_which_nobody_knows_where_it_is_is_shown_alone(heard):
    watched = heard(WatchedRobot(FakeRobot()))
    watched.reset()
    watched.observe()
    watched.drive(Command(0.5, 0.0))
    assert "walls" not in watched.widget.scene
    assert watched.widget.trials[0]["placed"] is False
    assert told(heard.messages)[-1]["pose"] == [0.0, 0.0, 0.0]
    assert told(heard.messages)[-1]["cells"] == []


def test_live_view_without_anywidget_names_the_package_to_install(monkeypatch):
    from realitygap.playback import _player

    _player.player_class.cache_clear()
    monkeypatch.setitem(__import__("sys").modules, "anywidget", None)
    with pytest.raises(RealityGapError, match=r"(--extra |\[)notebook"):
        play(straight())
    with pytest.raises(RealityGapError, match=r"(--extra |\[)notebook"):
        WatchedRobot(JyroRobot())


def test_mistakes_are_told():
    with pytest.raises(ValueError, match=r"speed is 3, expected one of 0\.25, 0\.5, 1, 2, 4, 8"):
        play(straight(), speed=3)
    with pytest.raises(ValueError, match="9 trials to show together"):
        play([straight()] * 9)
