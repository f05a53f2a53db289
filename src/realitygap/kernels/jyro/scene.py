"""A whole scene stepped as Jyro 0.3.2 steps it: walls, lights and any number of robots, float64.

Everything here follows Jyro's numbers, not only its rules: lines are rounded to seven decimals in the same
places, and operations come in the same order. The rounding matters. It decides whether a body that
touches a wall is blocked, and it moves a crossing of two nearly parallel lines by far more than 1e-7 m.
`_walls.py` leaves it out and is for trials, where speed counts and noise hides it.

`run_scene` carries out a whole scene in one call. `move_robot`, `read_ranges` and `read_lights` are its parts for
callers that step a scene themselves, with devices that are not compiled.

Headings are Jyro's: 0 faces +y, counter-clockwise. A *line* is a row of six numbers: both ends, slope, and
y at x = 0; a vertical one has the slope inf.

Source: Jyro 0.3.2, `Physics.step`, `Physics.castRay`, `Robot.step`, `Segment`, `RangeSensor`, `LightSensor`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.compile.decorators import kernel, maker

FLOATS = NDArray[np.float64]
INTS = NDArray[np.int64]

SENSOR_RANGE = 0
SENSOR_BUMPER = 1
SENSOR_LIGHT_LINEAR = 2
SENSOR_LIGHT_AMBIENT = 3
SENSOR_LIGHT_DIRECT = 4

INPUT_MAX_INVERTED = 0
INPUT_ALL_INVERTED = 1
INPUT_STALL = 2
INPUT_TIME = 3

# What stops a ray: any sum of these.
WALLS = np.int64(1)
OWN_BODY = np.int64(2)
OTHER_BODIES = np.int64(4)

START_ENERGY = 10000.0
LIGHT_NEAREST = 0.2  # ambient and direct light grow no further within this distance [m]
LIGHT_RAY_SHORT = 0.1  # the ray that looks for a shadow ends this far before the sensor [m]

_HALF_PI = math.pi / 2.0
_TWO_PI = 2.0 * math.pi
_DECIMALS = 1e7
_NO_DECIMALS_ABOVE = float(2**29)  # beyond it float64 is too coarse for a seventh decimal to change anything
_SPLITTER = float(2**27 + 1)  # Dekker's: splits a float64 into two halves of 26 bits


class Standing(NamedTuple):
    """The lines in the way at one moment. Letters: w walls, e edges of all bodies, r robots.

    Attributes:
        walls: (w, 6) lines.
        bodies: (e, 6) lines, where each robot is now.
        rows: (r + 1,) where the edges of each robot begin.
        names: (r,) equal numbers for robots of one name: they neither touch nor see each other.
    """

    walls: FLOATS
    bodies: FLOATS
    rows: INTS
    names: INTS


class Scene(NamedTuple):
    """The constant parts of a running scene. Letters: w walls, l lights, r robots, e edges, s sensors.

    A field that ends in `_rows` says where the part of each robot begins: the edges of robot i are
    `edges[edge_rows[i]:edge_rows[i + 1]]`.

    Attributes:
        walls: (w, 4) x1, y1, x2, y2 [m].
        lights: (l, 3) x, y [m], brightness.
        starts: (r, 3) x, y [m], heading [rad].
        names: (r,) equal numbers for robots of one name: they neither touch nor see each other.
        edges: (e, 4) forward, left of both ends [m].
        edge_rows: (r + 1,).
        mounts: (s, 3) forward, left [m], angle [rad].
        sensors: (s,) one of `SENSOR_...`.
        reaches: (s,) maximum range [m].
        sensor_rows: (r + 1,).
        commands: (t, r, 2) speed [m/s], turn rate [rad/s]; not read for robots with a network.
        layers: (k, 2) outputs and inputs of each layer.
        layer_rows: (r + 1,); a robot without layers follows `commands`.
        weights: (p,) for each layer its weights row by row, then its bias.
        inputs: (i,) one of `INPUT_...`.
        input_rows: (r + 1,).
        scales: (r, 3) factors for the two outputs of the network, and its `sensor_max_range` [m].
    """

    walls: FLOATS
    lights: FLOATS
    starts: FLOATS
    names: INTS
    edges: FLOATS
    edge_rows: INTS
    mounts: FLOATS
    sensors: INTS
    reaches: FLOATS
    sensor_rows: INTS
    commands: FLOATS
    layers: INTS
    layer_rows: INTS
    weights: FLOATS
    inputs: INTS
    input_rows: INTS
    scales: FLOATS


# lines


@kernel
def round7(value):
    """`value` to seven decimals, as Python's `round(value, 7)`: true halves go to even."""
    if not abs(value) < _NO_DECIMALS_ABOVE:
        return value
    scaled = value * _DECIMALS
    whole = np.rint(scaled)
    rest = scaled - whole
    if abs(rest) == 0.5:  # the product itself was rounded: its error tells which side of the half is meant
        shifted = _SPLITTER * value
        high = shifted - (shifted - value)
        error = (high * _DECIMALS - scaled) + (value - high) * _DECIMALS
        if rest > 0.0 and error > 0.0:
            whole += 1.0
        elif rest < 0.0 and error < 0.0:
            whole -= 1.0
    return whole / _DECIMALS


