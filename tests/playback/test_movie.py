"""Movies last as long as the trials did, are the same every time, and show what the trials did."""

import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from realitygap import Condition
from realitygap.drawing import PENS
from realitygap.errors import RealityGapError
from realitygap.platforms import JyroPlatform
from realitygap.playback import _movie, in_motion, save_movie
from realitygap.playback._movie import picture_period
from realitygap.playback._screen import TILE, TILE_VISITED, Screen, plain_style, ray_color, rgb
from realitygap.runs import replay, run_replicates
from realitygap.world import load_arena
from realitygap.world._floor import BARE_FLOOR

from .trials import straight, turning


def pictures_of(path):
    """What a viewer sees, picture by picture, and how long each [ms]."""
    with Image.open(path) as image:
        shown, lasts = [], []
        for k in range(image.n_frames):
            image.seek(k)
            shown.append(np.asarray(image.convert("RGB")).astype(int))
            lasts.append(image.info["duration"])
    return shown, lasts


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """Two trials as a movie, and the pictures that went into it."""
    trials = [straight(10), turning(2)]
    path = save_movie(trials, tmp_path_factory.mktemp("movie") / "a.gif", width=400)
    with plain_style():
        screen = Screen(trials, 400)
        return trials, path, [np.asarray(screen.picture(0.1 * k)).astype(int) for k in range(11)]


def test_a_gif_shows_what_was_drawn(drawn):
    """What is left out of a picture because it did not change must be there from the one before."""
    _, path, pictures = drawn
    shown, _ = pictures_of(path)
    assert len(shown) == len(pictures) == 11
    for seen, made in zip(shown, pictures, strict=True):
        apart = np.abs(seen - made).max(axis=2)
        assert (apart > 64).mean() < 0.002, "colors at edges are rounded to those of the palette"
        assert apart.mean() < 1.5


def test_a_gif_lasts_as_long_as_the_trial(tmp_path):
    for trial, speed, seconds in (
        (straight(10), 1.0, 1.0),
        (straight(10), 3.0, 1 / 3),
        (straight(87), 7.0, 8.7 / 7),
        (turning(8), 1.0, 4.0),
        (straight(10), 0.5, 2.0),
    ):
        _, lasts = pictures_of(save_movie(trial, tmp_path / "a.gif", speed=speed, width=240))
        assert sum(lasts[:-1]) / 1000 == pytest.approx(seconds, abs=0.0051)
        assert lasts[-1] == 1500
        assert min(lasts) >= 20, "programs show shorter ones longer"


def test_a_step_of_half_a_second_is_shown_in_parts():
    assert picture_period(0.5, 4.0) == pytest.approx(0.1)
    assert picture_period(0.1, 8.7) == pytest.approx(0.1)
    assert picture_period(0.01, 8.7) == pytest.approx(0.02)
    assert picture_period(0.1, 600.0) == pytest.approx(1.0), "600 pictures at most"


def test_the_same_trials_give_the_same_bytes(drawn, tmp_path):
    trials, path, _ = drawn
    assert save_movie(trials, tmp_path / "b.gif", width=400).read_bytes() == path.read_bytes()


def test_settings_of_matplotlib_make_no_difference(drawn, tmp_path):
    import matplotlib as mpl

    trials, path, _ = drawn
    with mpl.rc_context({"font.size": 30.0, "lines.linewidth": 9.0, "text.color": "red"}):
        assert save_movie(trials, tmp_path / "b.gif", width=400).read_bytes() == path.read_bytes()


@pytest.mark.slow
def test_a_trial_of_87_steps_is_less_than_a_megabyte(tmp_path):
    condition = Condition(name="novelty-50", selection="novelty", noise=0.5)
    rows = run_replicates(condition, 3, 1)
    row = rows.row(int(rows["coverage_line"].arg_max()), named=True)
    trial = in_motion(replay(condition, row), condition.arena.arena(), condition.on)
    path = save_movie(trial, tmp_path / "a.gif")
    assert path.stat().st_size < 600_000
    with Image.open(path) as image:
        assert image.n_frames == 88
        assert image.size == (720, 464)


def color_at(screen, picture, x, y):
    """The color of a picture where the arena has this place [m]."""
    across, down = screen._field.transData.transform((x, y))
    return tuple(int(part) for part in picture[round(picture.shape[0] - down), round(across)])


