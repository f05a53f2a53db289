"""A trial of a twin as a picture or a movie: as MuJoCo draws it, or from above as all trials are drawn."""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from realitygap.errors import RobotError, did_you_mean, whole_number
from realitygap.platforms import SimTwin, open_twin
from realitygap.records import write_whole
from realitygap.robots import Command, Observation
from realitygap.robots.twin import TwinCamera, TwinModel, TwinRobot, outline_of, places_of
from realitygap.world import Arena, Pose

from ._movie import VIDEO_RATE, WIDTH, find_ffmpeg, gif_of, picture_period, save_movie, video_of
from ._moving import MovingTrial, RobotShape

View = Literal["mujoco", "above"]
VIEWS: tuple[View, ...] = ("mujoco", "above")
ENDINGS = {"mujoco": (".png", ".gif", ".mp4"), "above": (".gif", ".mp4")}
SEES = 3.0
"""Length of rays that meet nothing, as a multiple of the distance from which half of the pulses return."""

NEAR = 0.3
"""Reading at which a twin that wanders turns away: some 15 cm before a wall."""


def wander(seen: Observation, step: int) -> Command:
    """Go ahead, and turn away from what is near: to the left for a while, then to the right."""
    if max(seen.readings) > NEAR:
        return Command(-0.2, 0.8 if step // 20 % 2 == 0 else -0.8)
    return Command(0.9, 0.1)


class TwinDrive(NamedTuple):
    """A trial of a twin that is to be shown.

    Attributes:
        model: The twin.
        arena: Arena of the trial.
        n_steps: Commands.
        number: Number of the trial, which selects the noise.
        answer: Function that answers an observation and the step's number with a command.
    """

    model: TwinModel
    arena: Arena
    n_steps: int = 60
    number: int = 0
    answer: Callable[[Observation, int], Command] = wander

    @property
    def title(self) -> str:
        """Title of the trial."""
        return f"{self.model.name}, trial {self.number}"


def save_twin_trial(
    trial: TwinDrive,
    path: str | Path,
    *,
    view: View | None = None,
    speed: float = 4.0,
    width: int = WIDTH,
) -> Path:
    """Let a twin drive, and write a picture of its end, or a movie of its motion.

    Args:
        trial: Trial of the twin.
        path: Ends in .gif, .mp4 or, as MuJoCo draws it, .png.
        view: mujoco, in three dimensions, or above, with rays and visited cells like other trials. Default: mujoco if
            this machine can draw it, otherwise above, with a warning.
        speed: 1 is as fast as it was.
        width: Width of pictures [px].

    Raises:
        MissingExtraError: MuJoCo is not installed.
        RealityGapError: For an .mp4 there is no ffmpeg.
        RobotError: View mujoco was asked for, and this machine cannot draw it, or the twin's engine is sim.
        ValueError: Another ending or view, or a number out of range.
    """
    path = Path(path)
    if view is not None and view not in VIEWS:
        raise ValueError(f"view is {view!r}, expected mujoco or above. {did_you_mean(str(view), VIEWS)}")
    _check_ending(path, view or "mujoco")
    whole_number("n_steps", trial.n_steps, 1, 10_000)
    if not (0.01 <= speed <= 100 and 240 <= width <= 1920):
        raise ValueError(
            f"speed is {speed:g} and width {width}, expected a speed from 0.01 to 100 and a width from 240 to 1920 "
            "pixels."
        )
    if view != "above":
        try:
            with _camera(trial, width) as camera:
                return _save_filmed(trial, path, camera, speed)
        except RobotError as error:
            if view == "mujoco":
                raise
            _check_ending(path, "above", f" {error}")
            warnings.warn(f"{error} It is drawn from above.", stacklevel=2)
    return save_movie(_from_above(trial), path, speed=speed, title=trial.title, width=width)


def _check_ending(path: Path, view: View, why: str = "") -> None:
    endings = ENDINGS[view]
    if path.suffix.lower() not in endings:
        raise ValueError(
            f"{path} ends in {path.suffix or 'nothing'}, expected {', '.join(endings[:-1])} or {endings[-1]}.{why}"
        )


def _from_above(trial: TwinDrive) -> MovingTrial:
    """Return the trial with what it saw, row by row."""
    robot = open_twin(trial.model, trial.arena, number=trial.number)
    seen, poses = [robot.observe()], [robot.pose]
    for step in range(trial.n_steps):
        robot.drive(trial.answer(seen[-1], step))
        seen.append(robot.observe())
        poses.append(robot.pose)
    shape = RobotShape.of(robot.platform) if isinstance(robot, SimTwin) else _shape(trial.model)
    rays = np.array(shape.reach) * (1 - np.array([observation.readings for observation in seen]))
    stalled = np.array([observation.stalled for observation in seen], np.bool_)
    return MovingTrial.of_rows(
        trial.title, "TWIN", trial.arena, shape, robot.step_s, np.array(poses), rays, stalled
    )


def _shape(model: TwinModel) -> RobotShape:
    mounts = tuple(
        (x, y, mount.direction) for (x, y), mount in zip(places_of(model), model.ir.mount, strict=True)
    )
    return RobotShape((outline_of(model),), mounts, (SEES * model.ir.half,) * len(mounts))


def _camera(trial: TwinDrive, width: int) -> TwinCamera:
    if trial.model.engine != "mujoco":
        raise RobotError(f"Twin {trial.model.name!r} has engine 'sim', which MuJoCo does not draw.")
    return TwinCamera(trial.model, trial.arena, width // 2 * 2, width // 3 * 2)


def _save_filmed(trial: TwinDrive, path: Path, camera: TwinCamera, speed: float) -> Path:
    from PIL import Image

    ending = path.suffix.lower()
    encoder = find_ffmpeg() if ending == ".mp4" else ""
    robot = TwinRobot(trial.model, trial.arena, number=trial.number)
    for step in range(trial.n_steps):
        robot.drive(trial.answer(robot.observe(), step))
    if ending == ".png":
        buffer = io.BytesIO()
        Image.fromarray(camera.picture(robot.pose)).save(buffer, "png")
        write_whole(path, buffer.getvalue())
        return path
    points, times = robot.path(), robot.times()
    shown_s = float(times[-1]) / speed
    period_s = 1 / VIDEO_RATE if encoder else picture_period(robot.step_s / speed, shown_s)
    wanted = np.linspace(0.0, times[-1], max(1, round(shown_s / period_s)) + 1)
    rows = np.minimum(np.searchsorted(times, wanted), len(times) - 1)
    pictures = [Image.fromarray(camera.picture(Pose(*points[row].tolist()))) for row in rows]
    comment = f"realitygap: TWIN, {trial.title}"
    write_whole(path, video_of(encoder, pictures) if encoder else gif_of(pictures, shown_s, comment))
    return path
