"""What notebooks show of results, gaps, calibrations, genomes, archives, ledgers, studies, transfers, and trials."""

from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import polars as pl
import pytest

from realitygap.errors import RealityGapError
from realitygap.evolution import NearestArchive, NoveltyArchive, NoveltySettings, PaperArchive, Population
from realitygap.gap import GapResult, GapSide, Why
from realitygap.records import ResultsFolder, Trial, TrialRecord, _published_results
from realitygap.stats import Estimate
from realitygap.study import (
    GapBetween,
    TransferResult,
    load_study,
)
from realitygap.study._transfer.result import Strategist
from realitygap.trials import Trajectory
from realitygap.world import Calibration
from tests.drawing.test_card import HOSTILE, check_safe
from tests.playback.trials import straight
from tests.records.rows import DESCRIPTION, HASH, make_rows
from tests.records.test_ledger import drive, new_ledger

NUMBER = Estimate(0.145, 0.047, 0.244, 10)
MEASURES = [each.name for each in fields(GapResult) if each.type == "Estimate"]
GAP = GapResult("sim", "jyro", ("SIM", "SIM"), (5, 5), **dict.fromkeys(MEASURES, NUMBER))
REFUSED = Estimate.refusal(2, "Needs 5 controllers.")
CALIBRATION = Calibration(
    kind="all", robot="scribbler", target="twin:worn", label="TWIN", observe="track", trials=20, date="2026-01-01",
    method="ABC", fitted=[
        {"name": "drive.gain", "estimate": 1.0, "low": 0.9, "high": 1.1, "prior_low": 0.5, "prior_high": 1.5,
         "identified": True, "unit": "m/s"},
        {"name": "drive.lag", "estimate": 0.2, "low": 0.0, "high": 1.0, "prior_low": 0.0, "prior_high": 1.0,
         "identified": False, "advice": "Drive longer."},
    ],
)  # fmt: skip
TRANSFER = TransferResult(
    "paper", "novelty-50", "twin:worn", "TWIN", 3, 10,
    (Strategist("direct", 20, NUMBER, NUMBER, 0.3), Strategist("none", 0, REFUSED, REFUSED, None)), 0.4, (),
)  # fmt: skip
TRIAL = Trial(
    12, "novelty-50", 0, 2, 3, 1, 5, 1, 0, "C1", "scored", None, "step limit", None, 87, 3, (1, 2), True
)


def between(**changes):
    sides = [
        GapSide(name, "SIM", np.linspace(0.1, top, 20).reshape(10, 2))
        for name, top in (("sim", 0.4), ("j", 0.3))
    ]
    study = SimpleNamespace(result=replace(GAP, **changes), source=sides[0], target=sides[1])
    return GapBetween(study, Why(("drive",), (NUMBER,), (3,), NUMBER, NUMBER, NUMBER))


def genomes():
    population = Population(3, 2, seed=1)
    for _ in range(4):
        population.tell([len(genome.nodes) for genome in population.ask()])
    return population.ask()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = ResultsFolder.create(tmp_path_factory.mktemp("cards") / "r", DESCRIPTION | {"replicates": 6})
    made.publish("coverage", 0, make_rows(n=6), HASH)
    return made


def test_results_show_counts_in_a_line_and_medians_in_a_card(folder):
    assert repr(folder) == f"ResultsFolder({str(folder.path)!r}, 2 conditions, 6/12 runs)"
    page = folder._repr_html_()
    check_safe(page)
    bests = folder.read("coverage").group_by("replicate").max()["coverage_line"]
    assert f"<td>6</td><td>{bests.median():.3f} [{bests.min():.3f}, {bests.max():.3f}]</td>" in page
    assert page.count("<polyline") == 1
    assert "Not complete: 6 of 12 runs" in page


def test_a_card_of_another_task_or_without_counts_has_its_own_score_or_none(tmp_path):
    conditions = [{"name": "coverage", "settings": {"task": {"kind": "coverage", "cells": "ends"}}}]
    made = ResultsFolder.create(tmp_path / "ends", {"conditions": conditions})
    made.publish("coverage", 0, make_rows(n=6), HASH)
    median = made.read().group_by("replicate").max()["coverage_ends"].median()
    assert f"<td>{median:.3f} [" in made._repr_html_()
    assert "<p>6 runs in " in made._repr_html_()


def test_a_card_reads_only_files_that_are_new(folder, monkeypatch):
    before = folder._repr_html_()
    assert f"Digest: {folder.digest()}" in before
    with monkeypatch.context() as patch:
        patch.setattr(type(folder), "digest_with", None)
        assert folder._repr_html_() == before
    monkeypatch.setattr("realitygap.records._cards.MOST_DIGESTED_BYTES", 1)
    page = ResultsFolder.open(folder.path)._repr_html_()
    assert "Digest: " not in page
    assert "\nfolder.digest()\n" in page
    table = slice(before.index("<table>"), before.index("</table>"))
    assert page[table] == before[table]


