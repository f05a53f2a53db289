"""How many robot-steps a second real Jyro 0.3.2 makes, beside `realitygap bench`.

    python benchmarks/jyro_peer.py [--json] [--fresh]

Timed is the paper's trial and nothing else: a Scribbler with three range sensors in an arena of 42 x 24
inches, 87 steps, a tanh network of three inputs, headless (`Physics.step`, no drawing), one thread. The
median of five repeats counts, each of 115 trials (10,005 steps), after one that is not counted.

Jyro runs in an environment of its own, which the first call builds in the cache folder (`--fresh` builds it
anew): `jyro==0.3.2` and `numpy`, by uv where it is there and by venv and pip otherwise. Jyro also needs the
system library cairo. `realitygap` is measured by its own command, in the environment that runs this file.
"""

from __future__ import annotations

import argparse
import json
import math
import operator
import os
import platform
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

REQUIREMENTS = ["jyro==0.3.2", "numpy"]
STEPS = 87
TRIALS = 115
REPEATS = 5
INCH = 0.0254
NO_CAIRO = (
    "Jyro needs the system library cairo, which is not here. "
    "Install it (Debian, Ubuntu: apt-get install libcairo2; macOS: brew install cairo), then run this again."
)


class PeerError(Exception):
    """Jyro could not be built or run; the text says why."""


# --- in Jyro's environment ----------------------------------------------------------------------------------


def time_jyro() -> dict[str, Any]:
    """Steps per second of the paper's trial; runs where Jyro is installed."""
    from importlib.metadata import version

    try:
        from jyro.simulator import Physics, RangeSensor, Scribbler
    except OSError as error:  # cairo is looked for at import
        raise PeerError(f"{NO_CAIRO} ({str(error).splitlines()[0]})") from error

    physics = Physics()
    physics.addBox(0.0, 0.0, 42 * INCH, 24 * INCH)
    robot = Scribbler("robot", 7.5 * INCH, 7.5 * INCH, -math.pi / 2)
    robot.addDevice(RangeSensor("ir", ((0.09, 0.05, 0.0), (0.09, 0.0, 0.0), (0.09, -0.05, 0.0)), 0.0, 0.2))
    robot.display["devices"] = 0  # rays are not drawn
    physics.addRobot(robot)
    seconds = [_time_trials(physics, robot) for _ in range(REPEATS + 1)][1:]
    rates = [TRIALS * STEPS / each for each in seconds]
    return {
        "robot_steps_per_second": statistics.median(rates),
        "slowest": min(rates),
        "fastest": max(rates),
        "python": platform.python_version(),
        "numpy": version("numpy"),
        "jyro": version("jyro"),
    }


def _time_trials(physics: Any, robot: Any) -> float:
    """Seconds that all trials of one repeat take."""
    weights = ((-1.2, -2.0, 0.3, 0.35), (2.5, 1.0, -0.5, 0.1))  # nearness, stall, time, bias
    sensors = robot["ir"]
    began = time.perf_counter()
    for _ in range(TRIALS):
        physics.reset()
        for step in range(STEPS):
            nearness = max((0.2 - reading) / 0.2 for reading in sensors.scan)
            inputs = (nearness, robot.stall, step / STEPS, 1.0)
            robot.move(*(math.tanh(sum(map(operator.mul, row, inputs))) for row in weights))
            physics.step(run_brain=False)
    return time.perf_counter() - began


# --- in ours ------------------------------------------------------------------------------------------------


def cache_folder() -> Path:
    """Where the environment is kept: `REALITYGAP_CACHE`, the user's cache folder, or the temporary one."""
    named = os.environ.get("REALITYGAP_CACHE")
    folder = Path(named) if named else Path.home() / ".cache" / "realitygap"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        folder = Path(tempfile.gettempdir()) / "realitygap"
        folder.mkdir(parents=True, exist_ok=True)
    return folder / f"jyro-0.3.2-python{sys.version_info.major}.{sys.version_info.minor}"


def build_environment(folder: Path, *, fresh: bool) -> Path:
    """The interpreter of Jyro's environment, built when it is not there yet."""
    inside = "Scripts/python.exe" if sys.platform == "win32" else "bin/python"
    python = folder / inside
    done = folder / "complete"
    if fresh or not done.exists():
        shutil.rmtree(folder, ignore_errors=True)
        print(f"Building an environment for Jyro in {folder} ...", file=sys.stderr)
        if shutil.which("uv"):
            _run(["uv", "venv", "--quiet", "--python", sys.executable, str(folder)])
            _run(["uv", "pip", "install", "--quiet", "--python", str(python), *REQUIREMENTS])
        else:
            _run([sys.executable, "-m", "venv", str(folder)])
            _run([str(python), "-m", "pip", "install", "--quiet", *REQUIREMENTS])
        done.touch()
    return python


