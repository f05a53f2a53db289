"""A robot that drives as it is told, and the logs that programs write of it."""

import numpy as np

STEP_S = 0.1
SPEED, TRACK = 0.3, 0.16


def drive(n=400, *, seed=0, noise=0.001, late=0, held=8):
    """Wheel commands (n, 2) as shares of full speed, and poses (n + 1, 3); `late` steps until wheels obey."""
    rng = np.random.default_rng(seed)
    commands = np.repeat(rng.uniform(-0.2, 1, (-(-n // held), 2)), held, 0)[:n]
    wheels = np.concatenate([np.zeros((late, 2)), commands])[:n] * SPEED
    turns = (wheels[:, 1] - wheels[:, 0]) / TRACK * STEP_S
    ways = wheels.mean(1) * STEP_S
    headings = np.concatenate([[0], np.cumsum(turns)])
    middle = headings[:-1] + turns / 2
    poses = np.zeros((n + 1, 3))
    poses[1:, 0], poses[1:, 1] = np.cumsum(ways * np.cos(middle)), np.cumsum(ways * np.sin(middle))
    poses[:, 2] = headings
    poses[:, :2] += rng.normal(0, noise, (n + 1, 2))
    poses[:, 2] += rng.normal(0, 0.003, n + 1)
    return commands, poses


def rows(commands, poses, *, start_s=0.0):
    """A row for each time: t, left and right [m/s], x, y [m], heading [rad]; the last command once more."""
    told = np.concatenate([commands, commands[-1:]]) * SPEED
    return np.column_stack([start_s + STEP_S * np.arange(len(poses)), told, poses])


def write(path, table, header="t,left,right,x,y,heading", separator=",", decimal="."):
    """Write rows as text; the path."""
    lines = [] if not header else [header.replace(",", separator)]
    lines += [separator.join(repr(float(cell)).replace(".", decimal) for cell in row) for row in table]
    path.write_text("\n".join(lines) + "\n", "utf-8")
    return path


def wall_table(robot, distances_mm, n_bearings, *, clockwise=True):
    """Readings (distances, bearings, sensors) of a robot beside a wall, by its own numbers."""
    from realitygap.calibration import predict_range_table

    n = len(robot.range)
    bearings = 2 * np.pi * np.arange(n_bearings) / n_bearings * (-1 if clockwise else 1)
    distance, bearing, sensor = np.meshgrid(
        np.array(distances_mm) / 1000, bearings, np.arange(n), indexing="ij"
    )
    readings = predict_range_table(sensor.ravel(), distance.ravel(), bearing.ravel(), robot)
    return readings.reshape(distance.shape)


def write_sample(path, cells, first_mm, step_mm, number="{:.6f}"):
    """Write readings in the `.sample` format; the path."""
    n_distances, n_bearings, n_sensors = cells.shape
    lines = [f"{n_sensors} {n_bearings} {n_distances} {first_mm:g} {step_mm:g} "]
    for k, block in enumerate(cells):
        lines.append(f"TURN {k}")
        lines += [" ".join(number.format(cell) for cell in row) + " " for row in block]
    path.write_text("\r\n".join([*lines, "END"]) + "\r\n", "ascii")
    return path
