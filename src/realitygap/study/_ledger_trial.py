"""A trial of a ledger in the form of observed trials, so that tasks can score it."""

from __future__ import annotations

import numpy as np

from realitygap.records import Ledger, ObservedTrial
from realitygap.trials import PATH_PARTS


def observed_of_ledger(ledger: Ledger, number: int) -> ObservedTrial:
    """Return a scored trial as far as it was observed.

    Args:
        ledger: The ledger.
        number: Of a trial that was driven to its last step.

    Returns:
        The trial, with poses if somebody saw the driven path, and with a last look if the robot had one. The time of a
        step is the median of those in the trial [s].

    Raises:
        LedgerError: There is no such trial, or the ledger is damaged.
    """
    trial, steps, last = ledger.trial(number), ledger.steps(number), ledger.last_look(number)
    score = ledger.counted_score(number)
    path = None if score is None else score.path
    poses = np.empty((0, 3)) if path is None else np.array(path, np.float64).reshape(-1, 3)[::PATH_PARTS]
    times = [step.time for step in steps]
    return ObservedTrial(
        start=(0.0, 0.0, 0.0) if not len(poses) else tuple(poses[0].tolist()),
        step_s=float(np.median(np.diff(times))) if len(times) > 1 else 0.0,
        commands=np.array([(step.move, step.turn) for step in steps], np.float64).reshape(-1, 2),
        readings=np.array([step.readings for step in steps], np.float64),
        stalled=np.array([step.stalled for step in steps], np.bool_),
        cells=() if trial.cells is None else trial.cells,
        poses=poses,
        number=number,
        end=str(trial.end),
        last_readings=np.array([] if last is None else last.readings, np.float64),
        last_stalled=last is not None and last.stalled,
    )
