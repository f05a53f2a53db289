"""How many robot-steps a second real Jyro 0.3.2 makes, beside ours called from Python (`try_genomes`).

    python benchmarks/jyro_peer.py [--json] [--fresh]

Timed is the paper's trial and nothing else: a Scribbler with three range sensors in an arena of 42 x 24
inches, 87 steps, a tanh network of three inputs, headless (`Physics.step`, no drawing), one thread. The
median of five repeats counts, each of 115 trials (10,005 steps), after one that is not counted.

Jyro runs in an environment of its own, which the first call builds in the cache folder (`--fresh` builds it
anew): `jyro==0.3.2` and `numpy`, by uv where it is there and by venv and pip otherwise. Jyro also needs the
system library cairo. `realitygap` is measured in the environment that runs this file.
"""

from __future__ import annotations

import argparse
import json
import math
import operator
import sys
import time
from typing import Any

import ours
import work
from environments import Peer, PeerError, answer_as_worker, build_environment, machine, measure, repeated

PEER = Peer(
    name="jyro",
    title="Jyro",
    requirements=("jyro==0.3.2", "numpy"),
    packages=("jyro", "numpy"),
    figures=("steps_core",),
)
STEPS = 87
TRIALS = 115
INCH = 0.0254
NO_CAIRO = (
    "Jyro needs the system library cairo, which is not here. "
    "Install it (Debian, Ubuntu: apt-get install libcairo2; macOS: brew install cairo), then run this again."
)


def time_steps() -> dict[str, Any]:
    """Steps per second of the paper's trial; runs where Jyro is installed."""
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
    return repeated(lambda: TRIALS * STEPS / _time_trials(physics, robot))


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


def compare(*, fresh: bool) -> dict[str, Any]:
    """Everything measured, ratios first; Jyro stands alone where ours cannot be measured."""
    theirs = measure(PEER, build_environment(PEER, fresh=fresh), "steps_core")
    rates, versions, missing = {}, {}, ""
    for name, figure in (("per_core", "steps_core"), ("all_cores", "steps_all")):
        try:
            answer = measure(ours.PEER, build_environment(ours.PEER, fresh=False), figure)
        except PeerError as error:
            missing = str(error).splitlines()[-1]
            break
        rates[name], versions = answer["median"], answer["versions"]
    return {
        "ratio": {name: rate / theirs["median"] for name, rate in rates.items()},
        "robot_steps_per_second": {**rates, "jyro": theirs["median"]},
        "jyro": {"slowest": theirs["low"], "fastest": theirs["high"], **theirs["versions"]},
        "realitygap": versions,
        "machine": machine(),
        "note": f"realitygap could not be measured, so Jyro stands alone: {missing}" if missing else "",
    }


def print_report(result: dict[str, Any]) -> None:
    """The report for people."""
    jyro, rates = result["jyro"], result["robot_steps_per_second"]
    print(f"The paper's trial, {STEPS} steps, 3 range sensors, tanh network: robot-steps per second\n")
    for name, ratio in result["ratio"].items():
        print(f"  {name.replace('_', ' '):9}  {ratio:9,.0f} times Jyro   {rates[name]:14,.0f}")
    print(
        f"  Jyro       {'':21}  {rates['jyro']:14,.0f}   "
        f"(median of {work.REPEATS}, {jyro['slowest']:,.0f} to {jyro['fastest']:,.0f}; it uses one core)"
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
    options = parser.parse_args()
    try:
        result = compare(fresh=options.fresh)
    except PeerError as error:
        print(error, file=sys.stderr)
        return 1
    if options.json:
        print(json.dumps(result, indent=2))
    else:
        print_report(result)
    return 0


if __name__ == "__main__":
    if "--worker" in sys.argv:
        answer_as_worker(PEER, {"steps_core": time_steps})
    else:
        sys.exit(main())
