"""Figures of a study that were drawn before, in its folder: reopening its page draws nothing."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from realitygap import __version__
from realitygap._limits import read_file
from realitygap.errors import RecordError
from realitygap.records import RESULTS_VERSION, refuse_links, write_whole

from ._messages import Curve, Figure, SummaryRow
from ._scoring_files import FOLDER, read_json, write_json

_FIGURES, _SUMMARY, _THUMBNAIL = "figures.json", "summary.json", "thumbnail.svg"
_FORM = 2
"""Number of the form of these files; files of another form are not read."""
_LONGEST_THUMBNAIL = 500_000
"""Size above which a thumbnail is not shown [bytes]."""
_ROWS = TypeAdapter(list[SummaryRow])
_CURVES = TypeAdapter(list[Curve])
_KEPT_FIGURES = TypeAdapter(dict[str, Figure])


def keep_figures(
    folder: Path,
    done: Sequence[int],
    rows: Sequence[SummaryRow],
    curves: Sequence[Curve],
    figures: Mapping[str, Figure],
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


def keep_rows(folder: Path, done: Sequence[int], rows: Sequence[SummaryRow]) -> None:
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
) -> tuple[list[SummaryRow], list[Curve], dict[str, Figure]] | None:
    """Return the rows, curves, and figures that this version drew of these runs; None if there are none."""
    kept, rows = _kept(folder, _FIGURES, done), read_rows(folder, done)
    try:
        curves = _CURVES.validate_python(kept.get("curves"), strict=True)
        figures = _KEPT_FIGURES.validate_python(kept.get("figures"), strict=True)
    except ValidationError:
        return None
    are_drawn = all(curve["points"] for curve in curves)
    return (rows, curves, figures) if rows is not None and are_drawn else None


def read_rows(folder: Path, done: Sequence[int]) -> list[SummaryRow] | None:
    """Return the summary of the conditions of these runs by this version; None if there is none."""
    try:
        return _ROWS.validate_python(_kept(folder, _SUMMARY, done).get("rows"), strict=True)
    except ValidationError:
        return None


def _kept(folder: Path, name: str, done: Sequence[int]) -> dict[str, Any]:
    kept = read_json(folder / FOLDER / name)
    return kept if isinstance(kept, dict) and kept.get("of") == _origin(done) else {}


def _origin(done: Sequence[int]) -> list[Any]:
    return [__version__, RESULTS_VERSION, _FORM, *done]
