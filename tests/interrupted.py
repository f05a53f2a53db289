"""How a command that was ended by Ctrl-C says so."""

from __future__ import annotations

import signal

INTERRUPTED = (130, -signal.SIGINT)
"""Its own status; or that of the signal, by which Python ends in place of any other where the interrupt once came
through `exec` of a text, as in Numba while it loads a kernel. A shell says 130 of both."""