def test_a_card_has_the_trials_that_a_robot_is_driving(tmp_path):
    """What is committed is in a file beside the ledger until the ledger is closed."""
    conditions = [{"name": "a", "hash": "hash", "settings": {"task": {"kind": "coverage"}}}]
    made = ResultsFolder.create(tmp_path / "r", {"conditions": conditions, "replicates": 1})
    with new_ledger(made.path) as ledger:
        drive(ledger, 1)
        assert "<polyline" not in made._repr_html_()
        drive(ledger, 2)
        ledger.close_generation("a", 0, 0, [0.5, 0.25], [None, None])
        assert f"<td>1</td><td>{2 / 72:.3f}</td>" in made._repr_html_()


def test_a_card_of_many_bytes_leaves_medians_out(folder, monkeypatch):
    monkeypatch.setattr("realitygap.records._cards.MOST_READ_BYTES", 1)
    page = ResultsFolder.open(folder.path)._repr_html_()
    assert "polyline points" not in page
    assert "Medians of these runs: realitygap.summarize(folder)." in page


@pytest.mark.parametrize("damage", ["foreign file", "torn file", "no ledger", "no description", "no folder"])
def test_a_damaged_folder_has_a_line_and_a_card(tmp_path, damage):
    made = ResultsFolder.create(tmp_path / "r", DESCRIPTION | {"replicates": 6})
    made.publish("coverage", 0, make_rows(n=2), HASH)
    (file,) = made.path.glob("trials/*.parquet")
    if damage == "foreign file":
        (file.parent / "<script>.parquet").touch()
    elif damage == "torn file":
        file.write_bytes(file.read_bytes()[:-9])
    elif damage == "no ledger":
        (made.path / "ledger.sqlite").write_bytes(b"SQLite format 3\0" + bytes(200))
    elif damage == "no description":
        made._description.study.clear()
    else:
        file.unlink()
        file.parent.rmdir()
        (made.path / "study.json").unlink()
    line, page = repr(made), made._repr_html_()
    check_safe(page)
    assert line.startswith(f"ResultsFolder({str(made.path)!r}, ")
    assert "\n" not in line
    is_told = damage in ("foreign file", "no ledger", "no description")
    assert line.endswith(", damaged)") == is_told
    assert ("cannot be read" in page) == (is_told or damage == "torn file")


def test_a_card_reads_each_file_once_however_often_it_is_shown(tmp_path, monkeypatch):
    made = ResultsFolder.create(tmp_path / "r", DESCRIPTION | {"replicates": 20})
    for condition in ("coverage", "a.b-c_1"):
        rows = make_rows(condition, n=4, generations=2, individuals=2)
        for first in range(0, 20, 4):
            moved = rows.with_columns((pl.col("replicate") + first).cast(pl.UInt32))
            made.publish(condition, first, moved, HASH)
    digest_rows, read = _published_results.digest_rows, []

    def note(path, digest):
        read.append(path)
        return digest_rows(path, digest)

    monkeypatch.setattr(_published_results, "digest_rows", note)
    opened = ResultsFolder.open(made.path)
    for _ in range(2):
        assert "Complete: 40 of 40 runs" in opened._repr_html_()
        assert sorted(read) == sorted(path for _, path in opened.files())


def test_a_ledger_counts_its_trials_and_a_closed_one_has_a_line(tmp_path):
    ledger = new_ledger(tmp_path, n=3)
    where = repr(str(ledger.path))
    assert repr(ledger) == f"Ledger({where}, 1 condition, 0/3 trials scored)"
    drive(ledger, 1)
    assert repr(ledger) == f"Ledger({where}, 1 condition, 1/3 trials scored, EMULATED)"
    page = ledger._repr_html_()
    check_safe(page)
    assert '<th scope="row">a</th><td>EMULATED</td><td>2</td><td>0</td><td>1</td><td>0</td>' in page
    made = repr(ledger.trial(1))
    assert made == "Trial(1: a, run 0, generation 0, individual 0, scored, 2 cells)"
    ledger.close()
    assert repr(ledger) == f"Ledger({where}, damaged or closed)"
    assert "cannot be read" in ledger._repr_html_()


LINES = {
    "gap": (GAP, "GapResult(sim → jyro: RMS 0.145 [0.047, 0.244], n=10×5)"),
    "between": (between(), "GapBetween(sim → jyro: RMS 0.145 [0.047, 0.244], n=10×5)"),
    "calibration": (CALIBRATION, "Calibration('all', 20 trials, 1/2 identified, ok)"),
    "rejected": (
        CALIBRATION.model_copy(update={"misspecified": True}),
        "Calibration('all', 20 trials, 1/2 identified, rejected)",
    ),
    "study": (load_study("paper"), "Study('paper', 9 conditions × 100 runs, SIM)"),
    "transfer": (TRANSFER, "TransferResult(paper, novelty-50 → twin:worn: 2 strategies, 3 replicates, TWIN)"),
    "trial": (TRIAL, "Trial(12: novelty-50, run 0, generation 2, individual 3 (attempt 2), scored, 2 cells)"),
    "moving": (straight(), "MovingTrial('a', SIM, 10 steps, 8 cells)"),
    "paper archive": (PaperArchive(), "PaperArchive(0 of 8 behaviors)"),
    "archive": (NoveltyArchive(), "NoveltyArchive('paper', 0 behaviors)"),
    "nearest": (NearestArchive(), "NearestArchive(0 behaviors, k=15, threshold=6)"),
}


