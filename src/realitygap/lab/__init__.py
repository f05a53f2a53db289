"""The lab: a web page to run, watch, and score studies with a phone or a laptop next to a robot.

`open_lab` serves the studies of a folder. The robot and every study are driven by processes of their own, never by a
page; what the page is told goes into the study's folder and its ledger at once. Needs the extra `lab` (NiceGUI).
"""

from ._server import DEFAULT_PORT, open_lab

__all__ = ["DEFAULT_PORT", "open_lab"]
