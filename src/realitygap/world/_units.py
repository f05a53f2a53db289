"""Units that files may use; inside there are meters and radians only."""

from __future__ import annotations

INCH = 0.0254  # [m]
