"""A robot followed while it drives: a camera beside driver and emulator, and one that is lost."""

import threading
import time

import numpy as np
import pytest

from realitygap.errors import RobotError, StudyError, VisionError
from realitygap.families.scribbler import ScribblerPlatform
from realitygap.records import LEDGER_NAME, Ledger
from realitygap.study import (
    CameraObserver,
    drive_study,
)
from realitygap.study._physical import connect_robot
from realitygap.testing import Film, FilmedCamera, path_through
from realitygap.trials import Operator, RobotTarget, TrialPlan, WitnessObserver
from realitygap.vision import LiveTrack, Marks, Track, Tracked
from realitygap.vision.track import _video
from realitygap.world import paper_arena
from tests.study.physical import small_study

ARENA = paper_arena()


class _Played:
    """A film whose pictures come when somebody lets them, and whose clock is theirs."""

    name, rate = "camera 7", 15.0

    def __init__(self, pictures):
        self._pictures, self.time, self.size = pictures, 0.0, (640, 360)
        self.is_closed = False

    def __iter__(self):
        for at, image in self._pictures:
            self.time = at
            yield at, image
            time.sleep(0.002)

    def close(self):
        self.is_closed = True


@pytest.fixture(scope="module")
def film():
    poses = np.array([(0.3, 0.3, 0.2), (0.4, 0.32, 0.3), (0.5, 0.35, 0.2)])
    camera = FilmedCamera(width=960, height=540, noise=2.0)
    return Film(path_through(np.arange(3) * 0.4, poses), 0.8, rate=15.0, filmed=camera)


@pytest.mark.slow
def test_pictures_are_followed_as_they_come_and_forgotten_when_a_trial_begins(film):
    source = _Played(list(film))
    with LiveTrack(source, Marks(ARENA, lens=film.camera.lens), lambda: source.time) as live:
        track = live.tracked(until_s=0.7).track
        assert track.times[0] == 0.0
        assert track.poses[:, :2] == pytest.approx(film.truth(track.times)[:, :2], abs=2e-3)
        live.begin()
        with pytest.raises(VisionError, match="camera 7 gives no more pictures"):
            live.tracked(until_s=2.0)
    assert source.is_closed


def test_an_error_of_the_camera_reaches_the_caller_that_waits(film):
    def broken():
        yield next(iter(film))
        raise OSError("the cable is out")

    with (
        LiveTrack(_Played(broken()), Marks(ARENA), lambda: 0.0) as live,
        pytest.raises(VisionError, match="camera 7 failed: the cable is out"),
    ):
        live.tracked(until_s=1.0)


class _EmptyRoom:
    """Marks and a tracker for pictures without a robot, which take no time."""

    tag = None

    def tracked(self, found):
        return found

    def take(self, at, image):
        pass

    def sightings(self):
        return ()


@pytest.mark.slow
def test_a_picture_may_take_long_to_come_up_as_long_as_others_come(monkeypatch):
    """All of them together took longer than one may, so that the camera was said to give none."""
    room, has_to_end = _EmptyRoom(), threading.Event()
    monkeypatch.setattr(_video, "PATIENCE_S", 1.0)
    monkeypatch.setattr(_video, "Tracker", lambda tag: room)

    def pictures():
        for at in range(15):
            time.sleep(0.1)
            yield float(at), None
        has_to_end.wait(60)

    with LiveTrack(_Played(pictures()), room, lambda: 0.0) as live:
        assert live.tracked(until_s=14.0) == ()
        with pytest.raises(VisionError, match="camera 7 gave no picture for 1 s"):
            live.tracked(until_s=15.0)
        has_to_end.set()


class _AboveEmulator:
    """Sees an emulated robot as a camera would: at 30 pictures a second, with errors of half a millimeter."""

    def __init__(self, beside, late_s=0.0):
        """`beside` gives the observer that has the emulator's witness."""
        self._beside, self._late_s, self.now = beside, late_s, None

    def begin(self):
        witness = self._beside().witness
        self.now = witness.now
        self._began = witness.now()
        self._start = witness.pose()

    def tracked(self, until_s=None):
        path = self._beside().witness.path()
        times = np.arange(self._began + self._late_s, until_s + 1 / 30, 1 / 30)
        start = np.array([[self._began, *self._start]])
        path = np.concatenate([start, path[path[:, 0] > self._began]])
        poses = np.column_stack(
            [np.interp(times, path[:, 0], column) for column in np.unwrap(path[:, 1:4], axis=0).T]
        )
        poses += np.random.default_rng(1).normal(0, 5e-4, poses.shape)
        return Tracked(Track(times, poses, np.ones(len(times), np.bool_)), None, None, None, ())


