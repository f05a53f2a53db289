"""The figure and the table of the page "Sensors".

    uv run python docs/make_sensors.py

Draws docs/images/sensors.svg from readings that the kernels of `sim` make with the numbers of our robot files. The
table of those numbers is worked out from the files when the documents are built.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from realitygap.world import RobotModel, load_robot

FIGURE = Path(__file__).parent / "images" / "sensors.svg"
ROBOTS = ("jyro", "scribbler-s2-fluke1", "scribbler-s2-fluke2", "e-puck")
GROUPS = {
    "range": "Range sensors (the first of each robot)",
    "light": "Light sensors",
    "line": "Line sensors",
    "bump": "Bump sensors",
    "encoder": "Encoders",
    "stall": "Stall",
}
KEY = 2026
COLORS = ("#0a4f8f", "#b8480a", "#2f7d4f", "#6d7580")
STYLE = {
    "font.family": ["DejaVu Sans"],
    "font.size": 8.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "svg.fonttype": "path",
    "svg.hashsalt": "realitygap",
}
PER_DISTANCE = 6
WALL = 0.3  # the farthest distance that is drawn [m]


# the table


def shown(value: Any) -> str:
    """A number of a robot file, or that there is none."""
    return "" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)


def parts_of(robot: RobotModel, group: str) -> Any:
    """The first sensor of a kind, or None."""
    part = getattr(robot, group)
    return part if not isinstance(part, tuple) else part[0] if part else None


def table(group: str) -> Iterator[str]:
    """The lines of the table of a kind of sensor: what each number is in each robot that has such a sensor."""
    robots = {name: parts_of(load_robot(name), group) for name in ROBOTS}
    robots = {name: part for name, part in robots.items() if part is not None}
    model = type(next(iter(robots.values()))) if robots else None
    if model is None:
        return
    yield f"## {GROUPS[group]}\n"
    yield "| number | what it is | " + " | ".join(f"`{name}`" for name in robots) + " |"
    yield "|---" * (2 + len(robots)) + "|"
    for name, field in model.model_fields.items():
        if name not in ("x", "y", "direction", "table"):
            values = " | ".join(shown(getattr(part, name)) for part in robots.values())
            yield f"| `{name}` | {field.description} | {values} |"
    yield ""


def page_parts() -> dict[str, str]:
    """What the page includes."""
    lines = [line for group in GROUPS for line in table(group)]
    return {"parts/sensors.md": "\n".join(lines).replace("## ", "### ")}


# the figure


def read(robot: RobotModel, distances: np.ndarray, n: int) -> np.ndarray:
    """(n, d) readings of the first range sensor of a robot in front of a surface at (d,) distances [m].

    All rays of a cone are given the same distance. The numbers are those of readings 0 to n - 1 of trial k at
    distance k.
    """
    from realitygap.evolution import NeatSettings
    from realitygap.kernels.math.lanes import LANES
    from realitygap.kernels.sim import senses
    from realitygap.kernels.sim.lanes import SimRules, make_sim_room
    from realitygap.kernels.sim.shape import make_sim_shape, sim_table

    sensor = robot.range[0]
    shape = make_sim_shape(
        parts=[1], range_response=[sensor.response], range_rays=[sensor.rays], range_pulses=[sensor.pulses]
    )
    numbers = {
        name: value
        for name, value in robot.numbers().items()
        if name.startswith("range.0.") and ".table" not in name
    }
    rules = SimRules(n, robot.step_s, True, 1.0, np.zeros(4))
    readings = np.empty((n, distances.size))
    for first in range(0, distances.size, LANES):
        block = distances[first : first + LANES]
        lanes = make_sim_room(shape, NeatSettings().rules(3, 2), 0, np.float64).lanes
        lanes.p[: shape.n_rows] = sim_table(shape, numbers, np.float64)
        lanes.counters[0] = (first + np.arange(LANES)) * 256
        lanes.distances[:] = np.resize(np.minimum(block, sensor.reach), LANES)
        senses.start_senses(shape, rules, lanes)
        for step in range(n):
            senses.answer(shape, rules, np.uint64(KEY), lanes, np.int64(step))
            readings[step, first : first + LANES] = lanes.readings[0, : block.size]
    return readings


def without_noise(robot: RobotModel) -> RobotModel:
    """The robot with all noise of its range sensors off."""
    noise = ("noise_uniform", "noise_gain", "drop_most", "outlier_most")
    return robot.with_numbers({f"range.{k}.{name}": 0.0 for k in range(len(robot.range)) for name in noise})


def draw_responses(axes: Any) -> None:
    """What each robot's first range sensor answers without noise."""
    distances = np.linspace(0.0, WALL, 301)
    for name, color in zip(ROBOTS, COLORS, strict=True):
        axes.plot(
            distances * 100,
            read(without_noise(load_robot(name)), distances, 1)[0],
            color=color,
            lw=1.2,
            label=name,
        )
    axes.set(title="Without noise", xlabel="distance [cm]", ylabel="reading", ylim=(-0.03, 1.05))
    axes.legend(frameon=False)


def draw_readings(axes: Any, name: str, color: str) -> None:
    """Single readings of a robot, and their mean over many."""
    robot = load_robot(name)
    distances = np.linspace(0.0, WALL, 61)
    many = read(robot, distances, 2_000)
    spread = np.random.default_rng(1).uniform(-0.0015, 0.0015, (PER_DISTANCE, distances.size))
    axes.plot((distances + spread) * 100, many[:PER_DISTANCE], ".", color=color, ms=1.5, alpha=0.5)
    axes.plot(
        distances * 100,
        read(without_noise(robot), distances, 1)[0],
        color="#9aa3ab",
        lw=1.0,
        label="without noise",
    )
    axes.plot(distances * 100, many.mean(axis=0), color="black", lw=1.2, label="mean of 2,000")
    axes.set(title=name, xlabel="distance [cm]", ylabel="reading", ylim=(-0.03, 1.05))
    axes.legend(frameon=False)


def draw_lobes(axes: Any) -> None:
    """How a light sensor looks to lights at other angles."""
    angles = np.linspace(-180, 180, 361)
    for width, color in zip((30, 60, 90, 180), COLORS, strict=True):
        edge = np.cos(np.radians(width))
        lobe = np.maximum((np.cos(np.radians(angles)) - edge) / (1 - edge), 0)
        axes.plot(angles, lobe, color=color, lw=1.2, label=f"width {width}°")
    axes.set(
        title="Lobe of a light sensor",
        xlabel="angle to the light [°]",
        ylabel="part",
        xticks=range(-180, 181, 90),
    )
    axes.legend(frameon=False)


def main() -> None:
    """Draw the figure."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 5.2), layout="constrained")
        (responses, mixture), (pulses, lobes) = figure.subplots(2, 2)
        draw_responses(responses)
        draw_readings(mixture, "scribbler-s2-fluke1", COLORS[1])
        draw_readings(pulses, "scribbler-s2-fluke2", COLORS[2])
        draw_lobes(lobes)
        figure.savefig(FIGURE, metadata={"Date": None})
    print(f"Written: {FIGURE}")


if __name__ == "__main__":
    main()