def _run(command: list[str]) -> str:
    """What a command prints; `PeerError` with what it said when it fails."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except OSError as error:
        raise PeerError(f"{command[0]} could not be started: {error}") from error
    if done.returncode:
        said = (done.stderr or done.stdout).strip().splitlines()[-5:]
        raise PeerError(f"{' '.join(command[:4])} ... failed:\n" + "\n".join(said))
    return done.stdout


def measure_peer(*, fresh: bool) -> dict[str, Any]:
    """Jyro's rate, its spread and its versions."""
    python = build_environment(cache_folder(), fresh=fresh)
    answer: dict[str, Any] = json.loads(_run([str(python), __file__, "--worker"]))
    if "error" in answer:
        raise PeerError(answer["error"])
    return answer


def measure_ours() -> tuple[dict[str, float], str]:
    """Rates of `realitygap bench --json`, and why they are missing where they are."""
    script = Path(sys.executable).with_name("realitygap.exe" if sys.platform == "win32" else "realitygap")
    command = [str(script) if script.exists() else "realitygap", "bench", "--json"]
    try:
        rates = json.loads(_run(command))["robot_steps_per_second"]
        return {"per_core": float(rates["per_core"]), "all_cores": float(rates["all_cores"])}, ""
    except PeerError as error:
        return {}, str(error).splitlines()[-1]
    except (ValueError, KeyError, TypeError) as error:
        return {}, f"`{' '.join(command)}` printed no robot_steps_per_second ({error!r})"


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


def ours_versions() -> dict[str, str]:
    """Versions of what `realitygap bench` used."""
    from importlib.metadata import PackageNotFoundError, version

    found = {"python": platform.python_version()}
    for name in ("realitygap", "numba", "numpy"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def report(peer: dict[str, Any], ours: dict[str, float], missing: str) -> dict[str, Any]:
    """Everything measured, ratios first."""
    theirs = peer["robot_steps_per_second"]
    return {
        "ratio": {name: rate / theirs for name, rate in ours.items()},
        "robot_steps_per_second": {**ours, "jyro": theirs},
        "jyro": peer,
        "realitygap": ours_versions(),
        "machine": machine(),
        "note": f"realitygap bench is unavailable, so Jyro stands alone: {missing}" if missing else "",
    }


def print_report(result: dict[str, Any]) -> None:
    """The report for people."""
    jyro, rates = result["jyro"], result["robot_steps_per_second"]
    print(f"The paper's trial, {STEPS} steps, 3 range sensors, tanh network: robot-steps per second\n")
    for name, ratio in result["ratio"].items():
        print(f"  {name.replace('_', ' '):9}  {ratio:9,.0f} times Jyro   {rates[name]:14,.0f}")
    print(
        f"  Jyro       {'':21}  {rates['jyro']:14,.0f}   "
        f"(median of {REPEATS}, {jyro['slowest']:,.0f} to {jyro['fastest']:,.0f}; it uses one core)"
    )
    if result["note"]:
        print(f"\n{result['note']}")
    about = result["machine"]
    print(f"\nMachine: {about['cpu']}, {about['cores']} cores, {about['system']}")
    print("Jyro: " + ", ".join(f"{name} {jyro[name]}" for name in ("jyro", "python", "numpy")))
    print("Ours: " + ", ".join(f"{name} {version}" for name, version in result["realitygap"].items()))


def main() -> int:
    """Measure, print, and say in one message what went wrong."""
    parser = argparse.ArgumentParser(description="Real Jyro 0.3.2 beside realitygap: robot-steps per second.")
    parser.add_argument("--json", action="store_true", help="print data instead of a table")
    parser.add_argument("--fresh", action="store_true", help="build Jyro's environment anew")
    parser.add_argument("--worker", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        try:
            print(json.dumps(time_jyro()))
        except PeerError as error:
            print(json.dumps({"error": str(error)}))
        return 0
    try:
        peer = measure_peer(fresh=options.fresh)
    except PeerError as error:
        print(error, file=sys.stderr)
        return 1
    result = report(peer, *measure_ours())
    if options.json:
        print(json.dumps(result, indent=2))
    else:
        print_report(result)
    return 0


if __name__ == "__main__":
    sys.exit(main())
