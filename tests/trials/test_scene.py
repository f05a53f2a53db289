"""Cases that real Jyro 0.3.2 ran, and the file that comes out."""

from __future__ import annotations

import csv
import json
import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from realitygap.errors import CaseError
from realitygap.trials._scene import SceneTrack, simulate_case, simulate_file
from realitygap.world._case import Case

DATA = Path(__file__).parent.parent / "data"
CASES = sorted(DATA.glob("jyro*/*.json"))

# Promised: open-loop poses 1e-9, sensors 5e-6, closed loop 1e-4. Jyro's own rounding is repeated, so what is
# left is the last bit of sine, tanh and squares, which mathematical libraries may choose differently.
CLOSE = 1e-9


def table(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def small_case(**changes: Any) -> dict[str, Any]:
    robot = {
        "start": {"x": 0.2, "y": 0.3, "heading": 0},
        "commands": [[1, 0], [0, 1]],
        "devices": [{"kind": "MyroIR"}],
    }
    return {"steps": 2, "world": {"boxes": [[0, 0, 1.0668, 0.6096]]}, "robots": [robot]} | changes


def test_all_cases_are_here() -> None:
    assert len(CASES) == 29 + 9


@pytest.mark.parametrize("path", CASES, ids=[path.stem for path in CASES])
def test_a_case_goes_as_in_jyro(path: Path, tmp_path: Path) -> None:
    simulate_file(path, tmp_path / "out.csv")
    expected, came = table(path.with_suffix(".csv")), table(tmp_path / "out.csv")
    assert len(came) == len(expected)
    for want, got in zip(expected, came, strict=True):
        assert list(got) == list(want)  # the same columns in the same order
        for column, text in want.items():
            where = f"step {want['step']}, robot {want['robot']}, {column}"
            if column in ("step", "robot", "stall") or text == "":
                assert got[column] == text, where
            else:
                assert float(got[column]) == pytest.approx(float(text), rel=0, abs=CLOSE), where


def test_the_file_is_written_in_jyros_way(tmp_path: Path) -> None:
    case = DATA / "jyro" / "s01_straight_full.json"
    simulate_file(case, tmp_path / "out.csv")
    assert (tmp_path / "out.csv").read_bytes().splitlines()[0] == case.with_suffix(
        ".csv"
    ).read_bytes().splitlines()[0]
    assert (tmp_path / "out.csv").read_text().splitlines()[1] == (
        "0,0,0.0,0.15,0.3,-1.5707963267948966,0,0.0,0.0,10000.0,0.2,0.2,0.2"
    )


def test_robots_with_fewer_sensors_leave_their_last_columns_empty(tmp_path: Path) -> None:
    blind = {"start": {"x": 0.8, "y": 0.3, "heading": 0}, "commands": [[0, 0]] * 2}
    case = small_case()
    case["robots"].append(blind)
    simulate_case(Case.from_dict(case)).write_csv(tmp_path / "out.csv")
    rows = table(tmp_path / "out.csv")
    assert [row["s1"] == "" for row in rows] == [False, True] * 3


def test_no_steps_is_the_start_alone() -> None:
    track = simulate_case(Case.from_dict(small_case(steps=0)))
    assert track.poses.tolist() == [[[0.2, 0.3, 0.0]]]
    assert track.readings[0].shape == (1, 2)


def test_commands_beyond_the_steps_are_not_used() -> None:
    track = simulate_case(Case.from_dict(small_case(steps=1)))
    assert track.commands[:, 0].tolist() == [[0.0, 0.0], [1.0, 0.0]]


def test_segments_stand_in_for_boxes_and_walls_only_where_there_are_none() -> None:
    segments = [[0.0, 0.4, 1.0, 0.4]]
    alone = simulate_case(Case.from_dict(small_case(world={"segments": segments, "boxes": []})))
    beside = simulate_case(
        Case.from_dict(small_case(world={"segments": segments, "boxes": [[0, 0, 1, 0.6]]}))
    )
    assert (alone.stalls[1, 0], beside.stalls[1, 0]) == (1, 0)


def test_halving_the_step_brings_an_arc_closer_to_the_circle() -> None:
    """Euler with the old heading is of first order: half the step, half the error."""
    errors = []
    for halvings in range(4):
        n = 20 * 2**halvings
        robot = {"start": {"x": 0.0, "y": 0.0, "heading": 0}, "commands": [[1.0, 1.0]] * n}
        case = Case.from_dict({"steps": n, "dt": 2.0 / n, "world": {}, "robots": [robot]})
        x, y = simulate_case(case).poses[-1, 0, :2]
        errors.append(math.hypot(x - (math.cos(2.0) - 1.0), y - math.sin(2.0)))
    ratios = [before / after for before, after in pairwise(errors)]
    assert ratios == pytest.approx([2.0] * 3, abs=0.1)


def test_a_mirrored_scene_gives_mirrored_paths() -> None:
    rng = np.random.default_rng(5)
    commands = rng.uniform([0, -1], [1, 1], (60, 2)).tolist()

    def track(side: int) -> SceneTrack:
        robot = {
            "start": {"x": side * 0.4, "y": 0.3, "heading": side * 0.5},
            "devices": [{"kind": "range", "geometry": [[0.09, side * 0.05, side * 0.2]], "max_range": 0.3}],
            "commands": [[v, side * w] for v, w in commands],
        }
        world = {"boxes": [[0, 0, side * 1.0, 0.7]], "walls": [[side * 0.6, 0, side * 0.9, 0.3]]}
        return simulate_case(Case.from_dict({"steps": 60, "world": world, "robots": [robot]}))

    one, other = track(1), track(-1)
    assert (one.stalls == other.stalls).all()
    assert one.stalls.any()
    np.testing.assert_allclose(one.poses[..., 0], -other.poses[..., 0], atol=1e-9)
    np.testing.assert_allclose(one.poses[..., 1], other.poses[..., 1], atol=1e-9)
    np.testing.assert_allclose(one.readings[0], other.readings[0], atol=1e-6)  # rounding is not symmetric


# the file


def test_a_result_replaces_an_older_one(tmp_path: Path) -> None:
    out = tmp_path / "out.csv"
    out.write_text("old")
    simulate_case(Case.from_dict(small_case())).write_csv(out)
    assert out.read_text().startswith("step,robot,time,")
    assert list(tmp_path.iterdir()) == [out]


def test_a_failure_while_writing_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "out.csv"
    out.write_text("old")

    def fail(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", fail)
    with pytest.raises(CaseError, match="No space left on device"):
        simulate_case(Case.from_dict(small_case())).write_csv(out)
    assert out.read_text() == "old"
    assert list(tmp_path.iterdir()) == [out]


def test_a_place_that_cannot_be_written_is_one_message(tmp_path: Path) -> None:
    track = simulate_case(Case.from_dict(small_case()))
    with pytest.raises(CaseError, match="Could not write"):
        track.write_csv(tmp_path / "nowhere" / "out.csv")
    with pytest.raises(CaseError, match="Could not write"):
        track.write_csv(tmp_path)


def test_the_case_itself_is_never_overwritten(tmp_path: Path) -> None:
    case = tmp_path / "case.json"
    case.write_text("{}")
    with pytest.raises(CaseError, match="would overwrite the case itself"):
        simulate_file(case, tmp_path / "." / "case.json")
    assert case.read_text() == "{}"


def test_numbers_beyond_float64_are_refused(tmp_path: Path) -> None:
    """A file full of nan and inf was written, and all was well."""
    case = small_case(dt=1e308, steps=3)
    case["robots"][0]["commands"] = [[1.0, 1.0]] * 3
    with pytest.raises(CaseError, match=r"no finite numbers from step \d on: dt 1e\+308"):
        simulate_case(Case.from_dict(case))


@pytest.mark.parametrize("name", ["track.json", "track.html", "track.CSV.png"])
def test_a_track_is_a_csv_file(tmp_path: Path, name: str) -> None:
    case = tmp_path / "case.json"
    case.write_text(json.dumps(small_case()))
    with pytest.raises(CaseError, match=r"expected \.csv"):
        simulate_file(case, tmp_path / name)
    assert list(tmp_path.iterdir()) == [case]
    simulate_file(case, tmp_path / "track.CSV")


def test_a_track_never_takes_the_place_of_results(tmp_path: Path) -> None:
    (tmp_path / "study.json").write_text("{}")
    (tmp_path / "trials").mkdir()
    track = simulate_case(Case.from_dict(small_case()))
    for name in ("study.json", "trials/a.csv"):
        with pytest.raises(CaseError, match="nothing was written"):
            track.write_csv(tmp_path / name)
    assert (tmp_path / "study.json").read_text() == "{}"
