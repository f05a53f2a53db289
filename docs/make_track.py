"""The picture and the table of the page “Follow a robot with a camera”.

    uv run python docs/make_track.py            # the picture: the page's own film, and what was found in it
    uv run python docs/make_track.py --measure  # the table, too: what benchmarks/tracking.py measures; minutes, by hand

The picture is docs/images/track.png: a picture of the film with what was found drawn in, and its errors over time.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

DOCS = Path(__file__).parent
PAGE = DOCS / "how-to" / "track.md"
PICTURE = DOCS / "images" / "track.png"
BENCHMARK = DOCS.parent / "benchmarks" / "tracking.py"
MEASURED = re.compile(r"(<!-- measured -->\n).*?(<!-- end -->)", re.DOTALL)
SHOWN_S = 6.5  # of the film
STYLE = {
    "font.family": ["DejaVu Sans"],
    "font.size": 8.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
}
SEEN, FILLED = "#14aa50", "#ff7800"


def film() -> Any:
    """The page's own."""
    block = re.search(r"^```python\n(.*?)^```$", PAGE.read_text("utf-8"), re.MULTILINE | re.DOTALL)
    if block is None:
        raise SystemExit(f"{PAGE} has no film.")
    names: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        exec(block[1], names)
    return names["film"]


def draw(path: Path) -> None:
    """Track the film, and draw."""
    import matplotlib.pyplot as plt

    from realitygap.vision import Marks, draw_overlay, track_video

    shown = film()
    pictures = list(shown)
    found = track_video(pictures, Marks(shown.arena))
    track = found.track
    at, image = min(pictures, key=lambda one: abs(one[0] - SHOWN_S))
    off = track.poses - shown.truth(track.times)
    mm = 1e3 * np.hypot(off[:, 0], off[:, 1])
    degrees = np.degrees((off[:, 2] + np.pi) % (2 * np.pi) - np.pi)
    with plt.rc_context(STYLE):
        figure = plt.figure(figsize=(7.0, 5.2))
        above, *below = figure.subplot_mosaic([["a", "a"], ["b", "c"]], height_ratios=[2.6, 1]).values()
        above.imshow(draw_overlay(image, at, found, shown.arena)[..., ::-1])
        above.axis("off")
        for axes, values, what in zip(
            below, (mm, degrees), ("place off by [mm]", "heading off by [degrees]"), strict=True
        ):
            axes.plot(track.times[track.seen], values[track.seen], ".", ms=2, color=SEEN, label="seen")
            axes.plot(
                track.times[~track.seen], values[~track.seen], ".", ms=3, color=FILLED, label="filled in"
            )
            axes.set(xlabel="time [s]", ylabel=what)
        below[0].legend(frameon=False, loc="upper right")
        figure.tight_layout()
        figure.savefig(path, dpi=110)
        plt.close(figure)


def table(measured: dict[str, Any]) -> str:
    """What the benchmark says, as the page has it."""
    films, rms = measured["films"], measured["rms"]
    lines = ["| | the lens fitted to the tags | the true lens |", "|---|---|---|"]
    for name, title, unit in (
        ("mm", "place, all pictures", "mm"),
        ("deg", "heading, all pictures", "degrees"),
        ("seen_mm", "place, where seen", "mm"),
        ("seen_deg", "heading, where seen", "degrees"),
    ):
        cells = [f"{rms[lens][name]:.2f} {unit}" for lens in ("fitted_lens", "known_lens")]
        lines.append(f"| {title} | {cells[0]} | {cells[1]} |")
    worst = [max(one[lens]["mm"] for one in films) for lens in ("fitted_lens", "known_lens")]
    lines.append(f"| place, worst film | {worst[0]:.2f} mm | {worst[1]:.2f} mm |")
    n = sum(one["pictures"] for one in films)
    lines += [
        "",
        f"Root mean squares over {len(films)} films with {n:,} pictures; in the slowest one core did "
        f"{measured['slowest']:.0f} pictures a second, reading the video included.",
        "",
    ]
    return "\n".join(lines)


def measure() -> None:
    """Run the benchmark, and write its table into the page."""
    command = [sys.executable, str(BENCHMARK), "--json", "--films", "8", "--seconds", "6"]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    text = PAGE.read_text("utf-8")
    PAGE.write_text(
        MEASURED.sub(lambda found: found[1] + table(json.loads(done.stdout)) + found[2], text), "utf-8"
    )


def main() -> None:
    """Draw, and measure where that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--measure", action="store_true", help="the table, too")
    options = parser.parse_args()
    draw(PICTURE)
    if options.measure:
        measure()


if __name__ == "__main__":
    main()
