"""The paper's Figure 3 from a calibration: what each range sensor read at each distance, and what was fitted to it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from realitygap.drawing import Ink
from realitygap.errors import RecordError
from realitygap.records import refuse_results
from realitygap.report._formats import captioned, check_ending, save_drawing
from realitygap.report.charts.house import Drawing, draw_wide
from realitygap.report.charts.lines import draw_band, draw_line, head
from realitygap.report.charts.sheet import IS_WIDE, Sheet, grid
from realitygap.world import INCH, Calibration

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_ABREAST = 3
"""Panels in a row."""

_HEIGHT = 2.2
"""Height of a panel [in]."""

_STRIP = 0.8
"""Width of the strip of readings at a distance [in on the ground]."""


def save_sensor_figure(calibration: Calibration, path: str | Path) -> Path:
    """Draw a calibration's sensors into a .svg, .pdf or .png file. An existing file is replaced.

    Raises:
        RecordError: The calibration has no sensors' readings, or the file cannot be written.
        ValueError: Another ending.
    """
    path = Path(path)
    check_ending(path, (".pdf", ".png", ".svg"))
    refuse_results(path)
    return save_drawing(
        captioned(draw_sensors(calibration), "sensors"), path, title=f"Sensors of {calibration.target}"
    )


def draw_sensors(calibration: Calibration) -> Drawing:
    """Readings against distance for each sensor, with the fitted mean and the band that holds 90 % of readings.

    Raises:
        RecordError: The calibration has no sensors' readings.
    """
    sensors = calibration.evidence.get("sensors")
    if not isinstance(sensors, list) or not sensors:
        raise RecordError(
            f"A calibration of {calibration.kind} has no readings to draw. Expected one of sensors (realitygap "
            "calibrate sensors)."
        )
    n = sum(len(readings) for readings in sensors[0]["readings"])
    caption = (
        f"{calibration.label}: {n} readings of each range sensor of {calibration.target} in "
        f"{len(sensors[0]['readings'])} placements before a wall. Dots: readings, larger where several are the same; "
        "line: mean of the fitted model; band: 90 % of its readings, over what the fit leaves open."
    )
    alt = (
        f"Readings by distance of {len(sensors)} range sensors ({calibration.label}), with the fitted model."
    )

    def draw(width: float) -> Sheet:
        columns = MOST_ABREAST if width >= IS_WIDE else 1
        sheet, panels = grid(width, len(sensors), columns, _HEIGHT, gap=0.2)
        for k, (axes, sensor) in enumerate(zip(panels, sensors, strict=True)):
            _draw_sensor(axes, sensor)
            head(axes, f"{sensor['name']} ({calibration.label})")
            axes.tick_params(labelleft=k % columns == 0)
            axes.set_ylabel("" if k % columns else "reading")
        return sheet

    return draw_wide(draw, "sensors", caption, alt)


def _draw_sensor(axes: Axes, sensor: Mapping[str, Any]) -> None:
    curve = {key: np.asarray(values, float) for key, values in sensor["curve"].items()}
    inches = curve["distances_m"] / INCH
    axes.set_xlim(0, float(inches[-1]))
    axes.set_xticks(np.arange(0, inches[-1], 3))
    axes.set_ylim(-0.04, 1.04)
    draw_band(axes, inches, curve["low"], curve["high"])
    for distance, readings in _by_distance(sensor):
        _draw_strip(axes, distance / INCH, readings)
    draw_line(axes, inches, curve["mean"], color=Ink.OURS, linewidth=1.4)
    axes.set_xlabel("distance to the wall [in]")


def _by_distance(sensor: Mapping[str, Any]) -> list[tuple[float, list[float]]]:
    at: dict[float, list[float]] = {}
    for distance, readings in zip(sensor["distances_m"], sensor["readings"], strict=True):
        at.setdefault(round(float(distance), 3), []).extend(readings)
    return sorted(at.items())


def _draw_strip(axes: Axes, inch: float, readings: Sequence[float]) -> None:
    """Readings at one distance: those that are the same as one dot whose area says how many, others side by side."""
    counts = Counter(round(float(value), 4) for value in readings)
    if len(counts) <= len(readings) / 4:
        values, times = np.array(list(counts)), np.array(list(counts.values()))
        axes.scatter(
            np.full(len(values), inch), values, s=60 * times / len(readings) + 1, color=Ink.RUN, linewidths=0
        )
        return
    aside = (np.arange(len(readings)) * 0.618034) % 1 - 0.5  # even, and the same every time
    axes.scatter(inch + _STRIP * aside, readings, s=1.5, color=Ink.RUN, linewidths=0)
