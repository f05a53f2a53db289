"""The pictures and the table of the page “Cells from a photo of the sheet”.

    uv run python docs/make_score.py

The pictures are of the page's own study and photo; the table is of docs/data/vision.json, which
`benchmarks/vision.py judge` writes.
"""

from __future__ import annotations

import contextlib
import io
import json
import re
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

from realitygap import drive_study
from realitygap.records import Ledger
from realitygap.testing import photograph_sheet
from realitygap.vision import SheetLayout, overlay_png, read_photo, score_sheet
from realitygap.world import paper_arena

DOCS = Path(__file__).parent
PAGE = DOCS / "how-to" / "score.md"
IMAGES = DOCS / "images" / "score"
DATA = DOCS / "data" / "vision.json"
TABLE = re.compile(r"(<!-- table: docs/make_score.py -->\n).*?(<!-- end of table -->)", re.DOTALL)
WIDTH = 1200  # of the pictures [px]
SEED = 2  # of the page's photo


def pictures() -> dict[str, bytes]:
    """The page's photo and its overlay, smaller, by the names of their files."""
    study = re.search(r"<!-- file: small.toml -->\n```toml\n(.*?)^```$", PAGE.read_text("utf-8"), re.M | re.S)
    if study is None:
        raise SystemExit(f"{PAGE} has no study small.toml.")
    layout = SheetLayout.of(paper_arena())
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        Path("small.toml").write_text(study.group(1), "utf-8")
        drive_study("small.toml", "emulator://s2?fluke=1&speed=off", "results")
        with Ledger.open("results/ledger.sqlite", writable=False) as ledger:
            paths = [np.array(score["path"])[:, :2] for score in ledger.scores()]
    photo = photograph_sheet(layout, paths, SEED).jpeg
    overlay = overlay_png(score_sheet(read_photo(photo), layout))
    return {"photo.jpg": _smaller(photo), "overlay.jpg": _smaller(overlay)}


def _smaller(data: bytes) -> bytes:
    with Image.open(io.BytesIO(data)) as picture:
        size = (WIDTH, round(picture.height * WIDTH / picture.width))
        small = picture.convert("RGB").resize(size, Image.Resampling.LANCZOS)
    file = io.BytesIO()
    small.save(file, "JPEG", quality=80)
    return file.getvalue()


def table() -> str:
    """What the benchmark found, as Markdown."""
    if not DATA.exists():
        return "\nNot measured yet: `python benchmarks/vision.py judge --out docs/data/vision.json`.\n\n"
    found = json.loads(DATA.read_text("utf-8"))
    rows = [
        ("sheets, traces", f"{found['sheets']}, {found['traces']}"),
        ("intersection over union of the visited cells, mean of the traces", f"{found['iou_mean']:.3f}"),
        ("the same, median", f"{found['iou_median']:.3f}"),
        ("the same, all cells together", f"{found['iou_of_all_cells']:.3f}"),
        ("coverage within one cell", f"{100 * found['coverage_within_one_cell']:.1f} % of the traces"),
        ("coverage exact", f"{100 * found['coverage_exact']:.0f} % of the traces"),
    ]
    for part in found["confidence"]:
        low, high = part["said"]
        rows.append(
            (
                f"of {part['cells']:,} cells said to be {100 * low:.0f} to {100 * high:.0f} % sure, right",
                f"{100 * part['right']:.1f} % (said: {100 * part['said_mean']:.1f} %)",
            )
        )
    return "\n".join(["", "| | |", "|---|---|", *(f"| {name} | {value} |" for name, value in rows), "", ""])


def with_table(page: str) -> str:
    """The page with the present table."""
    return TABLE.sub(lambda found: found.group(1) + table() + found.group(2), page)


def main() -> None:
    """Write pictures and table down."""
    IMAGES.mkdir(exist_ok=True)
    for name, data in pictures().items():
        (IMAGES / name).write_bytes(data)
    PAGE.write_text(with_table(PAGE.read_text("utf-8")), "utf-8")


if __name__ == "__main__":
    main()
