"""`realitygap track`, `print-tags` and `lens` as a user meets them: from a video to ledger, calibration and gap."""

import json
import sys
import warnings
from dataclasses import replace

import cv2
import numpy as np
import pytest

from realitygap.cli import main
from realitygap.errors import VisionError
from realitygap.families.thymio.playground._playground import why_not
from realitygap.records import (
    LEDGER_NAME,
    PATH_PARTS,
    Ledger,
    open_saved_trials,
    read_observations,
    write_observations,
)
from realitygap.study import (
    drive_study,
    gap_between,
    observations_head,
    open_target,
    parse_study,
    place_trial,
    sample_controllers,
    trial_of_ledger,
)
from realitygap.study._calibrate.one import calibrate_from
from realitygap.testing import Film, FilmedCamera, path_through, save_film
from realitygap.trials import TrialPlan
from realitygap.vision import Lens, Track, fit_lens, read_lens
from realitygap.world import paper_arena
from tests.cli.test_commands import realitygap
from tests.study.physical import Unattended, small_study

pytestmark = pytest.mark.slow

LEAD_S = 0.8
STEP_S = 0.5
CAMERA = FilmedCamera(width=960, height=540, noise=3.0)


@pytest.fixture
def command(monkeypatch, capsys, tmp_path):
    """A command in this process: status, output and errors."""
    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)

    def run(*words, cwd=tmp_path):
        monkeypatch.chdir(cwd)
        monkeypatch.setattr(sys, "argv", ["realitygap", *map(str, words)])
        try:
            main()
            status = 0
        except SystemExit as ended:
            status = ended.code or 0
        written = capsys.readouterr()
        return status, written.out, written.err

    return run


class _Looking(Unattended):
    """Knows where the robot drove, and leaves its cells to be counted by a camera."""

    def __init__(self):
        super().__init__()
        self.paths = {}

    def drawn(self, card, driven):
        score = super().drawn(card, driven)
        self.paths[card.trial.trial] = (np.array(score.path), set(score.cells))

    def enter(self, cards, *, is_full):
        return ()


def _driven_and_filmed(folder, study, port):
    """Drive a study without scoring it, and film its longest trial: its number, path, and cells."""
    operator = _Looking()
    drive_study(study, port, folder / "out", operator=operator)
    farthest = max(operator.paths, key=lambda number: np.ptp(operator.paths[number][0][:, :2], axis=0).sum())
    path, cells = operator.paths[farthest]
    with Ledger.open(folder / "out" / LEDGER_NAME, writable=False) as ledger:
        times = ledger.record(farthest).times
    began = times - times[0]
    times = np.append(began, began[-1] + STEP_S)
    rows = np.arange(len(path)) / PATH_PARTS
    at = LEAD_S + np.interp(rows, np.arange(len(times)), times)
    way = path_through(at, path)
    film = Film(way, at[-1] + 0.4, rate=12.0, filmed=CAMERA, missed=((2.0, 2.2),), n_exposures=3)
    save_film(film, str(folder / "film.mp4"))
    return farthest, path, cells


@pytest.fixture(scope="module")
def driven(tmp_path_factory):
    """A study whose first generation was driven and not scored, with a video of one of its trials."""
    folder = tmp_path_factory.mktemp("track")
    study = small_study("coverage", steps="8")
    return folder, *_driven_and_filmed(folder, study, "emulator://s2?fluke=1&speed=off")


