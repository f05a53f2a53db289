"""Enki, the e-puck's and Thymio's 2-D simulator in C++: what `peers.py` times of it.

`enki_peer.cpp`, compiled here against the system's library: one robot of our outline (eight corners) and wheels in
the paper's arena, without and with the two boxes of `paper-boxes`, three of its IR sensors (three rays each, Gaussian
noise), its motor noise, trials of 100 steps of 0.5 s from the arena's start. It has no friction at walls, no delay and
no cells, and one robot a world. Our figure is `realitygap bench realism`; both count processor time.
"""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from environments import HERE, Peer, PeerError, answer_as_worker, spread

PEER = Peer(
    name="enki",
    title="Enki",
    requirements=("setuptools==80.9.0",),  # nothing of Python: the library is the system's
    packages=(),
    figures=("realism_avoiding", "realism_pressed", "realism_boxes"),
)
STEPS, REPEATS = 200_000, 6


def _program(folder: str) -> Path:
    compiler = shutil.which("g++") or shutil.which("c++")
    if compiler is None:
        raise PeerError("a C++ compiler is needed (Debian: apt-get install g++ libenki-dev)")
    program = Path(folder) / "enki_peer"
    command = [compiler, "-O3", "-march=native", "-o", str(program), str(HERE / "enki_peer.cpp"), "-lenki"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise PeerError(
            "Enki could not be compiled against (Debian: apt-get install g++ libenki-dev): "
            + done.stderr[:200]
        )
    return program


def _rates(case: str) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        command = [str(_program(folder)), str(STEPS), str(REPEATS), case]
        lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    return spread([float(line) for line in lines][1:])


if __name__ == "__main__":
    answer_as_worker(
        PEER,
        {f"realism_{case}": lambda case=case: _rates(case) for case in ("avoiding", "pressed", "boxes")},
    )
