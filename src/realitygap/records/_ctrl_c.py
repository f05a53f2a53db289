"""Wake waiting threads at Ctrl-C."""

from __future__ import annotations

import signal


def wake_on_ctrl_c() -> None:
    """Let Ctrl-C end calls of the system that wait, as it does in Python; to be called after Polars is imported.

    Polars catches the signal with SA_RESTART: a wait for a lock, for input or for another process would go on to its
    end, and only then would the program hear of it. Its handler stays, without that flag.
    """
    if hasattr(signal, "siginterrupt"):  # not on Windows
        signal.siginterrupt(signal.SIGINT, True)
