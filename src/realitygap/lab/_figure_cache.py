"""Figures of a study that were drawn before, in its folder: reopening its page draws nothing."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from realitygap import __version__
from realitygap._limits import read_file
from realitygap.errors import RecordError
from realitygap.records import RESULTS_VERSION, refuse_links, write_whole

from ._drawn import FOLDER, read_json, write_json

_FIGURES, _SUMMARY, _THUMBNAIL = "figures.json", "summary.json", "thumbnail.svg"
_LONGEST_THUMBNAIL = 500_000
"""Size above which a thumbnail is not shown [bytes]."""
_TEXTS = ("caption", "alt", "wide", "narrow", "text")


def keep_figures(
    folder: Path,
    done: Sequence[int],
    rows: Sequence[Any],
    curves: Sequence[Any],
    figures: Mapping[str, Any],
) -> None:
    """Keep the figures of a study; nothing happens if the folder cannot be written.

    Args:
        folder: Folder of the study.
        done: Number of complete runs: simulated, and driven.
        rows: Summary of the conditions.
        curves: Coverage by generation of each condition.
        figures: Caption, alternative text, and drawings by name.
    """
    keep_rows(folder, done, rows)
    with contextlib.suppress(RecordError, OSError):
        values = {"of": _origin(done), "curves": list(curves), "figures": dict(figures)}
        write_json(folder, folder / FOLDER / _FIGURES, values)


def keep_rows(folder: Path, done: Sequence[int], rows: Sequence[Any]) -> None:
    """Keep the summary of the conditions; nothing happens if the folder cannot be written."""
    with contextlib.suppress(RecordError, OSError):
        write_json(folder, folder / FOLDER / _SUMMARY, {"of": _origin(done), "rows": list(rows)})


def keep_thumbnail(folder: Path, svg: str) -> None:
    """Keep the small picture of a study; nothing happens if the folder cannot be written."""
    path = folder / FOLDER / _THUMBNAIL
    with contextlib.suppress(RecordError, OSError):
        refuse_links(folder, path)
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, svg.encode(), within=folder)


def read_thumbnail(folder: Path) -> bytes | None:
    """Return the small picture of a study, as SVG; None if there is none."""
    try:
        return read_file(folder / FOLDER / _THUMBNAIL, _LONGEST_THUMBNAIL, plain=True)
    except (OSError, ValueError):
        return None


def has_thumbnail(folder: Path) -> bool:
    """Return whether there is a small picture of a study."""
    return (folder / FOLDER / _THUMBNAIL).is_file()


def read_figures(
    folder: Path, done: Sequence[int]
) -> tuple[list[Any], list[Any], dict[str, dict[str, str]]] | None:
    """Return the rows, curves, and figures that this version drew of these runs; None if there are none."""
    kept = _kept(folder, _FIGURES, done)
    figures, curves = kept.get("figures"), kept.get("curves")
    rows = read_rows(folder, done)
    if rows is None or not isinstance(figures, dict) or not _are_curves(curves):
        return None
    found = {}
    for name, figure in figures.items():
        if not isinstance(figure, dict) or not all(isinstance(figure.get(key, ""), str) for key in _TEXTS):
            return None
        found[name] = {key: figure[key] for key in _TEXTS if key in figure}
    return rows, curves or [], found


def read_rows(folder: Path, done: Sequence[int]) -> list[dict[str, Any]] | None:
    """Return the summary of the conditions of these runs by this version; None if there is none."""
    rows = _kept(folder, _SUMMARY, done).get("rows")
    if not isinstance(rows, list) or not all(map(_is_row, rows)):
        return None
    return rows


def _are_curves(curves: Any) -> bool:
    return isinstance(curves, list) and all(
        isinstance(curve, dict)
        and isinstance(curve.get("condition"), str)
        and isinstance(curve.get("label"), str)
        and isinstance(curve.get("points"), list)
        and bool(curve["points"])
        and all(map(_is_point, curve["points"]))
        for curve in curves
    )


def _is_point(point: Any) -> bool:
    return (
        isinstance(point, dict)
        and isinstance(point.get("n"), int)
        and isinstance(point.get("median"), float | int)
        and all(point.get(key) is None or isinstance(point[key], float | int) for key in ("low", "high"))
    )


def _is_row(row: Any) -> bool:
    numbers = ("line_median", "line_low", "line_high")
    return (
        isinstance(row, dict)
        and all(isinstance(row.get(key), str) for key in ("condition", "label"))
        and isinstance(row.get("n"), int)
        and all(row.get(key) is None or isinstance(row[key], float | int) for key in numbers)
    )


def _kept(folder: Path, name: str, done: Sequence[int]) -> dict[str, Any]:
    kept = read_json(folder / FOLDER / name)
    return kept if isinstance(kept, dict) and kept.get("of") == _origin(done) else {}


def _origin(done: Sequence[int]) -> list[Any]:
    return [__version__, RESULTS_VERSION, *done]
