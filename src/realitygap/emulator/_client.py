"""Running a client program against a pseudo-terminal, which refuses the modem lines that some clients set.

Some old clients set DTR when they open a port. A pseudo-terminal has no such line, the call fails (ENOTTY), and they
wait for ever. Python looks for a module `sitecustomize` when it starts; the one written here, for the child
program only, lets such a call do nothing. It is written for Python 2 and 3, and for every pyserial.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

from realitygap.errors import RobotError

PORT_VARIABLE = "REALITYGAP_PORT"

PATCH = """\
# Written for the client of an emulated robot: a pseudo-terminal has no modem lines, and setting one does nothing.
import errno
import os
import sys

try:
    import fcntl
    import termios

    _ioctl = fcntl.ioctl
    _lines = (termios.TIOCMBIS, termios.TIOCMBIC, termios.TIOCMSET)

    def _forgiving(fd, request, *args):
        try:
            return _ioctl(fd, request, *args)
        except (IOError, OSError) as error:
            if request not in _lines or error.errno != errno.ENOTTY:
                raise
            return 0

    fcntl.ioctl = _forgiving
except (ImportError, AttributeError):
    pass

# another sitecustomize is loaded as before
_here = os.path.dirname(os.path.abspath(__file__))
sys.path[:] = [_place for _place in sys.path if os.path.abspath(_place) != _here]
_this = sys.modules.pop("sitecustomize", None)
try:
    import sitecustomize
except ImportError:
    if _this is not None:
        sys.modules["sitecustomize"] = _this
"""


@contextlib.contextmanager
def client_environment(port: str) -> Iterator[dict[str, str]]:
    """Yield the environment of a client program: the port's name in REALITYGAP_PORT, and the patch."""
    with tempfile.TemporaryDirectory(prefix="realitygap-client-") as folder:
        (Path(folder) / "sitecustomize.py").write_text(PATCH, encoding="utf-8")
        others = os.environ.get("PYTHONPATH")
        paths = os.pathsep.join([folder, others] if others else [folder])
        yield {**os.environ, "PYTHONPATH": paths, PORT_VARIABLE: port}


def run_client(command: str, port: str) -> int:
    """Run a client program in a shell until it ends, and return its status.

    Args:
        command: Command to run; {port} in it is replaced by the port's name.
        port: Port for the client.

    Raises:
        RobotError: It cannot be started.
    """
    with client_environment(port) as environment:
        try:
            return subprocess.run(
                command.replace("{port}", port), shell=True, env=environment, check=False
            ).returncode
        except OSError as error:
            raise RobotError(f"{command!r} cannot be started ({error.strerror}).") from error
