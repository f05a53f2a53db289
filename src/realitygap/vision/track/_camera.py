"""The pose of a camera, from tags on the floor, and its lens if that was not calibrated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import VisionError, from_extra
from realitygap.vision._tags import RobotTag

from ._lens import Lens

Floats = NDArray[np.float64]

LEAST_TAGS = 3
MOST_ROBOT_VIEWS = 60  # of its tag that help to fit a lens
FOCAL_GUESSES = (0.6, 0.9, 1.4)  # of the width: wide, a phone, narrow
# What is known of lenses before: weak, so that it counts only where tags tell nothing.
FOCAL_SPREAD = 0.5  # of its logarithm, around the second guess
DISTORTION_SPREAD = (0.3, 0.1)  # k1, k2
PIXEL_SPREAD = 0.3  # of a tag's corner [px]
ROUND_SPREAD = 0.5  # by how much corners may be found too far inside [px]
MOST_OFF = 4.0  # [px] rms of corner tags: beyond, they are not where they are said to be


@dataclass(frozen=True)
class Camera:
    """A camera that looks at an arena.

    Attributes:
        lens: Lens of the camera.
        rotation: (3, 3) rotation from the arena's axes to the camera's: right, down and into the picture.
        translation: (3,) arena's origin in the camera's frame [m].
        rms: RMS error of the corners of the corner tags [px].
    """

    lens: Lens
    rotation: Floats
    translation: Floats
    rms: float = 0.0

    @property
    def place(self) -> Floats:
        """Position: x, y and height above the floor, (3,) [m]."""
        where: Floats = -self.rotation.T @ self.translation
        return where

    def to_pixels(self, points: Floats) -> Floats:
        """Return pixels of points (n, 3) of the arena [m], (n, 2)."""
        seen = points @ self.rotation.T + self.translation
        return self.lens.to_pixels(seen[:, :2] / seen[:, 2:])

    def on_plane(self, pixels: Floats, z: float) -> Floats:
        """Return the points at height z [m] that pixels (n, 2) show, (n, 2)."""
        directions = self.lens.to_directions(pixels)
        rays = np.column_stack([directions, np.ones(len(directions))]) @ self.rotation
        x, y, height = self.place
        points: Floats = np.array([x, y]) + rays[:, :2] * ((z - height) / rays[:, 2])[:, None]
        return points


def fit_camera(
    size: tuple[int, int],
    seen: Mapping[int, Floats],
    layout: Mapping[int, Floats],
    *,
    lens: Lens | None = None,
    robot: Floats | None = None,
    tag: RobotTag | None = None,
) -> Camera:
    """Fit the pose of a camera to the tags at the arena's corners.

    Without a lens its focal length and distortion are fitted, too, by the corner tags and by the tag on the robot,
    which looks the larger the nearer the camera is.

    Args:
        size: Width and height of pictures [px].
        seen: (4, 2) pixels of each corner tag's corners, by number.
        layout: (4, 3) corners of each tag [m], by number.
        lens: Lens of the camera, if known.
        robot: (m, 4, 2) pixels of the corners of the robot's tag in some pictures.
        tag: The robot's tag.

    Raises:
        VisionError: Too few tags, or they are not where the layout has them.

    Source: Zhang (2000) for one plane and unknown lens; the fit is least squares over all corners at once.
    """
    both = sorted(set(seen) & set(layout))
    if len(both) < LEAST_TAGS:
        numbers = ", ".join(map(str, both)) or "none"
        raise VisionError(
            f"Of the tags at the arena's corners ({', '.join(map(str, sorted(layout)))}) these were found: {numbers}. "
            f"Expected at least {LEAST_TAGS}. Move the camera until it sees all corners, sharp and without glare."
        )
    points = np.concatenate([layout[number] for number in both])
    pixels = np.concatenate([seen[number] for number in both])
    try:
        if lens is not None:
            made = _placed(lens.scaled_to(*size), points, pixels)
        else:
            views = np.empty((0, 4, 2)) if robot is None or tag is None else _spread(robot)
            made = _with_lens(size, points, pixels, views, tag or RobotTag())
    except (from_extra("cv2", "vision").error, np.linalg.LinAlgError) as error:
        raise VisionError(
            f"Where the camera stands cannot be worked out from the corner tags ({str(error).strip()}). Film it anew, "
            "with all four in sight."
        ) from error
    if not made.rms <= MOST_OFF:
        raise VisionError(
            f"The tags at the arena's corners are {made.rms:.1f} pixels from where they should be. Are numbers 0 to 3 "
            "at the lower left, lower right, upper right and upper left, upright, and their size and distance from the "
            "walls as said (corner-size, corner-inset)?"
        )
    return made


def _placed(lens: Lens, points: Floats, pixels: Floats) -> Camera:
    """Return a camera with this lens where the tags show it."""
    cv2 = from_extra("cv2", "vision")
    distortion = np.array(lens.distortion)
    _, turn, shift = cv2.solvePnP(points, pixels, lens.matrix, distortion, flags=cv2.SOLVEPNP_ITERATIVE)
    turn, shift = cv2.solvePnPRefineLM(points, pixels, lens.matrix, distortion, turn, shift)
    made = Camera(lens, cv2.Rodrigues(turn)[0], np.ravel(shift))
    return Camera(lens, made.rotation, made.translation, _rms(made, points, pixels))


def _rms(camera: Camera, points: Floats, pixels: Floats) -> float:
    return float(np.sqrt(np.mean(np.sum((camera.to_pixels(points) - pixels) ** 2, axis=1))))


def _spread(robot: Floats) -> Floats:
    """Return views of the robot's tag from all over the picture, no more than are of use."""
    if len(robot) <= MOST_ROBOT_VIEWS:
        return robot
    middles = robot.mean(axis=1)
    chosen = [int(np.argmin(middles.sum(axis=1)))]
    away = np.full(len(robot), np.inf)
    while len(chosen) < MOST_ROBOT_VIEWS:  # the farthest from all that were chosen
        away = np.minimum(away, np.hypot(*(middles - middles[chosen[-1]]).T))
        chosen.append(int(np.argmax(away)))
    return robot[chosen]


