"""The path of a robot as a camera recorded it."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from realitygap._wording import fixed
from realitygap.errors import VisionError
from realitygap.vision._tags import RobotTag
from realitygap.world import Grid, cells_along

from ._camera import Camera, square_poses
from ._tracker import Sightings

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

MOST_OFF = 0.08  # of a tag's side, rms of its corners: beyond, it was seen wrongly
FASTEST_M_S = 1.5  # no robot of this size is faster
LEAST_SEEN = 2
SLOPE_S = 0.15  # from so much before and after a gap its speed is taken


@dataclass(frozen=True)
class Track:
    """Poses of a robot over time.

    Attributes:
        times: (t,) ascending [s].
        poses: (t, 3) x [m], y [m], heading [rad, with all full turns from the first on].
        seen: (t,) bool; False if the pose was interpolated.
        size_error: Error of the tag's apparent size, given its size and height, as a share of its side; nan if not
            measured.
    """

    times: Floats
    poses: Floats
    seen: Bools
    size_error: float = float("nan")

    @property
    def longest_gap_s(self) -> float:
        """Longest time between two successive sightings of the robot [s]."""
        return float(np.max(np.diff(self.times[self.seen]), initial=0.0))

    def at(self, times: Floats) -> Floats:
        """Return poses at other times [s], by linear interpolation, (n, 3).

        Raises:
            ValueError: A time before the first picture or after the last.
        """
        times = np.asarray(times, np.float64)
        if len(times) and not (times.min() >= self.times[0] - 1e-9 and times.max() <= self.times[-1] + 1e-9):
            raise ValueError(
                f"times are {fixed(times.min(), 2)} to {fixed(times.max(), 2)} s, expected within "
                f"{self.times[0]:.2f} to {self.times[-1]:.2f} s, which the camera saw."
            )
        return np.column_stack([np.interp(times, self.times, column) for column in self.poses.T])

    def between(self, first_s: float, last_s: float) -> Track:
        """Return the part from one time to another [s], with poses at both ends."""
        inside = (self.times > first_s) & (self.times < last_s)
        ends = self.at(np.array([first_s, last_s]))
        poses = np.concatenate([ends[:1], self.poses[inside], ends[1:]])
        seen = np.concatenate([[True], self.seen[inside], [True]])
        times = np.concatenate([[first_s], self.times[inside], [last_s]])
        return Track(times, poses, seen, self.size_error)

    def held(self, first_s: float, last_s: float) -> Track:
        """Return the same track, at rest from a time before its first picture, and to one after its last [s]."""
        times = np.concatenate([[first_s], self.times, [last_s]])
        poses = np.concatenate([self.poses[:1], self.poses, self.poses[-1:]])
        seen = np.concatenate([[False], self.seen, [False]])
        kept = np.concatenate(
            [[first_s < self.times[0]], np.ones(len(self.times), np.bool_), [last_s > self.times[-1]]]
        )
        return Track(times[kept], poses[kept], seen[kept], self.size_error)

    def cells(self, grid: Grid) -> tuple[int, ...]:
        """Return the cells that its line crosses, in the order of their first visits."""
        return cells_along(self.poses[:, :2], grid)

    def to_csv(self) -> str:
        """Return a table: time_s, x_m, y_m, heading_rad, seen (1, or 0 if interpolated)."""
        rows = [
            f"{time:.4f},{x:.5f},{y:.5f},{heading:.5f},{seen:d}"
            for time, (x, y, heading), seen in zip(self.times, self.poses, self.seen, strict=True)
        ]
        return "\n".join(["time_s,x_m,y_m,heading_rad,seen", *rows]) + "\n"


def track_of(sightings: Sightings, camera: Camera, tag: RobotTag) -> Track:
    """Return the poses of a robot from its tag.

    The tag's corners are put down on the plane of its height, so its parallax is taken out; the heading is that of the
    square in this plane. Sightings of a wrong size or shape, and leaps, are ignored. Gaps are filled with cubic curves
    that have the speed before and after at their ends. There are no poses before the first sighting and after the last.

    Raises:
        VisionError: It was hardly seen.
    """
    flat = camera.on_plane(sightings.robot.reshape(-1, 2), tag.height).reshape(-1, 4, 2)
    seen = np.isfinite(flat).all(axis=(1, 2))
    middles, headings, off = square_poses(np.where(np.isfinite(flat), flat, 0.0), tag)
    sides = np.hypot(*np.moveaxis(flat - np.roll(flat, 1, axis=1), -1, 0)).mean(axis=1)
    size_error = float(np.median(sides[seen]) / tag.size - 1) if seen.any() else float("nan")
    shape_off = np.abs(sides / (tag.size * (1 + size_error)) - 1)
    seen &= (off < MOST_OFF * tag.size + abs(size_error) * tag.size) & (shape_off < 2 * MOST_OFF)
    seen &= ~_leaps(sightings.times, middles, seen)
    if seen.sum() < LEAST_SEEN:
        raise VisionError(
            f"The robot's tag was seen in {seen.sum()} of {len(seen)} pictures, expected at least {LEAST_SEEN}. Is "
            "it lit well enough for the camera to expose shortly, and are its size and height as said (tag-size, "
            "tag-height)?"
        )
    heading = headings - tag.turned
    shift = np.exp(1j * heading) * (tag.ahead + 1j * tag.left)
    poses = np.column_stack([middles[:, 0] - shift.real, middles[:, 1] - shift.imag, heading])
    first, last = np.flatnonzero(seen)[[0, -1]]
    inside = slice(first, last + 1)
    return _filled(sightings.times[inside], poses[inside], seen[inside], size_error)


def _leaps(times: Floats, middles: Floats, seen: Bools) -> Bools:
    """Return single sightings that are farther from both neighbors than any robot drives, (t,)."""
    rows = np.flatnonzero(seen)
    leaps = np.zeros(len(seen), np.bool_)
    if len(rows) < 3:
        return leaps
    way = np.hypot(*np.diff(middles[rows], axis=0).T)
    fast = way > FASTEST_M_S * np.diff(times[rows]) + 0.005
    leaps[rows[1:-1]] = fast[:-1] & fast[1:]
    return leaps


def _filled(times: Floats, poses: Floats, seen: Bools, size_error: float) -> Track:
    rows = np.flatnonzero(seen)
    known = poses[rows].copy()
    known[:, 2] = np.unwrap(known[:, 2])
    filled = np.column_stack([np.interp(times, times[rows], column) for column in known.T])
    for before, after in itertools.pairwise(rows):
        if after - before > 1:
            inside = slice(before + 1, after)
            filled[inside] = _curve(times[rows], known, times[before], times[after], times[inside])
    return Track(times, filled, seen, size_error)


def _curve(times: Floats, poses: Floats, before: float, after: float, at: Floats) -> Floats:
    """Return poses at times between the last sighting before a gap and the first after it, (n, 3)."""
    from scipy.interpolate import CubicHermiteSpline

    left = (times > before - SLOPE_S) & (times <= before)
    right = (times >= after) & (times < after + SLOPE_S)
    ends = np.array([poses[times == before][0], poses[times == after][0]])
    mean = (ends[1] - ends[0]) / (after - before)
    slopes = [_slope(times[part], poses[part], mean) for part in (left, right)]
    curve: Floats = CubicHermiteSpline([before, after], ends, slopes)(at)
    return curve


def _slope(times: Floats, poses: Floats, otherwise: Floats) -> Floats:
    """Return the speed over some sightings, (3,)."""
    if len(times) < 3:
        return otherwise
    slope: Floats = np.polyfit(times - times[0], poses, 1)[0]
    return slope
