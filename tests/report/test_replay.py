"""What the replay embeds in the page: which trials, how exactly, and that it stays data."""

import base64
import hashlib
import itertools
import json
import re
import zlib

import numpy as np
import polars as pl
import pytest

from realitygap.errors import RecordError
from realitygap.report import _replay, write_report
from realitygap.report._tally import read_tally, settings_of
from realitygap.runs import Condition, replay
from tests.report.results import describe, random_runs, write_results


def embedded(html: str) -> dict:
    return json.loads(
        re.search(r'<script type="application/json" id="replay-data">(.*?)</script>', html, re.S)[1]
    )


def bytes_of(data: dict) -> bytes:
    """The bytes of all trials."""
    return zlib.decompress(base64.b64decode(data["bytes"]), -zlib.MAX_WBITS)


def columns_of(packed: bytes, lengths: list[int]) -> list[np.ndarray]:
    """The columns of a trial's bytes, written for the eye and not for speed."""
    numbers, number, shift = [], 0, 0
    for byte in packed:
        if len(numbers) == sum(lengths):  # the next trial
            break
        number |= (byte & 127) << shift
        shift += 7
        if byte < 128:
            numbers.append(-(number + 1) // 2 if number % 2 else number // 2)
            number = shift = 0
    assert len(numbers) == sum(lengths)
    ends = np.cumsum([0, *lengths])
    return [np.cumsum(numbers[first:last]) for first, last in itertools.pairwise(ends)]


@pytest.fixture(scope="module")
def tiny(tiny_study, tiny_html):
    """The tiny study's tally, and what its page embeds."""
    return read_tally(tiny_study), embedded(tiny_html)


def rows_of(tally, name):
    return tally.folder.read(name, [tally.typical_replicate(name)])


def test_the_typical_run_of_each_condition_is_embedded_whole(tiny):
    tally, data = tiny
    assert [condition["name"] for condition in data["conditions"]] == ["coverage", "novelty", "turn", "ends"]
    for condition in data["conditions"]:
        assert condition["run"] == tally.typical_replicate(condition["name"])
        rows = rows_of(tally, condition["name"])
        assert [tuple(trial[:2]) for trial in condition["trials"]] == rows.select(
            "generation", "individual"
        ).rows()
        grid = condition["scene"]["grid"]
        n_cells = grid["columns"] * grid["rows"]
        assert [trial[2] / n_cells for trial in condition["trials"]] == rows["coverage_line"].to_list()
        assert [trial[3] / n_cells for trial in condition["trials"]] == rows["coverage_ends"].to_list()


def test_trials_are_those_recomputed_within_half_a_unit(tiny):
    tally, data = tiny
    length, angle, output = (data["units"][name] for name in ("length", "angle", "output"))
    for described in data["conditions"]:
        condition = Condition.from_settings(
            described["name"], dict(settings_of(tally.condition(described["name"])))
        )
        rows = rows_of(tally, described["name"]).iter_rows(named=True)
        for row, (_, _, n_line, n_ends, step_s, place) in zip(rows, described["trials"], strict=True):
            trajectory = replay(condition, row)
            t = described["steps"]
            x, y, heading, *rest = columns_of(
                bytes_of(data)[place:], [t + 1] * 6 + [t] * 3 + [t + 1] + [n_line] * 2 + [n_ends]
            )
            *readings, sees, move, turn, stalled, cells, _, _ = rest
            exact = 1e-9
            assert step_s == trajectory.step_s
            for column, values in zip(
                [x, y, *readings], [*trajectory.poses.T[:2], *trajectory.readings.T], strict=True
            ):
                assert abs(column * length - values).max() <= length / 2 + exact
            assert abs(heading * angle - trajectory.poses[:, 2]).max() <= angle / 2 + exact
            for column, values in zip(
                [sees, move, turn], [trajectory.inputs[:, 0], *trajectory.commands.T], strict=True
            ):
                assert abs(column * output - values).max() <= output / 2 + exact
            assert stalled.tolist() == trajectory.stalled.tolist()
            assert cells.tolist() == list(trajectory.cells)


def test_cells_come_when_the_trial_comes_to_them(tiny):
    tally, _ = tiny
    condition = Condition.from_settings("coverage", dict(settings_of(tally.condition("coverage"))))
    grid = condition.arena.arena().grid
    for row in rows_of(tally, "coverage").iter_rows(named=True):
        trajectory = replay(condition, row)
        cells, steps, end_steps = _replay.first_visits(trajectory.poses, grid)
        assert tuple(cells) == trajectory.cells
        assert len(end_steps) == round(trajectory.coverage_ends * grid.n_cells)
        assert (np.diff(steps) >= 0).all()
        assert (np.diff(end_steps) > 0).all()
        where = np.floor((trajectory.poses[:, :2] - [grid.x, grid.y]) / grid.cell).astype(int)
        for cell, step in zip(cells, steps, strict=True):
            ended = np.flatnonzero((where == [cell % grid.columns, cell // grid.columns]).all(axis=1))
            assert step <= ended.min(initial=len(where))


@pytest.mark.parametrize("numbers", [[0, 1, -1], [63, 64, -64, -65], [100_000, -100_000, 0]])
def test_numbers_survive_packing(numbers):
    packed = _replay._differences(np.array(numbers, np.int64))
    (column,) = columns_of(packed, [len(numbers)])
    assert column.tolist() == numbers


def test_json_cannot_end_its_element():
    evil = "</script><!--<script>&\"'\u2028\ud800"
    text = _replay.as_json({evil: evil})
    assert not set(text) & set("<>&\u2028\ud800")
    assert json.loads(text) == {evil: evil}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("most", "generations", "each"), [(24, 3, 8), (23, 3, 7), (5, 3, 1), (2, 2, 1), (1, 1, 1), (0, 0, 0)]
)
def test_a_large_run_embeds_the_best_of_each_generation(tiny, most, generations, each):
    rows = rows_of(tiny[0], "coverage")
    chosen = _replay._choose(rows, most, "coverage_line")
    assert chosen["generation"].n_unique() == generations
    assert chosen.height == generations * each
    for generation in chosen["generation"].unique():
        of = pl.col("generation") == generation
        best = rows.filter(of)["coverage_line"].sort(descending=True)[:each].to_list()
        assert sorted(chosen.filter(of)["coverage_line"], reverse=True) == best


@pytest.mark.slow
def test_page_says_what_is_left_out(tiny_study, monkeypatch, tmp_path):
    monkeypatch.setattr(_replay, "MOST_STEPS", 4 * 31 * 6)
    html = write_report(tiny_study, tmp_path / "page.html").read_text("utf-8")
    assert "coverage, novelty, turn, ends: 6 of 24 trials, the best ones of each generation" in html
    assert [len(condition["trials"]) for condition in embedded(html)["conditions"]] == [6] * 4
    monkeypatch.setattr(_replay, "MOST_STEPS", 4 * 30)
    html = write_report(tiny_study, tmp_path / "page.html").read_text("utf-8")
    assert "a trial of 30 steps is too long to be embedded" in html
    assert "replay-data" not in html


def test_trials_that_cannot_be_recomputed_are_told_and_the_rest_is_there(tiny_study, monkeypatch, tmp_path):
    def refuse_turn(condition, row):
        if condition.name == "turn":
            raise RecordError("Another version.")
        return replay(condition, row)

    monkeypatch.setattr(_replay, "replay", refuse_turn)
    html = write_report(tiny_study, tmp_path / "page.html").read_text("utf-8")
    assert [condition["name"] for condition in embedded(html)["conditions"]] == [
        "coverage",
        "novelty",
        "ends",
    ]
    assert "turn: its trials cannot be recomputed by this version" in html


def test_a_page_without_trials_has_no_replay_script(out, no_replay):
    html = write_report(write_results(out, [describe("c")], {"c": random_runs(2)})).read_text("utf-8")
    assert "No trial can be played." in html
    assert "replay-data" not in html
    assert len(re.findall("<script>", html)) == 1


def test_pages_of_the_paper_stay_small(tiny_html):
    n_steps = 4 * (24 + 6) * 31
    assert len(re.search(r'id="replay-data">(.*?)</script>', tiny_html, re.S)[1]) < 12 * n_steps + 10_000
    # long pages compress better: MOST_STEPS of the paper's study take 1.0 MB


def test_the_script_is_the_one_that_the_page_allows(tiny_html):
    scripts = re.findall(r"<script>(.*?)</script>", tiny_html, re.S)
    allowed = [base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts]
    policy = " ".join(f"'sha256-{each}'" for each in allowed)
    assert f"script-src {policy}" in tiny_html
    assert "default-src 'none'" in tiny_html
    for script in scripts:
        assert not re.search(r"fetch\(|XMLHttpRequest|WebSocket|import\(|sendBeacon|innerHTML|eval\(", script)
