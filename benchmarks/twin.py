"""How long a twin takes for a trial of 100 commands of 0.5 s: seconds of a processor, the least of several.

`python benchmarks/twin.py` measures the families close, slippery and alien;
`python benchmarks/twin.py worn --repeats 20` another one.
"""

from __future__ import annotations

import argparse
import time

from realitygap.playback import wander
from realitygap.robots.twin import TwinRobot, sample_twin
from realitygap.world import paper_arena

N_STEPS = 100


def trial_s(robot: TwinRobot, number: int) -> float:
    """Processor time of trial `number` [s]."""
    robot.number = number
    began = time.process_time()
    robot.reset()
    for step in range(N_STEPS):
        robot.drive(wander(robot.observe(), step))
    return time.process_time() - began


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("families", nargs="*", default=["close", "slippery", "alien"], metavar="FAMILY")
    parser.add_argument("--repeats", type=int, default=10)
    options = parser.parse_args()
    for family in options.families:
        robot = TwinRobot(sample_twin(family, 1), paper_arena())
        trial_s(robot, 0)
        times = sorted(trial_s(robot, number) for number in range(1, options.repeats + 1))
        print(f"{family:9s} {times[0]:.3f} s a trial (median {times[len(times) // 2]:.3f} s)")


if __name__ == "__main__":
    main()
