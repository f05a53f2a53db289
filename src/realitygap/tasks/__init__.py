"""What is rewarded."""

from ._coverage import CoverageTask

__all__ = ["CoverageTask"]