def _drive(late_s=0.0, *, with_camera=True):
    beside = WitnessObserver()
    observer = (
        CameraObserver(_AboveEmulator(lambda: beside, late_s), ARENA, beside) if with_camera else beside
    )
    opened = connect_robot("emulator://s2?fluke=2&speed=off")
    plan = TrialPlan(commands=np.array([[1.0, 0.0]] * 4 + [[0.5, 0.5]] * 3), number=5)
    with RobotTarget(
        lambda: opened(ScribblerPlatform(reading_max=6400.0)), ARENA, observer, name="scribbler:emulated"
    ) as target:
        assert target.observes == "track"
        return target.carry_out([plan], "track")[0]


def test_a_trial_under_a_camera_has_poses_and_cells_like_those_of_the_witness():
    seen, true = _drive(), _drive(with_camera=False)
    assert (seen.end, seen.observe) == ("step limit", "track")
    assert seen.poses.shape == (8, 3)
    assert seen.poses[:, :2] == pytest.approx(true.poses[:, :2], abs=3e-3)
    assert np.cos(seen.poses[:, 2] - true.poses[:, 2]) == pytest.approx(np.ones(8), abs=1e-4)
    assert seen.cells == true.cells
    assert seen.wheels == pytest.approx(true.wheels)


def test_a_trial_that_the_camera_saw_in_part_is_lost_and_said_to_be():
    with pytest.raises(RobotError, match=r"saw the robot from 0\.\d to 3\.\d s of a trial of 3\.\d s"):
        _drive(late_s=1.0)


def watched(say, late_s=0.0):
    """An operator with a camera, for whom a witness puts the robot down."""
    beside = WitnessObserver()
    return Operator(CameraObserver(_AboveEmulator(lambda: beside, late_s), ARENA, beside, say))


def test_a_study_is_scored_by_a_camera_as_by_the_witness_and_says_what_it_did_not_see(tmp_path):
    study = small_study("coverage", steps="6")
    said = []
    port = "emulator://s2?fluke=1&speed=off"
    drive_study(study, port, tmp_path / "seen", operator=watched(said.append))
    drive_study(study, port, tmp_path / "true")
    with (
        Ledger.open(tmp_path / "seen" / LEDGER_NAME, writable=False) as seen,
        Ledger.open(tmp_path / "true" / LEDGER_NAME, writable=False) as true,
    ):
        pairs = list(zip(seen.scores(), true.scores(), strict=True))[:3]  # later ones are bred from these
    assert len(pairs) == 3
    for one, other in pairs:
        assert one["who"] == "camera"
        assert len(set(one["cells"]) ^ set(other["cells"])) <= 1
        off = np.array(one["path"])[:, :2] - np.array(other["path"])[:, :2]
        assert np.hypot(*off.T).max() < 0.01
    assert said[0].startswith("The camera counts ")
    result = drive_study(study, port, tmp_path / "late", operator=watched(said.append, late_s=1.0))
    assert result.physical.waiting
    assert "Count its cells by hand" in said[-1]


def test_a_camera_as_an_option_says_what_it_looks_for():
    from realitygap.cli._observer import parse_camera, under_camera

    number, marks = parse_camera("2?tag=aruco4x4:7&tag-height=0.12&corner-inset=-0.05", ARENA)
    assert (number, marks.tag.family, marks.tag.number, marks.tag.height) == (2, "aruco4x4", 7, 0.12)
    assert marks.corner_inset == -0.05
    for spec, said in (
        ("x", "expected a camera's number"),
        ("0?tga=3", "Did you mean 'tag'"),
        ("0?tag-size=a", "in meters"),
    ):
        with pytest.raises(StudyError, match=said):
            parse_camera(spec, ARENA)
    with pytest.raises(StudyError, match="report their poses"), under_camera("0", "sim", ARENA, None):
        pass
    with under_camera(None, "sim", ARENA, None) as nobody:
        assert nobody is None
