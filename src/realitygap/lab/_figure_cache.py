"""Figures of a study that were drawn before, in its folder: reopening its page draws nothing."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from realitygap import __version__
from realitygap.errors import RecordError
from realitygap.records import RESULTS_VERSION

from ._drawn import FOLDER, read_json, write_json

_FIGURES, _SUMMARY = "figures.json", "summary.json"
_TEXTS = ("caption", "alt", "wide", "narrow", "text")


def keep_figures(folder: Path, done: Sequence[int], rows: Sequence[Any], figures: Mapping[str, Any]) -> None:
    """Keep the figures of a study; nothing happens if the folder cannot be written.

    Args:
        folder: Folder of the study.
        done: Number of complete runs: simulated, and driven.
        rows: Summary of the conditions.
        figures: Caption, alternative text, and drawings by name.
    """
    with contextlib.suppress(RecordError, OSError):
        origin = _origin(done)
        write_json(folder, folder / FOLDER / _FIGURES, {"of": origin, "figures": dict(figures)})
        write_json(folder, folder / FOLDER / _SUMMARY, {"of": origin, "rows": list(rows)})


def read_figures(folder: Path, done: Sequence[int]) -> tuple[list[Any], dict[str, dict[str, str]]] | None:
    """Return the rows and figures that were drawn of these runs by this version; None if there are none."""
    figures = _kept(folder, _FIGURES, done).get("figures")
    rows = read_rows(folder, done)
    if rows is None or not isinstance(figures, dict):
        return None
    found = {}
    for name, figure in figures.items():
        if not isinstance(figure, dict) or not all(isinstance(figure.get(key, ""), str) for key in _TEXTS):
            return None
        found[name] = {key: figure[key] for key in _TEXTS if key in figure}
    return rows, found


def read_rows(folder: Path, done: Sequence[int]) -> list[dict[str, Any]] | None:
    """Return the summary of the conditions of these runs by this version; None if there is none."""
    rows = _kept(folder, _SUMMARY, done).get("rows")
    if not isinstance(rows, list) or not all(map(_is_row, rows)):
        return None
    return rows


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