@kernel
def set_line(line, ax, ay, bx, by):
    """Make `line` (6,) the line from A to B [m]."""
    line[0] = round7(ax)
    line[1] = round7(ay)
    line[2] = round7(bx)
    line[3] = round7(by)
    if line[0] == line[2]:
        line[4] = math.inf
        line[5] = 0.0
    else:
        line[4] = round7((line[3] - line[1]) / (line[2] - line[0]))
        line[5] = round7(line[1] - line[0] * line[4])


@kernel
def spans(line, x, y):
    """Whether a point, rounded already, lies in the rectangle around a line's ends; the border counts."""
    inside_x = line[0] <= x <= line[2] or line[2] <= x <= line[0]
    return inside_x and (line[1] <= y <= line[3] or line[3] <= y <= line[1])


@kernel
def crossing(one, other):
    """Whether two lines cross, and where: (crossed, x, y). Parallel ones never do."""
    if one[4] == other[4]:
        return False, 0.0, 0.0
    if one[4] == math.inf:
        x = one[0]
        y = other[5] + x * other[4]
    elif other[4] == math.inf:
        x = other[0]
        y = one[5] + x * one[4]
    else:
        x = (other[5] - one[5]) / (one[4] - other[4])
        y = one[5] + x * one[4]
    near_x = round7(x)
    near_y = round7(y)
    return spans(one, near_x, near_y) and spans(other, near_x, near_y), x, y


@kernel
def length7(ax, ay, bx, by):
    """Distance between two points rounded to seven decimals [m]."""
    dx = round7(ax) - round7(bx)
    dy = round7(ay) - round7(by)
    return math.sqrt(dx * dx + dy * dy)


@kernel
def nearest_hit(lines, ray, px, py, reach):
    """The nearest of `lines` (n, 6) that `ray` (6,) crosses within `reach` [m] of P: (distance or inf, which or -1)."""
    nearest = math.inf
    which = np.int64(-1)
    for i in range(len(lines)):
        crossed, x, y = crossing(lines[i], ray)
        if crossed:
            away = length7(x, y, px, py)
            if away <= reach and away < nearest:
                nearest = away
                which = i
    return nearest, which


@kernel
def any_crossing(some, others):
    """Whether a line of `some` (n, 6) crosses a line of `others` (m, 6)."""
    for i in range(len(some)):
        for j in range(len(others)):
            if crossing(some[i], others[j])[0]:
                return True
    return False


# bodies


@kernel
def place_edges(edges, x, y, heading, lines):
    """Fill `lines` (e, 6) with `edges` (e, 4), forward and left of both ends, of a body at a pose."""
    turned = heading + _HALF_PI
    cos = math.cos(turned)
    sin = math.sin(turned)
    for i in range(len(edges)):
        forward, left, forward_end, left_end = edges[i, 0], edges[i, 1], edges[i, 2], edges[i, 3]
        set_line(
            lines[i],
            x + forward * cos - left * sin,
            y + forward * sin + left * cos,
            x + forward_end * cos - left_end * sin,
            y + forward_end * sin + left_end * cos,
        )


