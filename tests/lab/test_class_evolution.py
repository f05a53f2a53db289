"""The controller that a class tries to beat."""

from __future__ import annotations

import numpy as np
import pytest

from realitygap.lab._class_evolution import _TEXT, N_TRIALS, SECONDS, evolved_controller
from realitygap.study import parse_study, run_study


@pytest.mark.slow
def test_evolved_controller_is_tried_with_fresh_noise_and_on_an_emulated_robot(tmp_path):
    text = _TEXT.format(steps=120).replace("replicates = 10", "replicates = 2")
    text = text.replace("generations = 40", "generations = 3")
    run_study(parse_study(text, "study.toml"), tmp_path / "study")
    evolved = evolved_controller(tmp_path / "study")
    assert evolved.cells.shape == (N_TRIALS,)
    assert evolved.trial.label == "SIM"
    assert evolved.trial.duration_s == SECONDS
    assert len(evolved.trial.cells) == np.sort(evolved.cells)[N_TRIALS // 2]
    assert 1 <= evolved.emulated <= evolved.trial.arena.grid.n_cells
