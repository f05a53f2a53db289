"""The weight of each sign that a trace crosses a cell.

As `benchmarks/vision.py fit --sheets 48` finds them; it judges by other sheets.
"""

from __future__ import annotations

import numpy as np

COEFFICIENTS = np.array(
    [-6.53, 7.109, -2.747, 2.196, 1.138, 3.034, 0.749, 0.085, 1.587, 1.875, 1.449, 1.816, -0.209]
)
