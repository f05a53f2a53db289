"""What the sensors of `sim` answer, one robot and one reading at a time, by Python's own mathematics."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

Point = tuple[float, float]


def limited(reading: float) -> float:
    return min(max(reading, 0.0), 1.0)


def logistic(distance: float, most: float, at: float, width: float) -> float:
    """A probability that rises with distance (falls, where the width is below 0); a width of 0: a step."""
    if width == 0:
        return most * (0.5 if distance == at else float(distance > at))
    return most / (1 + math.exp(min((at - distance) / width, 700.0)))


def linear(distances: Sequence[float], reach: float) -> float:
    return (reach - min(distances)) / reach


def returned(distances: Sequence[float], reach: float, decay: float, factors: Sequence[float]) -> float:
    """Rays from one edge of the cone to the other; the lobe has half its power at the edges."""
    n = len(distances)
    angles = [0.0] if n == 1 else [2 * k / (n - 1) - 1 for k in range(n)]
    lobe = [1 - angle**2 / 2 for angle in angles]
    back = [
        weight * factor * math.exp(-d / decay)
        for weight, d, factor in zip(lobe, distances, factors, strict=True)
        if d < reach and (decay > 0 or d == 0)
    ]
    return sum(back) / sum(lobe)


def infrared(distances: Sequence[float], reach: float, amplitude: float, decay: float) -> float:
    return amplitude * returned(distances, reach, decay, [1.0] * len(distances))


def compressed(reading: float, compression: float) -> float:
    return math.log(1 + compression * max(reading, 0.0)) / compression if compression else reading


def lorentz(distance: float, reach: float, amplitude: float, half_width: float, peak: float) -> float:
    """Enki's law of one ray: m = amplitude, c = half_width^2, x0 = peak."""
    if distance >= reach:
        return 0.0
    if distance < peak:
        return amplitude
    return amplitude * (half_width**2 - peak**2) / (distance**2 - 2 * peak * distance + half_width**2)


def enki(distances: Sequence[float], cone: float, *numbers: float) -> float:
    """One ray, or three from right to left as Enki adds them up; `numbers` are those of `lorentz` in order."""
    if len(distances) == 1:
        return lorentz(distances[0], *numbers)
    right, middle, left = distances
    straight = lorentz(middle, *numbers) - 2 * lorentz(middle / math.cos(cone), *numbers)
    return lorentz(right, *numbers) + lorentz(left, *numbers) + straight


def of_lost_rays(distances: Sequence[float], reach: float, *numbers: float) -> float:
    """What rays that have lost a wall add in Enki 1.6.99, if each lost it at the reach."""
    lost = [d for d in distances if d >= reach]
    return len(lost) * lorentz(reach, math.inf, *numbers) if len(lost) < len(distances) else 0.0


def at_a_slant(cosines: Sequence[float], incidence: float) -> list[float]:
    return [c / (c + incidence * (1 - c)) for c in cosines]


def dim_distance(
    distances: Sequence[float], cosines: Sequence[float], reach: float, decay: float, incidence: float
) -> float:
    """Where what is nearest would send back as little if it were faced."""
    faced = returned(distances, reach, decay, [1.0] * len(distances))
    slanted = returned(distances, reach, decay, at_a_slant(cosines, incidence))
    return min(distances) + (decay * math.log(faced / slanted) if slanted > 0 else 0.0)


def table(distance: float, entries: Sequence[Point]) -> float:
    """Straight between entries, level beyond them."""
    if distance <= entries[0][0]:
        return entries[0][1]
    for (d0, r0), (d1, r1) in itertools.pairwise(entries):
        if distance <= d1:
            return r0 + (r1 - r0) * (distance - d0) / (d1 - d0)
    return entries[-1][1]


def mixed(reading: float, choice: float, value: float, nothing: float, anything: float) -> float:
    """Nothing, anything, or the reading, by two uniform numbers and two probabilities."""
    if choice < nothing:
        return 0.0
    if 1 - choice < anything:
        return value
    return limited(reading)


def mixture_moments(reading: float, nothing: float, anything: float) -> tuple[float, float]:
    """Mean and variance of `mixed` of a reading in 0..1."""
    anything = min(anything, 1 - nothing)
    rest = 1 - nothing - anything
    mean = anything / 2 + rest * reading
    return mean, anything / 3 + rest * reading**2 - mean**2


def pulses(share: float, n: int, missing: float, shared: bool, fates: Sequence[float]) -> float:
    """The share of n pulses that is seen, by a uniform number for each."""
    expected = math.floor(limited(share) * n + 0.5)
    fate = [fates[0]] * n if shared else fates
    return sum(fate[k] >= missing for k in range(expected)) / n


def pulse_moments(share: float, n: int, missing: float, burst: float) -> tuple[float, float]:
    """Mean and variance of `pulses`, where any two have the correlation `burst`."""
    expected = math.floor(limited(share) * n + 0.5)
    one = missing * (1 - missing)
    return expected * (1 - missing) / n, expected * one * (1 + (expected - 1) * burst) / n**2


@dataclass(frozen=True)
class Lamp:
    x: float
    y: float
    strength: float
    lit: float = 1.0