def test_a_video_gives_a_table_an_overlay_and_the_lens(driven, command):
    folder, *_ = driven
    words = (
        "track",
        "--camera",
        "film.mp4",
        "--sheet",
        "-o",
        "t.csv",
        "--overlay",
        "o.mp4",
        "--save-lens",
        "l.toml",
    )
    status, out, err = command(*words, "--json", cwd=folder)
    assert (status, err) == (0, "")
    found = json.loads(out)
    assert found["tag"] == "36h11:10"
    assert found["corner_tags"] == [0, 1, 2, 3]
    assert found["camera_m"][2] == pytest.approx(1.2, abs=0.05)
    assert found["warnings"] == []
    assert found["written"] == ["t.csv", "l.toml", "o.mp4"]
    table = np.genfromtxt(folder / "t.csv", delimiter=",", names=True)
    assert len(table) == pytest.approx(found["pictures"], abs=2)
    assert (table["seen"] == 0).any()
    assert cv2.VideoCapture(str(folder / "o.mp4")).get(cv2.CAP_PROP_FRAME_COUNT) == found["pictures"]
    status, out, _ = command(
        "track", "--camera", "film.mp4", "--lens", "l.toml", "-o", "again.csv", cwd=folder
    )
    assert (status, "Written: again.csv" in out) == (0, True)
    again = np.genfromtxt(folder / "again.csv", delimiter=",", names=True)
    assert again["x_m"] == pytest.approx(table["x_m"], abs=1e-3)


def test_a_trial_of_a_ledger_is_found_scored_and_kept_for_calibrations(driven, command):
    folder, number, path, cells = driven
    words = ("track", "--camera", "film.mp4", "--study", "out", "--trial", number, "--into", "tracked.sqlite")
    status, out, err = command(*words, cwd=folder)
    assert (status, err) == (0, "")
    assert "Entered into the ledger of out." in out
    with Ledger.open(folder / "out" / LEDGER_NAME, writable=False) as ledger:
        assert ledger.trial(number).state == "scored"
        (score,) = ledger.scores()
        (note,) = ledger.notes(number)
    assert score["who"] == "camera"
    assert "video film.mp4, sha256 " in note["text"]
    assert len(set(score["cells"]) ^ cells) <= 1  # a line along a border may fall on either side
    assert 1 <= score["n_ends"] <= len(score["cells"])
    off = np.array(score["path"]) - path
    assert np.sqrt((off[:, :2] ** 2).sum(axis=1).mean()) < 0.01
    (trial,) = read_observations(folder / "tracked.sqlite").trials
    assert trial.observe == "track"
    assert trial.poses.shape == (9, 3)
    assert trial.genome
    status, _, err = command(*words, cwd=folder)
    assert status == 1
    assert "is scored; that can be done only while it is driven" in err
    assert len(read_observations(folder / "tracked.sqlite").trials) == 1


@pytest.mark.skipif(bool(why_not()), reason=why_not() or "-")
def test_a_camera_scores_a_trial_of_a_thymio(command, tmp_path):
    study = parse_study(
        """
[study]
name = "small"
replicates = 1
[controller]
inputs = ["range.0", "range.2", "range.4", "bias"]
[neat]
population = 2
generations = 1
[platform.thymio]
steps = 12
step_s = 0.5
[[condition]]
name = "robot"
platform = "thymio"
""",
        "small.toml",
    )
    number, path, cells = _driven_and_filmed(tmp_path, study, "thymio:emulator://playground")
    words = ("track", "--camera", "film.mp4", "--study", "out", "--trial", number)
    status, out, err = command(*words, "--begins", LEAD_S)  # its controller may hardly change its commands
    assert (status, err) == (0, "")
    assert "Entered into the ledger of out." in out
    with Ledger.open(tmp_path / "out" / LEDGER_NAME, writable=False) as ledger:
        (score,) = ledger.scores()
    assert score["who"] == "camera"
    assert len(set(score["cells"]) ^ cells) <= 1
    off = np.array(score["path"]) - path
    assert np.sqrt((off[:, :2] ** 2).sum(axis=1).mean()) < 0.02


