"""What a camera above the robot sees of a sitting's trials waits for somebody to look at it."""

from __future__ import annotations

import numpy as np
import pytest

from realitygap.errors import StudyError
from realitygap.lab._counts import Counts
from realitygap.lab._files import refuse_camera
from realitygap.lab._messages import Answer
from realitygap.lab._page_operator import PageOperator, under_camera
from realitygap.lab._scoring_files import Draft, read_drawn, read_proposals
from realitygap.records import LEDGER_NAME, Ledger, ResultsFolder
from realitygap.study import CameraObserver, drive_study
from realitygap.world import paper_arena
from tests.study.physical import small_study
from tests.vision.test_track_live import _AboveEmulator

PORT = "emulator://s2?fluke=1&speed=off"


class _Page:
    """A page at which a person agrees to everything, and counts later."""

    def say(self, message):
        pass

    def ask(self, question, until=None):
        return Answer()

    def at_once(self, kind, act):
        pass


def test_cells_that_the_camera_saw_are_entered_with_their_path_after_a_person_has_checked_them(tmp_path):
    study, folder = small_study("coverage", steps="6"), tmp_path / "seen"
    operator = PageOperator(_Page(), folder)
    camera = _AboveEmulator(lambda: operator.observer.beside)
    operator.observer, operator.proposer = CameraObserver(camera, paper_arena()), "camera 2"
    assert drive_study(study, PORT, folder, operator=operator).physical.waiting
    assert all(read_drawn(folder, number) for number in (1, 2, 3))
    drive_study(study, PORT, tmp_path / "true")
    with Ledger.open(tmp_path / "true" / LEDGER_NAME, writable=False) as ledger:
        true = {row["trial"]: row for row in ledger.scores()}
    counts = Counts(folder, ResultsFolder.open(folder).description)
    counts.look()
    for number in (1, 2, 3):
        (seen,) = read_proposals(folder, number)
        assert len(set(seen.cells) ^ set(true[number]["cells"])) <= 1
        draft = counts.draft(number, "anna", "score")
        assert draft == Draft(seen.cells, seen.mark)
        corrected = Draft(sorted({*draft.cells, 71}), draft.proposal)
        counts.score(number, corrected, "anna", "score")
    with Ledger.open(folder / LEDGER_NAME, writable=False) as ledger:
        rows, notes = list(ledger.scores()), list(ledger.notes())
    for row in rows:
        assert row["who"] == "anna"
        assert 71 in row["cells"]
        off = np.array(row["path"])[:, :2] - np.array(true[row["trial"]]["path"])[:, :2]
        assert np.hypot(*off.T).max() < 0.01
    assert [note["text"] for note in notes] == 3 * [
        "Cells and path by camera 2, checked by the person who saved them."
    ]


def test_a_camera_that_is_a_file_or_is_not_there_is_refused_in_words(tmp_path):
    study, operator = small_study(), PageOperator(_Page(), tmp_path)

    def look(spec):
        with under_camera(spec, study, operator, print, asks=True):
            pass

    with pytest.raises(StudyError, match="expected its number such as 0"):
        look("film.mp4")
    with pytest.raises(StudyError, match="unknown option 'tagg'"):
        look("0?tagg=3")


def test_no_lens_outside_the_labs_folder_is_read(tmp_path):
    refuse_camera(tmp_path, "0?lens=phone.toml")
    for spec in ("0?lens=/etc/passwd", "../film.mp4", "film.mp4?lens=../../lens.toml"):
        with pytest.raises(StudyError, match="would be a file outside"):
            refuse_camera(tmp_path, spec)
