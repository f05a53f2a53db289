"""Trials in motion as a file: GIF, or MP4."""

from __future__ import annotations

import contextlib
import io
import math
import shutil
import subprocess
import tempfile
from collections.abc import Iterable, Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from realitygap._how_to_run import install_command
from realitygap.drawing import PENS, Ink
from realitygap.errors import RealityGapError, did_you_mean
from realitygap.records import write_whole

from ._moving import MovingTrial, all_trials
from ._screen import (
    FAR,
    MIDDLE,
    MOST_TRIALS,
    NEAR,
    TILE,
    TILE_OFTEN,
    TILE_VISITED,
    Screen,
    paler,
    plain_style,
)

if TYPE_CHECKING:
    from PIL.Image import Image

ENDINGS = (".gif", ".mp4")
WIDTH = 720
"""Width of a movie [px]."""

LEAST_S, MOST_S = 0.02, 0.1
"""Minimum and maximum duration of a picture of a GIF. Programs show shorter ones longer, and longer ones look like
slides."""

MOST_PICTURES = 600
"""Maximum number of pictures in a movie. A longer trial shows every second step, or every third, and so on."""

HOLD_S = 1.5
"""Duration of the last picture of a GIF before it restarts. An MP4 just ends."""

VIDEO_RATE = 30
"""Pictures a second of an MP4."""

_COLORS = [
    paler(color, share)
    for share in (1.0, 0.5)
    for color in [color for color, _ in PENS]
    + [Ink.GROUND, Ink.TEXT, Ink.MUTED, Ink.RULE, Ink.OURS, Ink.REACH]
    + [TILE, TILE_VISITED, TILE_OFTEN, FAR, MIDDLE, NEAR]
]
"""Colors that a movie needs unchanged, with the shades at their edges."""

_N_COLORS = 63
"""Maximum number of colors of a GIF, besides the one of unchanged pixels."""

_LEVELS_APART = 8
"""Minimum difference between a color of the pictures and each of `_COLORS`, in red, green, or blue."""


def save_movie(
    trials: MovingTrial | Iterable[MovingTrial],
    path: str | Path,
    *,
    speed: float = 1.0,
    title: str = "",
    width: int = WIDTH,
) -> Path:
    """Write trials in motion, side by side in one arena: rays, trails, and the cells that they visit.

    It lasts as long as the trials did, divided by the speed; a GIF then rests on its last picture for 1.5 s.

    Args:
        trials: One trial, or up to eight in one arena, each with its own pen. Shorter ones wait at their end.
        path: Path that ends in .gif or .mp4. An existing file is replaced once the new one is complete.
        speed: 1 is as fast as it was; 2 is twice as fast.
        title: Title in the head.
        width: Width of the pictures [px], 240 to 1920.

    Returns:
        The path.

    Raises:
        RealityGapError: for an .mp4 there is no ffmpeg.
        RecordError: the file cannot be written, or belongs to a study's results.
        TypeError: what is given is no trial.
        ValueError: none is given, or too many, or in different arenas; another ending; a speed or width out of range.
    """
    listed, path = all_trials(trials), Path(path)
    if len(listed) > MOST_TRIALS:
        raise ValueError(
            f"{len(listed)} trials to show together, expected at most {MOST_TRIALS}, one a pen. Choose some of them."
        )
    if not (math.isfinite(speed) and 0.01 <= speed <= 100):
        raise ValueError(f"speed is {speed:g}, expected a number from 0.01 to 100; 1 is the original speed.")
    if not 240 <= width <= 1920:
        raise ValueError(f"width is {width}, expected 240 to 1920 pixels.")
    if path.suffix.lower() not in ENDINGS:
        ending = path.suffix or "nothing"
        raise ValueError(
            f"{path} ends in {ending}, expected .gif or .mp4. {did_you_mean(path.suffix, list(ENDINGS))}"
        )
    is_video = path.suffix.lower() == ".mp4"
    encoder = find_ffmpeg() if is_video else ""
    step_s = min(trial.step_s for trial in listed)
    duration_s = max(trial.duration_s for trial in listed)
    period_s = 1 / VIDEO_RATE if is_video else picture_period(step_s / speed, duration_s / speed)
    n_pictures = max(1, round(duration_s / speed / period_s))
    times = np.linspace(0.0, duration_s, n_pictures + 1)
    with plain_style():
        screen = Screen(listed, width, title)
        pictures = [screen.picture(float(time)) for time in times]
    if is_video:
        write_whole(path, video_of(encoder, pictures))
    else:
        labels = ", ".join(dict.fromkeys(trial.label for trial in listed))
        named = title or "; ".join(trial.title for trial in listed)
        write_whole(path, gif_of(pictures, duration_s / speed, f"realitygap: {labels}, {named}"))
    return path