@kernel
def blocked(standing, robot, lines):
    """Whether a robot's body, as `lines` (e, 6), crosses a wall or the body of a robot of another name."""
    if any_crossing(lines, standing.walls):
        return True
    for other in range(len(standing.names)):
        body = standing.bodies[standing.rows[other] : standing.rows[other + 1]]
        if standing.names[other] != standing.names[robot] and any_crossing(lines, body):
            return True
    return False


@maker
def move_robot(standing, robot, edges, pose, speed, sideways, turn_rate, dt):
    """Move one robot by one step, or leave it entirely where it is: (stall, energy spent).

    `pose` (3,) and the robot's rows of `standing.bodies` change in place. The translation uses the old heading;
    `sideways` is positive to the right, as in Jyro [m/s].
    """
    velocity_x = speed * math.sin(-pose[2]) + sideways * math.cos(-pose[2])
    velocity_y = speed * math.cos(-pose[2]) - sideways * math.sin(-pose[2])
    x = pose[0] + velocity_x * dt
    y = pose[1] + velocity_y * dt
    heading = pose[2] + turn_rate * dt
    cost = 1.0 if velocity_x != 0.0 or velocity_y != 0.0 or turn_rate != 0.0 else 0.0
    lines = np.empty((len(edges), 6))
    place_edges(edges, x, y, heading, lines)
    if blocked(standing, robot, lines):
        return 1, cost
    pose[0] = x
    pose[1] = y
    pose[2] = heading % _TWO_PI
    place_edges(edges, x, y, pose[2], standing.bodies[standing.rows[robot] : standing.rows[robot + 1]])
    return 0, cost


# sensors


@maker
def cast_ray(standing, robot, px, py, angle, reach, stops):
    """Return the line that a ray from P meets first: (distance [m] or inf, index or -1); body lines follow walls.

    `angle` is clockwise from +y [rad]. A negative reach points backward and meets nothing. `stops` is a sum of
    WALLS, OWN_BODY and OTHER_BODIES.
    """
    ray = np.empty(6)
    set_line(ray, px, py, math.sin(angle) * reach + px, math.cos(angle) * reach + py)
    nearest = math.inf
    which = np.int64(-1)
    if stops & WALLS:
        nearest, which = nearest_hit(standing.walls, ray, px, py, reach)
    for other in range(len(standing.names)):
        is_own = standing.names[other] == standing.names[robot]
        if stops & (OWN_BODY if is_own else OTHER_BODIES):
            first = standing.rows[other]
            body = standing.bodies[first : standing.rows[other + 1]]
            away, edge = nearest_hit(body, ray, px, py, reach)
            if away < nearest:
                nearest = away
                which = len(standing.walls) + first + edge
    return nearest, which


@maker
def look_along(standing, robot, pose, mount, reach):
    """Return the line that the ray of a mount (3,) meets first within `reach` [m]: (distance or inf, index or -1)."""
    turned = pose[2] + _HALF_PI
    cos = math.cos(turned)
    sin = math.sin(turned)
    px = pose[0] + (mount[0] * cos - mount[1] * sin)
    py = pose[1] + (mount[0] * sin + mount[1] * cos)
    return cast_ray(standing, robot, px, py, -(pose[2] + mount[2]), reach, WALLS | OTHER_BODIES)


@kernel
def light_falloff(sensor, distance, reach):
    """Return the share of a light's brightness that arrives over a distance [m], by the sensor's mode: 0..1."""
    if sensor == SENSOR_LIGHT_LINEAR:
        return 1.0 - min(distance, reach) / reach
    part = min(max(distance, LIGHT_NEAREST), reach) / reach
    nearest = LIGHT_NEAREST / reach
    if sensor == SENSOR_LIGHT_AMBIENT:  # LIGHT_NEAREST / distance
        return (1.0 / part) / (1.0 / nearest)
    return (1.0 / (part * part)) / (1.0 / (nearest * nearest))  # its square


