"""A robot under a camera: where it is to parts of a millimeter, whatever the tag, the light and the gaps."""

import math
from dataclasses import replace

import numpy as np
import pytest

from realitygap.errors import VisionError
from realitygap.testing import Film, FilmedCamera, path_through, save_film
from realitygap.vision import (
    Camera,
    Lens,
    Marks,
    RobotTag,
    Track,
    Tracker,
    VideoFile,
    corner_tags,
    find_beginning,
    track_video,
)
from realitygap.vision.track._camera import fit_camera
from realitygap.vision.track._track import track_of
from realitygap.vision.track._tracker import Sightings
from realitygap.world import Grid, load_arena, paper_arena

SMALL = FilmedCamera(width=960, height=540, noise=3.0)
TIMES = np.arange(0.0, 3.1, 0.5)
POSES = np.array([
    (0.2, 0.15, 0.3), (0.27, 0.18, 0.4), (0.33, 0.25, 1.2), (0.4, 0.33, 0.6), (0.5, 0.36, -0.2),
    (0.58, 0.33, -0.7), (0.65, 0.27, -0.5),
])  # fmt: skip


@pytest.fixture(scope="module")
def film():
    return Film(
        path_through(TIMES, POSES),
        3.0,
        rate=15.0,
        filmed=SMALL,
        missed=((1.6, 1.85),),
        lost=0.05,
        n_exposures=3,
    )


@pytest.fixture(scope="module")
def pictures(film):
    return list(film)


def _errors(track, film):
    off = track.poses - film.truth(track.times)
    turned = (off[:, 2] + np.pi) % (2 * np.pi) - np.pi
    return 1e3 * np.hypot(off[:, 0], off[:, 1]), np.degrees(turned)


@pytest.mark.slow
@pytest.mark.parametrize("is_lens_known", [True, False])
def test_poses_are_right_with_the_true_lens_and_with_one_fitted_to_the_tags(film, pictures, is_lens_known):
    marks = Marks(film.arena, RobotTag(), film.camera.lens if is_lens_known else None)
    found = track_video(pictures, marks)
    mm, deg = _errors(found.track, film)
    seen = found.track.seen
    assert np.sqrt(np.mean(mm[seen] ** 2)) < (0.5 if is_lens_known else 1.5)
    assert np.sqrt(np.mean(mm**2)) < 5
    assert np.sqrt(np.mean(deg[seen] ** 2)) < 0.5
    assert np.sqrt(np.mean(deg**2)) < 2
    assert found.warnings == ()


def test_pictures_in_which_a_hand_hides_the_tag_are_filled_in_and_marked(film, pictures):
    track = track_video(pictures, Marks(film.arena)).track
    hidden = (track.times > 1.62) & (track.times < 1.83)
    assert hidden.any()
    assert not track.seen[hidden].any()
    assert track.seen[~hidden].mean() > 0.9
    assert 0.25 <= track.longest_gap_s < 0.6
    assert np.isfinite(track.poses).all()


def test_a_height_that_is_left_out_moves_the_robot_by_its_parallax(film, pictures):
    sightings = track_video(pictures, Marks(film.arena)).sightings
    flat = Marks(film.arena, RobotTag(height=0.0), film.camera.lens).tracked(sightings)
    mm, _ = _errors(flat.track, film)
    assert mm.max() > 15  # which the right height takes out
    assert "larger than its size and height say" in flat.warnings[0]


@pytest.mark.slow
def test_a_tag_of_another_family_off_the_middle_and_turned_is_found_by_looking():
    tag = RobotTag(7, 0.06, 0.12, "aruco4x4", ahead=0.02, left=-0.01, turned=math.radians(90))
    film = Film(path_through(TIMES, POSES), 0.8, rate=15.0, filmed=SMALL, tag=tag)
    found = track_video(film, Marks(film.arena, replace(tag, family="")))
    mm, deg = _errors(found.track, film)
    assert found.tag.family == "aruco4x4"
    assert mm.max() < 3
    assert np.abs(deg).max() < 1


@pytest.mark.slow
def test_a_video_file_tells_the_same_as_its_pictures(film, pictures, tmp_path):
    path = tmp_path / "film.mp4"
    save_film(replace(film, lost=0.0, duration_s=1.0), str(path))
    video = VideoFile(path)
    assert video.size == (960, 540)
    assert [time for time, _ in video] == pytest.approx(np.arange(15) / 15, abs=1e-3)
    mm, _ = _errors(track_video(video, Marks(film.arena)).track, film)
    assert mm.max() < 3