def picture_period(step_s: float, duration_s: float) -> float:
    """Return the duration of each picture of a GIF [s]: one step, several steps, or a part of a step.

    Args:
        step_s: Duration of a step in the movie [s].
        duration_s: Duration of the trial in the movie [s].
    """
    least = max(LEAST_S, duration_s / MOST_PICTURES)
    if step_s < least:
        return step_s * math.ceil(least / step_s - 1e-9)
    return max(step_s / math.ceil(step_s / MOST_S - 1e-9), min(least, step_s))


def gif_of(pictures: Sequence[Image], duration_s: float, comment: str) -> bytes:
    """Return pictures as a GIF that lasts so long, rests on its last picture, and then restarts.

    All pictures share one palette, so that nothing flickers.
    """
    from PIL.Image import Dither

    ends = np.rint(np.linspace(0, 100 * duration_s, len(pictures))).astype(int)
    shown = [*np.diff(ends).tolist(), round(100 * HOLD_S)]
    palette = _palette(pictures)
    first, *others = (picture.quantize(palette=palette, dither=Dither.NONE) for picture in pictures)
    buffer = io.BytesIO()
    first.save(
        buffer,
        "GIF",
        save_all=True,
        append_images=others,
        duration=[10 * hundredths for hundredths in shown],
        loop=0,
        disposal=1,
        comment=comment.encode("utf-8"),
        optimize=True,  # otherwise pixels that stay as they are would not be left out
    )
    return buffer.getvalue()


def _palette(pictures: Sequence[Image]) -> Image:
    """Return an image whose palette has the colors of movies, and further ones from a few of the pictures."""
    from PIL import Image

    last = len(pictures) - 1
    samples = [pictures[k] for k in sorted({0, last // 3, 2 * last // 3, last})]
    width, height = samples[0].size
    sheet = Image.new("RGB", (width, height * len(samples)))
    for k, sample in enumerate(samples):
        sheet.paste(sample, (0, k * height))
    own = np.array(list(dict.fromkeys(_COLORS)))
    others = np.reshape(sheet.quantize(_N_COLORS).getpalette() or [], (-1, 3))
    # Pillow compares colors in steps of four levels: one that is almost ours would take its place
    differ = (np.abs(others[:, None] - own).max(axis=2) >= _LEVELS_APART).all(axis=1)
    palette = Image.new("P", (1, 1))
    palette.putpalette(np.concatenate([own, others[differ]]).ravel().tolist()[: 3 * _N_COLORS])
    return palette


def find_ffmpeg() -> str:
    """Return the program that makes video: on the PATH, or the one that a package brings.

    Raises:
        RealityGapError: there is none.
    """
    installed = shutil.which("ffmpeg")
    if installed is not None:
        return installed
    with contextlib.suppress(ImportError, RuntimeError):
        return str(import_module("imageio_ffmpeg").get_ffmpeg_exe())
    raise RealityGapError(
        "An .mp4 needs the program ffmpeg, and there is none on the PATH. Install it, or: "
        f"{install_command('video')}. A .gif needs neither."
    )


def video_of(encoder: str, pictures: Sequence[Image]) -> bytes:
    """Return pictures as H.264 in an MP4 that every browser plays.

    Raises:
        RealityGapError: ffmpeg does not make it.
    """
    width, height = pictures[0].size
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "movie.mp4"
        command = [
            *(encoder, "-loglevel", "error", "-y", "-threads", "1"),
            *("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", str(VIDEO_RATE), "-i", "-"),
            *("-c:v", "libx264", "-preset", "slow", "-crf", "20", "-pix_fmt", "yuv420p", "-tune", "animation"),
            *("-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1", "-movflags", "+faststart"),
            str(path),
        ]  # fmt: skip
        raw = b"".join(picture.tobytes() for picture in pictures)
        done = subprocess.run(command, input=raw, capture_output=True, check=False)
        if done.returncode != 0:
            messages = done.stderr.decode(errors="replace").strip().splitlines()
            raise RealityGapError(
                f"ffmpeg ({encoder}) did not make the movie: {messages[-1] if messages else 'no reason given'}. "
                "Write a .gif."
            )
        return path.read_bytes()
