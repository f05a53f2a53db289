"""The pictures of the gallery, and its page.

    uv run python docs/make_gallery.py            # all of them
    uv run python docs/make_gallery.py maze       # one

Runs examples/gallery/*.py in a temporary folder, and writes docs/images/gallery/*. What the page says of an example is
the text at its head; `conf.py` puts the page together at each build.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import runpy
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

HERE = Path(__file__).resolve().parent
EXAMPLES = HERE.parent / "examples" / "gallery"
PICTURES = HERE / "images" / "gallery"
MOST_BYTES = 300_000

# Examples in the order of the page.
ORDER = (
    "paper_in_five_lines",
    "eight_individuals",
    "two_platforms",
    "maze",
    "novelty_archive",
    "leverage",
    "more_noise",
    "one_wall",
    "light_seeking",
    "hundred_robots",
)


def names() -> list[str]:
    """The examples there are, in the order of the page."""
    there = {path.stem for path in EXAMPLES.glob("*.py")}
    if there != set(ORDER):
        raise SystemExit(f"ORDER in {__file__} and {EXAMPLES} differ: {sorted(there ^ set(ORDER))}")
    return list(ORDER)


def picture_name(name: str) -> str:
    """The file name of an example's picture: its own name, with the ending that it draws by itself."""
    code = (EXAMPLES / f"{name}.py").read_text("utf-8")
    found = re.search(r'sys\.argv\[1\] if len\(sys\.argv\) > 1 else "[\w-]+(\.\w+)"', code)
    if found is None:
        raise SystemExit(f"{name}.py names no picture: sys.argv[1] if len(sys.argv) > 1 else ...")
    return name.replace("_", "-") + found[1]


def run(name: str, picture: Path, folder: Path) -> str:
    """Run an example in a folder, in which it may find what others left; returns what it printed."""
    said, before, arguments = io.StringIO(), Path.cwd(), sys.argv
    os.chdir(folder)
    sys.argv = [name, str(picture)]
    try:
        with contextlib.redirect_stdout(said):
            runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")
    finally:
        sys.argv = arguments
        os.chdir(before)
    return said.getvalue()


def difference(one: Path, other: Path) -> str:
    """How two pictures differ beyond what another version of a library does; empty where they do not."""
    if one.suffix == ".svg":
        texts = [re.findall(r">([^<>]+)</text>", path.read_text("utf-8")) for path in (one, other)]
        if texts[0] != texts[1]:
            changed = [pair for pair in zip(*texts, strict=False) if pair[0] != pair[1]]
            return f"says {changed[:3] or [len(each) for each in texts]}"
        sizes = [path.stat().st_size for path in (one, other)]
        return (
            "" if abs(sizes[0] - sizes[1]) < 0.1 * max(sizes) else f"{sizes[0]:,} bytes, {sizes[1]:,} before"
        )
    with Image.open(one) as new, Image.open(other) as old:
        frames = [getattr(image, "n_frames", 1) for image in (new, old)]
        if frames[0] != frames[1] or new.size != old.size:
            return f"{frames[0]} pictures of {new.size}, {frames[1]} of {old.size} before"
        for image in (new, old):
            image.seek(frames[0] - 1)
        shown = [np.asarray(image.convert("RGB")).astype(int) for image in (new, old)]
        apart = (np.abs(shown[0] - shown[1]).max(axis=2) > 80).mean()
        return "" if apart < 0.02 else f"{100 * apart:.1f} % of its pixels differ"


def page_part() -> str:
    """What the page shows: of each example its title, its text, its picture and its code."""
    parts = []
    for name in names():
        code = (EXAMPLES / f"{name}.py").read_text("utf-8")
        title, text = code.split('"""')[1].strip().split("\n", 1)
        alt = " ".join(text.split())
        parts += [
            f"## {title.rstrip('.')}\n",
            text.strip() + "\n",
            f"```{{image}} images/gallery/{picture_name(name)}\n:alt: {alt}\n```\n",
            f"```{{literalinclude}} ../examples/gallery/{name}.py\n:language: python\n"
            f":lines: {code[: code.index('import ')].count(chr(10)) + 1}-\n:caption: examples/gallery/{name}.py\n```\n",
        ]
    return "\n".join(parts)


def main(chosen: list[str]) -> None:
    """Write the pictures of these examples, or of all."""
    unknown = sorted(set(chosen) - set(names()))
    if unknown:
        raise SystemExit(f"No example {', '.join(unknown)}. Known: {', '.join(names())}.")
    PICTURES.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        for name in chosen or names():
            picture = PICTURES / picture_name(name)
            run(name, picture, Path(folder))
            n_bytes = picture.stat().st_size
            print(f"Written: {picture} ({n_bytes / 1000:.0f} kB)")
            if n_bytes > MOST_BYTES:
                raise SystemExit(f"{picture.name} is too large: expected at most {MOST_BYTES / 1000:.0f} kB.")


if __name__ == "__main__":
    main(sys.argv[1:])