@maker
def light_at(standing, lights, robot, pose, mount, sensor, reach, stops):
    """Light that arrives at a mount (3,) from all `lights` (l, 3); half of it from those in a shadow."""
    turned = pose[2] + _HALF_PI
    cos = math.cos(turned)
    sin = math.sin(turned)
    px = (
        pose[0] + mount[0] * cos - mount[1] * sin
    )  # the point of `look_along`, but Jyro adds in another order here
    py = pose[1] + mount[0] * sin + mount[1] * cos
    total = 0.0
    for i in range(len(lights)):
        x, y, brightness = lights[i, 0], lights[i, 1], lights[i, 2]
        distance = length7(x, y, px, py)
        angle = -math.atan2(round7(py) - round7(y), round7(px) - round7(x)) + _HALF_PI
        intensity = light_falloff(sensor, distance, reach)
        if cast_ray(standing, robot, x, y, angle, distance - LIGHT_RAY_SHORT, stops)[0] < math.inf:
            intensity /= 2.0
        total += intensity * brightness
    return total


@maker
def sense(scene, standing, robot, pose, readings):
    """Fill the robot's part of `readings` (s,): distances [m], 0 or 1 from bumpers, light intensities."""
    for i in range(scene.sensor_rows[robot], scene.sensor_rows[robot + 1]):
        mount, sensor, reach = scene.mounts[i], scene.sensors[i], scene.reaches[i]
        if sensor in (SENSOR_RANGE, SENSOR_BUMPER):
            away = min(look_along(standing, robot, pose, mount, reach)[0], reach)
            if sensor == SENSOR_RANGE:
                readings[i] = away
            else:
                readings[i] = 1.0 if away < reach else 0.0
        else:
            stops = WALLS | OTHER_BODIES
            readings[i] = light_at(standing, scene.lights, robot, pose, mount, sensor, reach, stops)


@maker
def read_ranges(standing, robot, pose, mounts, reach, distances, hits):
    """Fill `distances` (s,) [m], inf where nothing is within reach, and `hits` (s,): which line, or -1."""
    for i in range(len(mounts)):
        distances[i], hits[i] = look_along(standing, robot, pose, mounts[i], reach)


@maker
def read_lights(standing, lights, robot, pose, mounts, sensor, reach, stops, readings):
    """Fill `readings` (s,) with the light that arrives at each of `mounts` (s, 3)."""
    for i in range(len(mounts)):
        readings[i] = light_at(standing, lights, robot, pose, mounts[i], sensor, reach, stops)


# controllers


@maker
def observe(scene, robot, readings, stall, part_of_time):
    """The inputs of the robot's network, in its order, as a new array."""
    own = readings[scene.sensor_rows[robot] : scene.sensor_rows[robot + 1]]
    reach = scene.scales[robot, 2]
    first, last = scene.input_rows[robot], scene.input_rows[robot + 1]
    values = np.empty((last - first) * (len(own) + 1))
    n = 0
    for i in range(first, last):
        meaning = scene.inputs[i]
        if meaning == INPUT_MAX_INVERTED:
            values[n] = np.max((reach - own) / reach)
            n += 1
        elif meaning == INPUT_ALL_INVERTED:
            values[n : n + len(own)] = (reach - own) / reach
            n += len(own)
        else:
            values[n] = stall if meaning == INPUT_STALL else part_of_time
            n += 1
    return values[:n]


@maker
def think(scene, robot, weight_start, values):
    """The robot's command (speed, turn rate) from the inputs of its network: layers of tanh(W x + b)."""
    w = weight_start
    for k in range(scene.layer_rows[robot], scene.layer_rows[robot + 1]):
        n_out, n_in = scene.layers[k, 0], scene.layers[k, 1]
        bias = w + n_out * n_in
        outputs = np.empty(n_out)
        for i in range(n_out):
            total = 0.0
            for j in range(n_in):
                total += scene.weights[w + i * n_in + j] * values[j]
            outputs[i] = math.tanh(total + scene.weights[bias + i])
        values = outputs
        w = bias + n_out
    return values[0] * scene.scales[robot, 0], values[1] * scene.scales[robot, 1]


