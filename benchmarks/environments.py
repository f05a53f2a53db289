"""An environment of its own for each peer, and what is said where one cannot be had.

Nothing but the standard library: the workers import it in their own environments.
"""

from __future__ import annotations

import json
import os
import platform
import shutil
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, NamedTuple

from work import FIGURES, REPEATS

HERE = Path(__file__).parent
SECONDS = 600.0  # that a worker may take for what no figure says


class PeerError(Exception):
    """A peer could not be built or run; the text says why."""


class Peer(NamedTuple):
    """Another library, and the script here that times it."""

    name: str
    title: str
    requirements: tuple[str, ...]  # the first is the peer itself, with its version; none: ours
    packages: tuple[str, ...]  # whose versions are told
    figures: tuple[str, ...]

    @property
    def script(self) -> Path:
        """What times it, in its environment."""
        return HERE / (f"{self.name}_peer.py" if self.requirements else f"{self.name}.py")


# in the environment that runs the benchmark


def environment_folder(peer: Peer) -> Path:
    """Where it is kept: in `REALITYGAP_CACHE`, the user's cache folder, or the temporary one."""
    named = os.environ.get("REALITYGAP_CACHE")
    folder = Path(named) if named else Path.home() / ".cache" / "realitygap"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        folder = Path(tempfile.gettempdir()) / "realitygap"
        folder.mkdir(parents=True, exist_ok=True)
    pinned = "-".join(peer.requirements[0].split("=="))
    return folder / f"{pinned}-python{sys.version_info.major}.{sys.version_info.minor}"


def build_environment(peer: Peer, *, fresh: bool) -> Path:
    """The interpreter of a peer's environment, built by uv, or venv and pip, when it is not there yet."""
    if not peer.requirements:
        return Path(sys.executable)
    folder = environment_folder(peer)
    python = folder / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    done = folder / "complete"
    wanted = "\n".join(peer.requirements)
    if fresh or not done.exists() or done.read_text("utf-8") != wanted:
        shutil.rmtree(folder, ignore_errors=True)
        print(f"Building an environment for {peer.title} in {folder} ...", file=sys.stderr)
        if shutil.which("uv"):
            run(["uv", "venv", "--quiet", "--python", sys.executable, str(folder)])
            run(["uv", "pip", "install", "--quiet", "--python", str(python), *peer.requirements])
        else:
            run([sys.executable, "-m", "venv", str(folder)])
            run([str(python), "-m", "pip", "install", "--quiet", *peer.requirements])
        done.write_text(wanted, "utf-8")
    return python


def run(command: Sequence[str], seconds: float | None = None) -> str:
    """What a command prints; `PeerError` with what it said when it fails."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=seconds)
    except OSError as error:
        raise PeerError(f"{command[0]} could not be started: {error}") from error
    except subprocess.TimeoutExpired:
        raise PeerError(f"not done after {seconds:g} s") from None
    if done.returncode:
        said = (done.stderr or done.stdout).strip().splitlines()[-5:]
        raise PeerError(f"{' '.join(command[:4])} ... failed:\n" + "\n".join(said))
    return done.stdout


def measure(peer: Peer, python: Path, figure: str, seconds: float = SECONDS) -> dict[str, Any]:
    """One figure of a peer: `median`, `low`, `high`, and whatever else its worker tells."""
    seconds = FIGURES[figure].seconds if figure in FIGURES else seconds
    lines = run([str(python), str(peer.script), "--worker", figure], seconds).strip().splitlines()
    answer: dict[str, Any] = json.loads(lines[-1])
    if "error" in answer:
        raise PeerError(answer["error"])
    return answer


def machine() -> dict[str, str]:
    """What this ran on."""
    name = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        models = [
            line.split(":", 1)[1].strip() for line in info.read_text().splitlines() if "model name" in line
        ]
        name = models[0] if models else name
    return {"cpu": name, "cores": str(os.cpu_count()), "system": platform.platform()}


def versions_of(packages: Sequence[str]) -> dict[str, str]:
    """Python's version and those of some packages, where this runs."""
    found = {"python": platform.python_version()}
    for name in packages:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


# in a peer's environment


def spread(values: Sequence[float]) -> dict[str, float]:
    """The median of repeats, and the least and the most."""
    return {"median": statistics.median(values), "low": min(values), "high": max(values)}


def repeated(work: Callable[[], float], repeats: int = REPEATS) -> dict[str, float]:
    """The spread of what some repeats give, after one that does not count."""
    return spread([work() for _ in range(repeats + 1)][1:])


def answer_as_worker(peer: Peer, figures: Mapping[str, Callable[[], Mapping[str, Any]]]) -> None:
    """Measure the figure named behind `--worker` and print it as one line of JSON."""
    try:
        answer = {**figures[sys.argv[-1]](), "versions": versions_of(peer.packages)}
    except PeerError as error:
        answer = {"error": str(error)}
    print(json.dumps(answer))