def _seen_by_camera(trial, rng):
    """The track of a trial with errors like a camera's, at 30 pictures a second."""
    path = path_through(LEAD_S + np.arange(len(trial.poses)) * trial.step_s, trial.poses)
    times = np.arange(0.0, LEAD_S + len(trial.commands) * trial.step_s + 0.3, 1 / 30)
    poses = np.array([path(float(time)) for time in times])
    poses += rng.normal(0, (5e-4, 5e-4, 2e-3), poses.shape)
    return Track(times, poses, np.ones(len(times), np.bool_))


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Trials that were recorded without a camera, and the same with what a camera saw of them."""
    folder = tmp_path_factory.mktemp("recorded")
    with open_target("sim", paper_arena(), key=3) as target:
        plans = [
            TrialPlan(genome=each.genome, number=10 * k + i, steps=25)
            for k in range(2)
            for i, each in enumerate(sample_controllers("random", 5))
        ]
        trials = target.carry_out(plans, "track")
        bare = [replace(trial, poses=np.empty((0, 3)), wheels=np.empty((0, 2)), cells=()) for trial in trials]
        write_observations(folder / "bare.jsonl", observations_head(target, "cells"), bare)
    rng = np.random.default_rng(5)
    for trial in trials:
        wanted = trial_of_ledger(folder / "bare.jsonl", trial.number)
        found = place_trial(wanted, _seen_by_camera(trial, rng), LEAD_S)
        with open_saved_trials(folder / "tracked.sqlite", wanted.head) as file:
            file.append(found.trial)
    return folder, trials


def test_tracked_trials_have_the_poses_and_cells_of_the_true_ones(recorded):
    folder, trials = recorded
    for found, trial in zip(read_observations(folder / "tracked.sqlite").trials, trials, strict=True):
        assert found.poses[:, :2] == pytest.approx(trial.poses[:, :2], abs=3e-3)
        assert len(set(found.cells) ^ set(trial.cells)) <= 2
        assert (found.genome, found.number) == (trial.genome, trial.number)


def test_a_calibration_takes_tracked_trials(recorded):
    folder, _ = recorded
    made = calibrate_from("motion", folder / "tracked.sqlite")
    assert made.observe == "track"
    assert any(note.startswith("camera: about ") for note in made.notes)


def test_a_gap_is_measured_to_tracked_trials_and_their_commands_are_replayed(recorded):
    folder, _ = recorded
    found = gap_between("sim", f"recorded:{folder / 'tracked.sqlite'}", observe="track").study
    assert found.result.trials == (2, 2)
    assert len(found.controllers) == 5
    assert found.replay is not None
    assert found.replay.distance.shape[1] == 26
    assert found.replay.distance[:, 0].max() < 1e-6
    with pytest.raises(Exception, match="one more was requested"):
        gap_between(
            "sim", f"recorded:{folder / 'tracked.sqlite'}", controllers="paper", n_controllers=2, trials=2
        )


def test_tags_are_printed_at_true_scale(command, tmp_path):
    status, out, _ = command("print-tags", "-o", "tags.pdf", "--tag", "aruco5x5:3", "--paper", "letter")
    assert (status, out) == (0, "Written: tags.pdf (2 pages)\n")
    data = (tmp_path / "tags.pdf").read_bytes()
    assert data.startswith(b"%PDF")
    assert data.count(b"/MediaBox [ 0 0 612 792 ]") == 2


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--camera", "no.mp4"), "There is no video no.mp4"),
        (("--camera", "99"), "There is no camera 99"),
        (("--camera", "x", "--tag", "cat"), "tag is 'cat', expected a number"),
        (("--camera", "x", "--tag", "36h12:3"), "Did you mean '36h11'?"),
        (("--camera", "x", "--tag-at", "1,2"), "expected three numbers"),
        (("--camera", "x", "--tag-size", "0"), "expected a length above 0 m"),
        (("--camera", "x", "-o", "t.txt"), "does not end in .csv"),
        (("--camera", "x", "-o", "no/t.csv"), "There is no folder no"),
        (("--camera", "0", "--overlay", "o.mp4"), "Film first"),
        (("--camera", "x", "--trial", "3"), "--study DIR --trial NUMBER"),
        (("--camera", "x", "--study", "d", "--trials", "f", "--trial", "3"), "exclude each other"),
        (("--camera", "x", "--into", "f.sqlite"), "Name the trial: --study"),
        (("--camera", "x", "--lens", "no.toml"), "cannot be read as the file of a lens"),
        (("--camera", "x", "--sheet", "--corner-size", "0.1"), "--sheet defines the positions"),
        (("--camera", "x", "--arena", "no"), "no"),
    ],
)
def test_a_wrong_option_is_one_message(command, words, said):
    status, _, err = command("track", *words)
    assert status == 1
    assert said in err
    assert "Traceback" not in err
    assert err.count("\n") == 1


def test_a_file_that_is_no_video_is_told_of(command, tmp_path):
    (tmp_path / "text.mp4").write_text("no video")
    status, _, err = command("track", "--camera", "text.mp4")
    assert (status, "is no video that can be read" in err) == (1, True)


# lenses


def _board(lens, number):
    """A chessboard of 7 x 5 inner corners as a lens shows it from one side."""
    rng = np.random.default_rng(number)
    turn = cv2.Rodrigues(rng.uniform(-0.45, 0.45, 3))[0]
    shift = np.array([rng.uniform(-0.08, 0.08), rng.uniform(-0.04, 0.04), rng.uniform(0.3, 0.4)])
    x, y = np.meshgrid(np.arange(lens.width), np.arange(lens.height))
    pixels = np.stack([x, y], axis=-1).reshape(-1, 2).astype(float)
    rays = np.column_stack([lens.to_directions(pixels), np.ones(len(pixels))]) @ turn
    origin = -turn.T @ shift
    at = origin[:2] + rays[:, :2] * (-origin[2] / rays[:, 2])[:, None] + (0.1, 0.075)
    column, row = np.floor(at / 0.025).astype(int).T
    is_board = (column >= 0) & (column < 8) & (row >= 0) & (row < 6)
    image = np.where(is_board & ((column + row) % 2 == 0), 20, 230).astype(np.uint8)
    return cv2.GaussianBlur(image.reshape(lens.height, lens.width), (0, 0), 0.8)


def test_a_lens_is_fitted_to_a_chessboard_and_kept_in_a_file(command, tmp_path):
    lens = Lens(640, 360, (560.0, 560.0), (325.0, 176.0), (-0.2, 0.05, 0.0, 0.0, 0.0))
    writer = cv2.VideoWriter(str(tmp_path / "board.mp4"), cv2.VideoWriter_fourcc(*"mp4v"), 3.0, (640, 360))
    for number in range(9):
        writer.write(cv2.cvtColor(_board(lens, number), cv2.COLOR_GRAY2BGR))
    writer.release()
    status, out, err = command("lens", "--camera", "board.mp4", "--board", "7x5", "-o", "l.toml")
    assert (status, err) == (0, "")
    assert "Written: l.toml" in out
    found = read_lens(tmp_path / "l.toml")
    assert found.focal == pytest.approx(lens.focal, rel=0.02)
    corner = np.array([[20.0, 20.0]])
    assert found.to_directions(corner) == pytest.approx(lens.to_directions(corner), abs=0.02)


def test_a_lens_is_refused_for_another_shape_and_without_a_board(command, tmp_path):
    lens = Lens(640, 360, (560.0, 560.0), (320.0, 180.0))
    assert lens.scaled_to(1280, 720).focal == (1120.0, 1120.0)
    with pytest.raises(Exception, match="another shape"):
        lens.scaled_to(640, 480)
    with pytest.raises(Exception, match="Of 3 pictures 0 show a board"):
        fit_lens([np.zeros((90, 160), np.uint8)] * 3, 9, 6, 0.025)
    (tmp_path / "bad.toml").write_text("format = 'realitygap lens 1'\nwidth = 3\n")
    with pytest.raises(Exception, match="no file of a lens"):
        read_lens(tmp_path / "bad.toml")
    assert command("lens", "--camera", "x", "-o", "l.toml", "--board", "9")[0] == 1


@pytest.mark.parametrize(("number", "huge"), [("width = 640", "width = inf"), ("560.0, 560.0", "inf, 560.0")])
def test_lens_with_an_infinite_number_is_refused(tmp_path, number, huge):
    text = Lens(640, 360, (560.0, 560.0), (320.0, 180.0), rms=0.3).to_toml()
    assert number in text
    (tmp_path / "lens.toml").write_text(text.replace(number, huge))
    with pytest.raises(VisionError, match="no file of a lens"):
        read_lens(tmp_path / "lens.toml")


def test_help_answers_with_examples():
    for name in ("track", "print-tags", "lens"):
        done = realitygap(name, "--help")
        assert done.returncode == 0
        assert f"Example: realitygap {name}" in done.stdout