@pytest.mark.parametrize(("shown", "line"), LINES.values(), ids=LINES)
def test_an_object_shows_itself_in_a_line_and_in_a_card(shown, line):
    assert repr(shown) == line
    check_safe(shown._repr_html_())


def test_a_genome_shows_its_network_and_its_genes():
    genome = genomes()[0]
    n = len(genome.connections)
    assert repr(genome).startswith("Genome(3→2, ")
    page = genome._repr_html_()
    check_safe(page)
    assert f"<summary>{n} genes</summary>" in page
    assert genome._repr_svg_().startswith("<svg")


def test_archives_show_what_they_have():
    cells = [[1, 2], [3]]
    for archive in (PaperArchive(), NoveltyArchive(NoveltySettings(kind="lehman-stanley"))):
        archive.update(cells)
        assert f"{len(archive)} behaviors on a grid of 12 × 6 cells." in archive._repr_html_()
    nearest = NearestArchive(threshold=0.1)
    nearest.update([[0.0, 1.0], [2.0, 5.0]])
    assert '<th scope="row">coordinate 1</th><td>1</td><td>5</td>' in nearest._repr_html_()


def test_a_gap_shows_its_verdict_its_pairs_and_the_needs_of_what_is_refused():
    page = between(mmrv=REFUSED)._repr_html_()
    assert "0.145 [0.047, 0.244] RMS" in page
    assert page.count("Needs 5 controllers.") == 2
    pairs = page[page.index("Controllers on both platforms") :]
    assert pairs.count("<circle") == 10
    assert "part of the model" in page
    assert "cannot reproduce" not in page
    assert "The simulator cannot reproduce what was observed." in between(misspecified=True)._repr_html_()


def test_a_rejected_calibration_has_a_banner():
    assert "Rejected" not in CALIBRATION._repr_html_()
    assert "Rejected: the simulator" in LINES["rejected"][0]._repr_html_()


def test_texts_of_users_are_escaped_in_every_card(tmp_path):
    plain = CALIBRATION.model_dump()
    fitted = [{**each, "name": HOSTILE, "unit": HOSTILE, "advice": HOSTILE} for each in plain["fitted"]]
    texts = dict.fromkeys(("robot", "target", "arena", "software", "method", "date"), HOSTILE)
    title = HOSTILE.removesuffix("\ud800")  # which no file can have
    description = {"title": title, "name": title, "conditions": [{"name": "a", "label": title}]}
    study = load_study("paper")
    about = study.about.model_copy(update={"title": HOSTILE, "note": HOSTILE})
    shown = [
        Calibration(**plain | texts | {"fitted": fitted, "notes": [HOSTILE]}),
        replace(
            GAP,
            source=HOSTILE,
            target=HOSTILE,
            notes=(HOSTILE,),
            score=HOSTILE,
            mmrv=Estimate.refusal(1, HOSTILE),
        ),
        replace(TRANSFER, study=HOSTILE, condition=HOSTILE, target=HOSTILE, label=HOSTILE, score=HOSTILE),
        replace(TRIAL, condition=HOSTILE, code=HOSTILE, problem=HOSTILE, end=HOSTILE),
        replace(straight(), title=HOSTILE),
        study.model_copy(update={"about": about}),
        ResultsFolder.create(tmp_path / "<img src=x>", description),
    ]
    for each in shown:
        texts = "".join(check_safe(each._repr_html_()).texts)
        assert "<script>alert(1)</script>" in texts, type(each)


def test_trials_have_one_line():
    trial = TrialRecord((0, 0, 0), 0.5, np.zeros((3, 2)), np.zeros((3, 3)), np.zeros(3, bool), (1,), number=4)
    assert repr(trial) == "TrialRecord(4, controller, 3 steps of 0.5 s, observed: cells)"
    rows, stalled = np.zeros((4, 3)), np.array([False, True, False, True])
    driven = Trajectory(0.5, rows, rows, rows[1:], rows[1:, :2], stalled, 0.25, 0.1, (1,))
    assert repr(driven) == "Trajectory(3 steps of 0.5 s, 2 blocked, coverage 0.250)"


def test_a_moving_trial_is_played_if_a_widget_can_be_made(monkeypatch):
    bundle = straight()._repr_mimebundle_()
    assert list(bundle) == ["application/vnd.jupyter.widget-view+json"]

    def refuse():
        raise RealityGapError("anywidget is not installed")

    monkeypatch.setattr("realitygap.playback._player.player_class", refuse)
    assert straight()._repr_mimebundle_() == {}
