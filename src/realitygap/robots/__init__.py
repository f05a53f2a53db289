"""Platforms: whatever can try a controller."""

from ._jyro import STEP_S, JyroPlatform

__all__ = ["STEP_S", "JyroPlatform"]
