"""The part of a calibration that a fit makes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap._version import __version__
from realitygap.world import Fitted

SOFTWARE = f"realitygap {__version__}"


@dataclass(frozen=True)
class Parts:
    """The fields that a fit adds to a calibration; attributes as there."""

    fitted: tuple[Fitted, ...]
    numbers: Mapping[str, float]
    draws: Mapping[str, Sequence[float] | NDArray[np.float64]]
    method: str
    notes: tuple[str, ...] = ()
    misspecified: bool = False
    misspecification_p: float = 1.0
    evidence: dict[str, Any] = field(default_factory=dict)
    verdict: str = ""
    reasons: tuple[str, ...] = ()