def _with_lens(size: tuple[int, int], points: Floats, pixels: Floats, views: Floats, tag: RobotTag) -> Camera:
    """Return a camera with the lens that fits best."""
    fits = [
        _fit_from(_lens(size, guess * size[0], 0.0, 0.0), points, pixels, views, tag)
        for guess in FOCAL_GUESSES
    ]
    return min(fits, key=lambda fit: fit[0])[1]


def _lens(size: tuple[int, int], focal: float, k1: float, k2: float, rms: float = float("nan")) -> Lens:
    center = ((size[0] - 1) / 2, (size[1] - 1) / 2)
    return Lens(*size, (float(focal), float(focal)), center, (float(k1), float(k2), 0.0, 0.0, 0.0), rms)


def _fit_from(
    guess: Lens, points: Floats, pixels: Floats, views: Floats, tag: RobotTag
) -> tuple[float, Camera]:
    """Return the error of the best fit that starts from a guess, and that fit.

    The place of the robot's tag in each view follows from the camera. So only the camera's own numbers are fitted, and
    the distance by which the corners of all tags are found too far inside (a blurred corner is round).
    """
    from scipy.optimize import least_squares

    cv2 = from_extra("cv2", "vision")
    size, first = (guess.width, guess.height), _placed(guess, points, pixels)
    turn = np.ravel(cv2.Rodrigues(first.rotation)[0])
    begin = np.concatenate([np.zeros(4), turn, first.translation])
    usual = np.log(FOCAL_GUESSES[1] * size[0])
    corners = np.concatenate([pixels.reshape(-1, 4, 2), views])
    inwards = corners.mean(axis=1, keepdims=True) - corners
    inwards /= np.linalg.norm(inwards, axis=2, keepdims=True)

    def camera_of(values: Floats) -> Camera:
        lens = _lens(size, guess.focal[0] * np.exp(values[0]), values[1], values[2])
        return Camera(lens, cv2.Rodrigues(values[4:7])[0], values[7:10])

    def off(values: Floats) -> Floats:
        camera = camera_of(values)
        wanted = corners - values[3] * inwards
        flat = camera.on_plane(wanted[len(points) // 4 :].reshape(-1, 2), tag.height).reshape(-1, 4, 2)
        middles, headings, _ = square_poses(flat, tag)
        where = placed_squares(np.column_stack([middles, headings]), tag)
        seen = camera.to_pixels(np.concatenate([points, where])).reshape(-1, 4, 2)
        known = [
            (np.log(camera.lens.focal[0]) - usual) / FOCAL_SPREAD,
            *(values[1:4] / (*DISTORTION_SPREAD, ROUND_SPREAD)),
        ]
        return np.concatenate([((seen - wanted) / PIXEL_SPREAD).ravel(), known])

    done = least_squares(off, begin, x_scale="jac", loss="soft_l1", max_nfev=100)
    made = camera_of(done.x)
    rms = _rms(
        made, points, (pixels.reshape(-1, 4, 2) - done.x[3] * inwards[: len(points) // 4]).reshape(-1, 2)
    )
    lens = _lens(size, made.lens.focal[0], *made.lens.distortion[:2], rms)
    return float(done.cost), Camera(lens, made.rotation, made.translation, rms)


def square_poses(corners: Floats, tag: RobotTag) -> tuple[Floats, Floats, Floats]:
    """Return the middle and direction of squares from their corners in the plane, and their distance from a square.

    Args:
        corners: (n, 4, 2) [m].
        tag: Tag of the square.

    Returns:
        (n, 2) middles [m], (n,) headings [rad] and (n,) rms distance of the corners from such a square there [m].

    Source: Procrustes in the plane: the heading is that of the sum of corner times conjugate model corner.
    """
    middles = corners.mean(axis=1)
    model = tag.corners() @ np.array([1.0, 1j])
    around = (corners - middles[:, None]) @ np.array([1.0, 1j])
    headings = np.angle((around * model.conj()).sum(axis=1))
    off = around - model * np.exp(1j * headings)[:, None]
    return middles, headings, np.sqrt(np.mean(np.abs(off) ** 2, axis=1))


def placed_squares(places: Floats, tag: RobotTag) -> Floats:
    """Return corners of the tag with its middle at places x [m], y [m], heading [rad], (n, 3), as (4 n, 3)."""
    model = tag.corners() @ np.array([1.0, 1j])
    around = model[None] * np.exp(1j * places[:, 2])[:, None]
    flat = np.stack([around.real + places[:, :1], around.imag + places[:, 1:2]], axis=-1).reshape(-1, 2)
    return np.column_stack([flat, np.full(len(flat), tag.height)])
