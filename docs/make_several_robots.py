"""The pictures of the page “Several robots in one world”, drawn by the page's own code.

uv run python docs/make_several_robots.py
"""

from __future__ import annotations

import contextlib
import re
import tempfile
from pathlib import Path

DOCS = Path(__file__).parent
PAGE = DOCS / "how-to" / "several-robots.md"
IMAGES = DOCS / "images"
PICTURES = ("several-robots.svg", "several-sim-robots.svg")


def make() -> dict[str, str]:
    """What each picture is, by the name of its file: the page's blocks are run up to those that save."""
    blocks = re.findall(r"^```python\n(.*?)^```$", PAGE.read_text("utf-8"), re.MULTILINE | re.DOTALL)
    names: dict[str, object] = {}
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        for block in blocks:
            if not block.startswith(">>>"):
                exec(block, names)
        return {name: Path(name).read_text("utf-8") for name in PICTURES}


def main() -> None:
    """Write the pictures down."""
    for name, text in make().items():
        (IMAGES / name).write_text(text, "utf-8")


if __name__ == "__main__":
    main()
