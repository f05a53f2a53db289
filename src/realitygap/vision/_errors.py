"""Errors in reading photographs."""

from __future__ import annotations

from realitygap.errors import RealityGapError


class SheetError(RealityGapError):
    """A photograph cannot be read, or the sheet is not on it."""
