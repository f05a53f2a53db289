"""Trials of twins as pictures and movies."""

import numpy as np
import pytest
from PIL import Image

from realitygap.errors import RobotError
from realitygap.playback import TwinDrive, save_twin_trial
from realitygap.robots import Command
from realitygap.robots.twin import TwinCamera, TwinModel, sample_twin
from realitygap.robots.twin import _camera as camera_module
from realitygap.world import Pose, paper_arena

pytestmark = pytest.mark.slow

pytest.importorskip("mujoco")

WIDTH = 240


@pytest.fixture(scope="module")
def camera():
    try:
        with TwinCamera(TwinModel(), paper_arena(), 360, 240) as opened:
            yield opened
    except RobotError as error:
        pytest.skip(str(error))


def red(picture):
    """Where the shell is: rows and columns."""
    r, g, b = (picture[..., k].astype(int) for k in range(3))
    return np.argwhere((r > 120) & (g < 70) & (b < 70))


def test_the_shell_is_seen_where_the_robot_is(camera):
    left, right = (red(camera.picture(Pose(x, 0.3, 0.0))) for x in (0.2, 0.8))
    assert len(left) > 100
    assert left[:, 1].mean() < 150 < 210 < right[:, 1].mean()
    low, high = (red(camera.picture(Pose(0.5, y, 0.0))) for y in (0.12, 0.5))
    assert low[:, 0].mean() > high[:, 0].mean() + 50


def test_a_movie_shows_it_drive(camera, tmp_path):
    trial = TwinDrive(sample_twin("close", 1), paper_arena(), 6, answer=lambda seen, step: Command(1.0, 0.0))
    path = save_twin_trial(trial, tmp_path / "a.gif", view="mujoco", speed=4.0, width=WIDTH)
    with Image.open(path) as movie:
        assert movie.n_frames >= 4
        frames = []
        for k in (0, movie.n_frames - 1):
            movie.seek(k)
            frames.append(np.asarray(movie.convert("RGB")))
    first, last = (red(frame)[:, 1].mean() for frame in frames)
    assert last > first + 30


def test_a_picture_shows_where_it_ends(camera, tmp_path):
    trial = TwinDrive(sample_twin("boxed", 1), paper_arena(), 2)
    with Image.open(save_twin_trial(trial, tmp_path / "a.png", width=WIDTH)) as picture:
        assert picture.size == (240, 160)


@pytest.mark.parametrize("family", ["close", "same"])
def test_a_twin_from_above_is_drawn_as_other_trials(family, tmp_path):
    trial = TwinDrive(sample_twin(family, 1), paper_arena(), 4)
    with Image.open(save_twin_trial(trial, tmp_path / "a.gif", view="above", width=WIDTH)) as movie:
        assert movie.n_frames > 2
        assert b"TWIN" in movie.info["comment"]


def test_a_machine_that_cannot_draw_falls_back_and_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr(camera_module, "DRIVERS", ("realitygap.no_such_driver",))
    trial = TwinDrive(sample_twin("close", 1), paper_arena(), 2)
    with pytest.warns(UserWarning, match=r"libegl1.*It is drawn from above"):
        assert save_twin_trial(trial, tmp_path / "a.gif", width=WIDTH).exists()
    with pytest.raises(RobotError, match="libosmesa6"):
        save_twin_trial(trial, tmp_path / "b.gif", view="mujoco", width=WIDTH)
    with pytest.raises(ValueError, match="This machine cannot draw"):
        save_twin_trial(trial, tmp_path / "b.png", width=WIDTH)
    assert [path.name for path in tmp_path.iterdir()] == ["a.gif"]


def test_sim_is_drawn_from_above_only(tmp_path):
    trial = TwinDrive(sample_twin("same", 1), paper_arena(), 2)
    with pytest.raises(RobotError, match="engine 'sim', which MuJoCo does not draw"):
        save_twin_trial(trial, tmp_path / "a.gif", view="mujoco", width=WIDTH)
