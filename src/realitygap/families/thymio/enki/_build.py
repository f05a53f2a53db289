"""The program in which Enki simulates a Thymio II: its source, its path, and how it is compiled."""

from __future__ import annotations

import hashlib
import os
import shutil
import stat
import subprocess
import tempfile
from pathlib import Path

from realitygap.errors import RobotError
from realitygap.kernels.compile.cache import cache_root

SOURCE = Path(__file__).with_name("harness.cpp")
PACKAGES = "g++ and libenki-dev"
_FLAGS = ("-O2", "-std=c++17")


def harness_path() -> Path:
    """Return the path of the compiled program, whether it is there or not.

    It is in the folder `enki` of the user's cache folder, or of `REALITYGAP_CACHE`. Its name has a hash of the source.
    """
    digest = hashlib.sha256(SOURCE.read_bytes()).hexdigest()[:16]
    return cache_root() / "enki" / f"harness-{digest}"


def build_enki() -> Path:
    """Compile the program in which Enki simulates a Thymio, and return its path.

    The platform enki needs it. Compiling needs g++ and libenki-dev.

    Example: realitygap twin build-enki

    In Python: realitygap.families.thymio.build_enki()
    """
    compiler = shutil.which("g++")
    if compiler is None:
        raise RobotError(_missing("There is no g++."))
    path = harness_path()
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=path.parent) as folder:
            made = Path(folder) / path.name
            command = [compiler, *_FLAGS, "-o", str(made), str(SOURCE), "-lenki"]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode:
                raise RobotError(_missing(_first_error(done.stderr)))
            made.chmod(0o700)
            made.replace(path)
    except OSError as error:
        raise RobotError(f"The Enki harness cannot be written to {path} ({error.strerror}).") from error
    return path


def built_harness() -> Path:
    """Return the path of the compiled program.

    Raises:
        RobotError: It has not been compiled, or another user could have written it.
    """
    path = harness_path()
    if not path.is_file():
        raise RobotError(
            f"The Enki harness is not built. Run: realitygap twin build-enki (it needs {PACKAGES}; Debian: apt-get "
            "install g++ libenki-dev)."
        )
    state = path.stat()
    if state.st_uid != os.getuid() or state.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        raise RobotError(f"Others can write to {path}, so it is not run. Delete it, and build it again.")
    return path


def _missing(problem: str) -> str:
    return f"The Enki harness cannot be built: {problem} It needs {PACKAGES} (Debian: apt-get install g++ libenki-dev)."


def _first_error(text: str) -> str:
    lines = [line for line in text.splitlines() if "error" in line] or ["g++ failed."]
    return lines[0].strip().rstrip(".") + "."
