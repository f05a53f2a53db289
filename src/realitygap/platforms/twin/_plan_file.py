"""A plan of a trial as plain values, to be sent to another process."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from realitygap.evolution import Genome
from realitygap.trials import TrialPlan
from realitygap.world import Pose


def plan_to_dict(plan: TrialPlan) -> dict[str, Any]:
    """Return a plan as JSON knows it."""
    return {
        **vars(plan),
        "start": None if plan.start is None else list(plan.start),
        "genome": None if plan.genome is None else plan.genome.to_json(),
        "commands": np.asarray(plan.commands, np.float64).tolist(),
    }


def plan_from_dict(values: Mapping[str, Any]) -> TrialPlan:
    """Return the plan that `plan_to_dict` described."""
    return TrialPlan(
        **{
            **values,
            "start": None if values["start"] is None else Pose(*values["start"]),
            "genome": None if values["genome"] is None else Genome.from_json(values["genome"]),
            "commands": np.array(values["commands"], np.float64).reshape(-1, 2),
        }
    )
