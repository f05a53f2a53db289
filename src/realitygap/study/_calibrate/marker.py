"""Poses of the robot instead of those of the camera's marker."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from realitygap.calibration import Fit, Marker, fit_marker
from realitygap.platforms import platform_names, split_spec
from realitygap.records import Observe, TrialRecord
from realitygap.world import Arena, RobotModel


def is_under_camera(target: str, label: str, observe: Observe) -> bool:
    """Return whether poses are those of a camera's marker. Poses of our simulators are those of the body.

    Args:
        target: What was observed, as the user named it: a platform, or a log.
        label: Label of its trials.
        observe: Observation level.
    """
    return observe == "track" and (label == "REAL" or split_spec(target)[0] not in platform_names())


def without_marker(
    trials: Sequence[TrialRecord], robot: RobotModel, arena: Arena, seed: int
) -> tuple[list[TrialRecord], Marker | None]:
    """Return trials with the poses of the body, and the marker; None if the trials do not show it."""
    marker = fit_marker(trials, robot, arena, seed=seed)
    return [trial if marker is None else marker.taken_from(trial) for trial in trials], marker


def with_marker(parts: Fit, marker: Marker | None) -> Fit:
    """Return the parts of a fit with the parameters of the marker."""
    if marker is None:
        return parts
    notes = (*parts.notes, marker.note) if marker.note else parts.notes
    return replace(parts, fitted=(*parts.fitted, *marker.fitted), notes=notes)