def light(
    pose: tuple[float, float, float], mount: Point, direction: float, width: float, lamps: Sequence[Lamp]
) -> float:
    """What a directional sensor receives of lamps, before its gain and its noise."""
    x = pose[0] + mount[0] * math.cos(pose[2]) - mount[1] * math.sin(pose[2])
    y = pose[1] + mount[0] * math.sin(pose[2]) + mount[1] * math.cos(pose[2])
    total = 0.0
    for lamp in lamps:
        angle = math.atan2(lamp.y - y, lamp.x - x) - pose[2] - direction
        lobe = (math.cos(angle) - math.cos(width)) / (1 - math.cos(width))
        distance = max(math.hypot(lamp.x - x, lamp.y - y), 1e-3)
        total += lamp.strength * max(lobe, 0.0) * lamp.lit / distance**2
    return total


def image_at(image: Sequence[Sequence[float]], corner: Point, per_meter: float, x: float, y: float) -> float:
    """Brightness between the four nearest pixel centers; row 0 is lowest; level beyond the image."""
    height, width = len(image), len(image[0])
    u = min(max((x - corner[0]) * per_meter - 0.5, 0.0), width - 1.0)
    v = min(max((y - corner[1]) * per_meter - 0.5, 0.0), height - 1.0)
    total = 0.0
    for row in range(height):
        for column in range(width):
            weight = max(1 - abs(u - column), 0.0) * max(1 - abs(v - row), 0.0)
            total += weight * image[row][column]
    return total


def on_tape(tape: Sequence[float], x: float, y: float) -> bool:
    """Within half its width of the segment in its middle."""
    x1, y1, x2, y2, width = tape[:5]
    square = (x2 - x1) ** 2 + (y2 - y1) ** 2
    part = 0.0 if square == 0 else min(max(((x - x1) * (x2 - x1) + (y - y1) * (y2 - y1)) / square, 0.0), 1.0)
    return math.hypot(x - x1 - part * (x2 - x1), y - y1 - part * (y2 - y1)) <= width / 2


@dataclass
class Idler:
    """Stall by an idler wheel that is compared with the drive wheels."""

    ahead: float
    share: float
    window: float
    step_s: float
    pose: tuple[float, float, float]
    driven: float = 0.0
    rolled: float = 0.0

    def step(self, pose: tuple[float, float, float], left: float, right: float) -> bool:
        was = [
            self.pose[0] + self.ahead * math.cos(self.pose[2]),
            self.pose[1] + self.ahead * math.sin(self.pose[2]),
        ]
        now = [pose[0] + self.ahead * math.cos(pose[2]), pose[1] + self.ahead * math.sin(pose[2])]
        keep = math.exp(-self.step_s / self.window) if self.window > 0 else 0.0
        self.pose = pose
        self.driven = keep * self.driven + (1 - keep) * abs(left + right) / 2
        self.rolled = keep * self.rolled + (1 - keep) * math.dist(was, now)
        return (left != 0 or right != 0) and self.rolled + 2.5e-4 < self.share * self.driven


@dataclass
class Encoders:
    """Two encoders and the pose reckoned from them; `normal` gives the next normally distributed number."""

    gains: tuple[float, float]
    noise: float
    drift: float
    track: float
    axle: float
    normal: Callable[[], float]
    counted: list[float] = field(default_factory=lambda: [0.0, 0.0])
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def step(self, left: float, right: float) -> None:
        said = [
            way * gain + self.noise * math.sqrt(abs(way)) * self.normal()
            for way, gain in zip((left, right), self.gains, strict=True)
        ]
        self.counted = [total + one for total, one in zip(self.counted, said, strict=True)]
        way = (said[0] + said[1]) / 2
        x, y, heading = self.pose
        turn = (said[1] - said[0]) / self.track + self.drift * abs(way)
        # by way of the middle of the axle
        x += self.axle * math.cos(heading) + way * math.cos(heading + turn / 2)
        y += self.axle * math.sin(heading) + way * math.sin(heading + turn / 2)
        heading += turn
        self.pose = (x - self.axle * math.cos(heading), y - self.axle * math.sin(heading), heading)


def to_segment(p: Point, a: Point, b: Point) -> float:
    """Distance from a point to a segment."""
    square = (b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2
    part = 0.0 if square == 0 else ((p[0] - a[0]) * (b[0] - a[0]) + (p[1] - a[1]) * (b[1] - a[1])) / square
    part = min(max(part, 0.0), 1.0)
    return math.hypot(p[0] - a[0] - part * (b[0] - a[0]), p[1] - a[1] - part * (b[1] - a[1]))


def crosses(a: Point, b: Point, c: Point, d: Point) -> bool:
    """Whether AB and CD meet."""

    def side(p: Point, q: Point, r: Point) -> float:
        return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])

    return side(a, b, c) * side(a, b, d) <= 0 and side(c, d, a) * side(c, d, b) <= 0


def edges(corners: Sequence[Point]) -> list[tuple[Point, Point]]:
    return list(zip(corners, [*corners[1:], corners[0]], strict=True))


def is_shaded(a: Point, b: Point, corners: Sequence[Point], radius: float) -> bool:
    """Whether the way from a to b comes within the radius of an outline (both ends outside of it)."""
    near = [
        min(to_segment(a, *edge), to_segment(b, *edge), to_segment(edge[0], a, b), to_segment(edge[1], a, b))
        for edge in edges(corners)
    ]
    return min(near) < radius or (len(corners) > 1 and any(crosses(a, b, *edge) for edge in edges(corners)))


def gap(p: Point, corners: Sequence[Point], radius: float) -> float:
    """How far a point is from an outline of counter-clockwise corners grown by a radius, below zero inside."""
    distance = min(to_segment(p, *edge) for edge in edges(corners))
    inside = len(corners) > 2 and all(
        (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) >= 0 for a, b in edges(corners)
    )
    return (-distance if inside else distance) - radius