def test_a_camera_is_found_with_three_corner_tags_and_not_with_two(film, pictures):
    seen = track_video(pictures[:6], Marks(film.arena)).sightings
    layout = corner_tags(film.arena)
    three = {number: seen.corners[number] for number in (0, 1, 3)}
    camera = fit_camera(film.size, three, layout, lens=film.camera.lens)
    assert camera.place == pytest.approx(film.camera.place, abs=0.01)
    with pytest.raises(VisionError, match=r"these were found: 0, 1\. Expected at least 3"):
        fit_camera(film.size, {number: three[number] for number in (0, 1)}, layout)


def test_corner_tags_that_changed_places_are_told_of(film, pictures):
    seen = track_video(pictures[:6], Marks(film.arena)).sightings
    corners = seen.corners
    swapped = {**corners, 0: corners[1], 1: corners[0]}
    with pytest.raises(VisionError, match="lower left, lower right"):
        fit_camera(film.size, swapped, corner_tags(film.arena), lens=film.camera.lens)


def test_a_robot_without_its_tag_is_told_of(film):
    empty = [(time, film._rest.astype(np.uint8)) for time in (0.0, 0.1)]
    with pytest.raises(VisionError, match=r"tag 10 is in none of 2 pictures"):
        track_video(empty, Marks(film.arena))
    with pytest.raises(ValueError, match="lies at a corner"):
        Tracker(RobotTag(2, family="36h11"))


def test_pixels_and_places_are_inverse_on_every_plane():
    camera = FilmedCamera(distortion=(-0.2, 0.05, 0.001, -0.002, 0.0)).camera(paper_arena())
    points = np.random.default_rng(1).uniform((0, 0), (1.06, 0.6), (50, 2))
    for z in (0.0, 0.1):
        pixels = camera.to_pixels(np.column_stack([points, np.full(50, z)]))
        assert camera.on_plane(pixels, z) == pytest.approx(points, abs=1e-6)


def test_corner_tags_lie_where_a_printed_sheet_has_them():
    tags = corner_tags(paper_arena())
    assert tags[0][:, :2] == pytest.approx(np.array([(0.01, 0.07), (0.07, 0.07), (0.07, 0.01), (0.01, 0.01)]))
    assert tags[2][0, :2] == pytest.approx((1.0668 - 0.07, 0.6096 - 0.01))
    assert (tags[1][:, 2] == 0).all()
    narrow = replace(paper_arena(), grid=Grid(0.03, 0.03, 0.1, 10, 5))
    assert corner_tags(narrow)[0][1, :2] == pytest.approx((-0.01, -0.01))  # no room inside: beside the walls
    with pytest.raises(ValueError, match="fit into the corners"):
        corner_tags(paper_arena(), 0.4, 0.01)


# tracks


def _straight_above(poses, tag, seen=None):
    """What a camera without lens errors would see straight from above: sightings and that camera."""
    lens = Lens(1000, 1000, (1000.0, 1000.0), (500.0, 500.0))
    camera = Camera(lens, np.diag([1.0, -1.0, -1.0]), np.array([-0.5, 0.5, 2.0]))
    model = tag.corners() @ np.array([1, 1j])
    around = model[None] * np.exp(1j * poses[:, 2:3])
    x, y = around.real + poses[:, :1], around.imag + poses[:, 1:2]
    points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, tag.height)])
    robot = camera.to_pixels(points).reshape(-1, 4, 2)
    if seen is not None:
        robot[~seen] = np.nan
    return Sightings(np.arange(len(poses)) / 10, robot, {}, 0.0, "36h11", (1000, 1000)), camera


def test_headings_go_on_over_full_turns_and_gaps_keep_their_speed():
    tag = RobotTag()
    heading = np.linspace(0, 5 * np.pi, 60)
    poses = np.column_stack([0.5 + 0.2 * np.cos(heading / 5), 0.5 + 0.2 * np.sin(heading / 5), heading])
    seen = np.ones(60, np.bool_)
    seen[20:25] = False
    track = track_of(*_straight_above(poses, tag, seen), tag)
    assert track.poses[:, 2] == pytest.approx(heading, abs=0.02)
    assert track.poses[:, :2] == pytest.approx(poses[:, :2], abs=3e-3)
    assert (track.seen == seen).all()


