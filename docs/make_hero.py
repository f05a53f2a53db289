"""The picture at the top of the README and the landing page: one controller in simulation and on a twin.

    uv run python docs/make_hero.py [FOLDER]

Runs `realitygap close` on the first twin of the family worn in FOLDER, or resumes it there. Then it films the first
trial of the best controller in simulation: before the calibration, and after it. Default: a temporary folder, which
takes minutes.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from PIL import Image, ImageSequence

from realitygap import close_gap
from realitygap.playback import save_movie
from realitygap.robots.twin import sample_twin
from realitygap.study import GapStudy

HERO = Path(__file__).parent / "images" / "close-the-gap.gif"
WIDTH = 480
SPEED = 8.0
COLORS = 40
SKIP = 2
"""Of so many frames, the picture has one."""


def film(study: GapStudy, title: str, path: Path) -> list[Image.Image]:
    """Frames of the first trial of the shown controller on both platforms."""
    shown = study.shown
    if shown is None:
        raise SystemExit("The poses on the twin are unknown.")
    trials = [
        replace(side[0], title=f"{name} ({side[0].label})")
        for side, name in ((shown.source, "simulation"), (shown.target, "twin"))
    ]
    save_movie(trials, path, speed=SPEED, title=title, width=WIDTH)
    with Image.open(path) as movie:
        return [frame.convert("RGB") for frame in ImageSequence.Iterator(movie)]


def main(folder: Path) -> None:
    """Write the picture."""
    twin = folder / "worn-1.toml"
    if not twin.exists():
        twin.write_text(sample_twin("worn", 1).to_toml(), "utf-8")
    closed = close_gap("sim", f"twin:{twin}", out=folder / "closed")
    before = film(closed.before.study, "Before the calibration", folder / "before.gif")
    after = film(closed.after.study, "After 20 trials of calibration", folder / "after.gif")
    frames = []
    for one, other in list(zip(before, after, strict=False))[::SKIP]:
        frame = Image.new("RGB", (2 * WIDTH, one.height), "white")
        frame.paste(one, (0, 0))
        frame.paste(other, (WIDTH, 0))
        frames.append(frame)
    palette = frames[-1].quantize(COLORS)
    first, *others = (frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames)
    duration = 40 * SKIP
    lasting = [duration] * len(others) + [2500]
    first.save(HERO, save_all=True, append_images=others, duration=lasting, loop=0, optimize=True)
    change = closed.change.rms
    print(
        f"{HERO.name}: {len(frames)} frames, {HERO.stat().st_size // 1024} kB; change of the RMS gap {change}"
    )


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(Path(sys.argv[1]))
    else:
        with tempfile.TemporaryDirectory() as temporary:
            main(Path(temporary))