def test_trails_cells_and_rays_have_their_colors():
    trials = [straight(10), replace(straight(10, step_m=0.0), title="b")]
    with plain_style():
        screen = Screen(trials, 800)
        first, last = (np.asarray(screen.picture(time)) for time in (0.0, 1.0))
    grid, start = trials[0].arena.grid, trials[0].arena.start
    ahead = (grid.x + 4.5 * grid.cell, grid.y + 1.2 * grid.cell)
    assert color_at(screen, first, *ahead) == rgb(TILE)
    assert color_at(screen, last, *ahead) == rgb(TILE_VISITED)
    assert color_at(screen, last, start.x + 0.25, start.y) == rgb(PENS[0][0])
    # the middle ray, of 0.1 m where the sensor sees 0.2 m, and beyond its end
    wanted = [round(255 * part) for part in ray_color(0.5)]
    assert color_at(screen, first, start.x + 0.15, start.y) == pytest.approx(wanted, abs=24)
    assert color_at(screen, first, start.x + 0.215, start.y) == rgb(TILE)


def test_words_say_step_time_label_and_that_it_is_blocked():
    trial = replace(turning(8), label="EMULATED")
    with plain_style():
        screen = Screen([trial], 720)
        texts = [text.get_text() for text in screen._all.texts]
        screen.picture(0.0)
        before = screen._clock.get_text()
        screen.picture(4.0)
        after = screen._clock.get_text()
    assert texts[:2] == ["EMULATED", "turning"]
    assert before == "step 0 of 8 · 0.0 s · coverage 0.014"
    assert after == "× blocked · step 8 of 8 · 4.0 s · coverage 0.014"


def test_a_small_picture_has_room_for_what_matters():
    trial = replace(turning(8), title="a name that is far too long for a picture as small as this one is")
    with plain_style():
        screen = Screen([trial], 320)
        screen.picture(4.0)
        renderer = screen._canvas.get_renderer()
        title = screen._all.texts[1].get_window_extent(renderer)
        clock = screen._clock.get_window_extent(renderer)
    assert screen._clock.get_text() == "× · 8 of 8 · 4.0 s"
    assert title.x1 < clock.x0


@pytest.mark.parametrize("name", ["goal", "light", "paper-boxes", "maze-hard"])
def test_obstacles_lights_goal_and_floor_of_an_arena_are_shown(name):
    arena = load_arena(name)
    still = SimpleNamespace(
        step_s=0.1,
        poses=np.array([arena.start, arena.start]),
        readings=np.full((2, 3), 0.2),
        stalled=np.zeros(2, np.bool_),
    )
    with plain_style():
        shown, bare = (
            np.asarray(Screen([in_motion(still, where, JyroPlatform())], 400).picture(0.0)).astype(int)
            for where in (arena, replace(arena, obstacles=(), lights=(), goal=None, floor=BARE_FLOOR))
        )
    same = shown.shape == bare.shape
    assert not same or (np.abs(shown - bare).max(axis=2) > 30).sum() > 20


@pytest.mark.slow
def test_an_mp4_plays_as_long_as_the_trial(tmp_path):
    path = save_movie(turning(4), tmp_path / "a.mp4", width=241, speed=2.0)
    ffmpeg = _movie.find_ffmpeg()
    said = subprocess.run([ffmpeg, "-i", str(path)], capture_output=True, text=True, check=False).stderr
    assert "Duration: 00:00:01.0" in said
    assert "h264" in said
    assert "yuv420p" in said
    raw = subprocess.run(
        [ffmpeg, "-loglevel", "error", "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"],
        capture_output=True,
        check=True,
    ).stdout
    with plain_style():
        screen = Screen([turning(4)], 241)
        made = np.asarray(screen.picture(2.0)).astype(int)
    frames = np.frombuffer(raw, np.uint8).reshape(-1, *made.shape).astype(int)
    assert len(frames) == 31
    assert np.abs(frames[-1] - made).mean() < 4


def test_an_mp4_without_ffmpeg_is_refused_in_one_sentence(tmp_path, monkeypatch):
    monkeypatch.setattr(_movie.shutil, "which", lambda name, path=None: None)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(RealityGapError, match=r"needs the program ffmpeg.*(--extra |\[)video"):
        save_movie(straight(), tmp_path / "a.mp4")
    monkeypatch.setattr(_movie.shutil, "which", lambda name, path=None: "/bin/false")
    with pytest.raises(RealityGapError, match="did not make the movie"):
        save_movie(straight(), tmp_path / "a.mp4")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"speed": 0.0}, "speed is 0, expected a number from 0.01 to 100"),
        ({"speed": float("nan")}, "speed is nan"),
        ({"width": 100}, "width is 100, expected 240 to 1920 pixels"),
        ({"path": "a.gfi"}, "a.gfi ends in .gfi, expected .gif or .mp4. Did you mean '.gif'"),
        ({"trials": [straight()] * 9}, "9 trials to show together, expected at most 8"),
    ],
)
def test_mistakes_are_told_before_anything_is_drawn(tmp_path, changes, message):
    given = {"trials": straight(), "path": "a.gif"} | changes
    with pytest.raises(ValueError, match=message):
        save_movie(given.pop("trials"), tmp_path / given.pop("path"), **given)
    assert not list(tmp_path.iterdir())