def test_a_leap_and_a_misshapen_tag_count_as_not_seen():
    tag = RobotTag()
    poses = np.column_stack([np.linspace(0.3, 0.5, 30), np.full(30, 0.4), np.zeros(30)])
    found, camera = _straight_above(poses, tag)
    found.robot[10] += 150
    found.robot[20, 0] += 12
    track = track_of(found, camera, tag)
    assert np.flatnonzero(~track.seen).tolist() == [10, 20]
    assert track.poses[:, :2] == pytest.approx(poses[:, :2], abs=2e-3)


def test_unseen_ends_have_no_poses_and_one_sighting_is_too_few():
    tag = RobotTag()
    poses = np.tile([0.4, 0.4, 0.0], (10, 1))
    seen = np.zeros(10, np.bool_)
    seen[3:8] = True
    track = track_of(*_straight_above(poses, tag, seen), tag)
    assert track.times.tolist() == pytest.approx([0.3, 0.4, 0.5, 0.6, 0.7])
    with pytest.raises(ValueError, match="which the camera saw"):
        track.at(np.array([0.2]))
    seen[4:] = False
    with pytest.raises(VisionError, match="1 of 10 pictures"):
        track_of(*_straight_above(poses, tag, seen), tag)


def _track_along(*points):
    poses = np.array([(*point, 0.0) for point in points])
    return Track(np.arange(len(poses)) / 10, poses, np.ones(len(poses), np.bool_))


def test_cells_are_those_along_the_line_in_the_order_of_first_visits():
    grid = Grid(0.0, 0.0, 0.1, 3, 2)
    line = [(0.05, 0.05), (0.25, 0.05), (0.25, 0.15), (0.25, 0.05), (0.5, 0.05)]
    assert _track_along(*line).cells(grid) == (0, 1, 2, 5)
    assert _track_along((-1.0, -1.0)).cells(grid) == ()


def test_cells_include_one_whose_corner_is_cut_by_less_than_a_millimeter():
    """Points a millimeter apart were looked up, so such a cell was missed; a simulated robot visits it."""
    assert _track_along((0.0503, 0.15), (0.1503, 0.05)).cells(Grid(0.0, 0.0, 0.1, 3, 2)) == (3, 4, 1)


def test_a_track_as_a_table_has_units_in_its_head():
    track = Track(np.array([0.0, 0.1]), np.array([(0.1, 0.2, 0.3), (0.2, 0.2, 0.3)]), np.array([True, False]))
    assert track.to_csv() == (
        "time_s,x_m,y_m,heading_rad,seen\n0.0000,0.10000,0.20000,0.30000,1\n0.1000,0.20000,0.20000,0.30000,0\n"
    )


def _driven(begins, commands, step_s=0.5, rate=30.0):
    """The track of a robot that does what it is told, from a time on."""
    n = len(commands)
    poses = [(0.3, 0.3, 0.0)]
    for move, turn in commands:
        x, y, heading = poses[-1]
        middle = heading + turn * 0.4
        poses.append(
            (x + 0.05 * move * math.cos(middle), y + 0.05 * move * math.sin(middle), heading + 0.8 * turn)
        )
    path = path_through(begins + np.arange(n + 1) * step_s, np.array(poses))
    times = np.arange(0.0, begins + n * step_s + 1.0, 1 / rate)
    return Track(times, np.array([path(float(time)) for time in times]), np.ones(len(times), np.bool_))


def test_a_trial_is_found_in_a_video_by_its_commands():
    commands = np.random.default_rng(3).uniform(-1, 1, (20, 2))
    times, stalled = np.arange(21) * 0.5, np.zeros(20, np.bool_)
    found = find_beginning(_driven(2.37, commands), times, commands, stalled)
    assert found.time == pytest.approx(2.37, abs=0.02)
    assert found.agreement > 0.98


def test_the_video_of_another_trial_or_a_short_one_is_refused():
    rng = np.random.default_rng(4)
    commands, others = rng.uniform(-1, 1, (20, 2)), rng.uniform(-1, 1, (20, 2))
    times, stalled = np.arange(21) * 0.5, np.zeros(20, np.bool_)
    with pytest.raises(VisionError, match="not clear"):
        find_beginning(_driven(2.0, others), times, commands, stalled)
    with pytest.raises(VisionError, match="Film it from before the start"):
        find_beginning(_driven(0.0, commands[:10]), times, commands, stalled)


def test_an_arena_of_another_size_has_its_tags_at_its_own_corners():
    arena = load_arena("paper")
    walls = tuple(tuple(2 * value for value in wall) for wall in arena.walls)
    tags = corner_tags(replace(arena, walls=walls))
    assert tags[2][1, :2] == pytest.approx((2 * 1.0668 - 0.01, 2 * 0.6096 - 0.01))
