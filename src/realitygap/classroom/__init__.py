"""Robots for lessons: the functions of Myro, Jyro's world of robots and devices, and panels to drive by hand.

`myro` has the functions that students' programs import. `jyro` has worlds with several robots and their devices. No
other package needs this one.
"""

from ._panel import DrivePanel, WorldPanel

__all__ = ["DrivePanel", "WorldPanel"]