@maker
def first_weights(scene):
    """(r,) where the weights of each robot's network begin in `scene.weights`."""
    starts = np.zeros(len(scene.names), np.int64)
    total = 0
    for robot in range(len(scene.names)):
        starts[robot] = total
        for k in range(scene.layer_rows[robot], scene.layer_rows[robot + 1]):
            total += scene.layers[k, 0] * (scene.layers[k, 1] + 1)
    return starts


# the scene


@maker
def run_scene(scene: Scene, dt: float, n_steps: int) -> tuple[FLOATS, FLOATS, INTS, FLOATS, FLOATS, FLOATS]:
    """Return the events of a scene, step by step; row 0 is the start.

    All robots decide on the readings after the step before; they move one after the other, later ones
    meeting the earlier ones at their new poses; then all sensors are read.

    Args:
        scene: What stands, who is there and what drives them.
        dt: Length of a step [s].
        n_steps: Steps to take, t.

    Returns:
        times (t + 1,) [s]; poses (t + 1, r, 3) x, y [m], heading [rad]; stalls (t + 1, r) 0 or 1;
        commands (t + 1, r, 2) speed [m/s], turn rate [rad/s]; energies (t + 1, r); readings (t + 1, s).
    """
    n_robots = len(scene.names)
    times = np.zeros(n_steps + 1)
    poses = np.empty((n_steps + 1, n_robots, 3))
    stalls = np.zeros((n_steps + 1, n_robots), np.int64)
    commands = np.zeros((n_steps + 1, n_robots, 2))
    energies = np.full((n_steps + 1, n_robots), START_ENERGY)
    readings = np.empty((n_steps + 1, len(scene.mounts)))
    walls = np.empty((len(scene.walls), 6))
    bodies = np.empty((len(scene.edges), 6))
    standing = Standing(walls, bodies, scene.edge_rows, scene.names)
    weights = first_weights(scene)

    for i in range(len(walls)):
        set_line(walls[i], scene.walls[i, 0], scene.walls[i, 1], scene.walls[i, 2], scene.walls[i, 3])
    poses[0] = scene.starts
    for robot in range(n_robots):
        first, last = scene.edge_rows[robot], scene.edge_rows[robot + 1]
        x, y, heading = scene.starts[robot, 0], scene.starts[robot, 1], scene.starts[robot, 2]
        place_edges(scene.edges[first:last], x, y, heading, bodies[first:last])
    for robot in range(n_robots):
        sense(scene, standing, robot, poses[0, robot], readings[0])

    for step in range(1, n_steps + 1):
        times[step] = times[step - 1] + dt
        poses[step] = poses[step - 1]
        for robot in range(n_robots):
            if scene.layer_rows[robot] == scene.layer_rows[robot + 1]:
                commands[step, robot] = scene.commands[step - 1, robot]
            else:
                stall = stalls[step - 1, robot]
                values = observe(scene, robot, readings[step - 1], stall, (step - 1) / n_steps)
                speed, turn_rate = think(scene, robot, weights[robot], values)
                commands[step, robot, 0] = speed
                commands[step, robot, 1] = turn_rate
        for robot in range(n_robots):
            speed, turn_rate = commands[step, robot, 0], commands[step, robot, 1]
            edges = scene.edges[scene.edge_rows[robot] : scene.edge_rows[robot + 1]]
            pose = poses[step, robot]
            stall, cost = move_robot(standing, robot, edges, pose, speed, 0.0, turn_rate, dt)
            stalls[step, robot] = stall
            energies[step, robot] = energies[step - 1, robot] - cost
        for robot in range(n_robots):
            sense(scene, standing, robot, poses[step, robot], readings[step])
    return times, poses, stalls, commands, energies, readings
