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

_NAME = "figures.json"
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
        kept = {"of": _origin(done), "rows": list(rows), "figures": dict(figures)}
        write_json(folder, folder / FOLDER / _NAME, kept)


def read_figures(folder: Path, done: Sequence[int]) -> tuple[list[Any], dict[str, dict[str, str]]] | None:
    """Return the rows and figures that were drawn of these runs by this version; None if there are none."""
    kept = read_json(folder / FOLDER / _NAME)
    if not isinstance(kept, dict) or kept.get("of") != _origin(done):
        return None
    rows, figures = kept.get("rows"), kept.get("figures")
    if not isinstance(rows, list) or not isinstance(figures, dict):
        return None
    found = {}
    for name, figure in figures.items():
        if not isinstance(figure, dict) or not all(isinstance(figure.get(key, ""), str) for key in _TEXTS):
            return None
        found[name] = {key: figure[key] for key in _TEXTS if key in figure}
    return rows, found


def _origin(done: Sequence[int]) -> list[Any]:
    return [__version__, RESULTS_VERSION, *done]
