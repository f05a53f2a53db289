"""The version of what computes the numbers in a record."""

from __future__ import annotations

RESULTS_VERSION = 2
"""Raised whenever the same study would give other numbers; results of another version are never extended."""


class RecordWarning(UserWarning):
    """A warning about a folder of results that does not stop the program."""
