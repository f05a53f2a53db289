"""The command line with a fake robot at any port; each argument is the command's."""

import sys

from realitygap.cli import main
from realitygap.study import _run as run
from tests.trials.fake_robot import FakeRobot

STUDY = """
[study]
name = "small"
replicates = 1

[neat]
population = 2
generations = 1

[trials]
pens = ["red", "blue"]

[platform.scribbler]
steps = 3

[[condition]]
name = "robot"
platform = "scribbler"
"""
"""Of two trials of three steps."""


def open_fake(port, arena=None):
    def open_robot(platform):
        robot = FakeRobot(platform.wait_s)
        robot.label = "REAL" if port == "real" else "EMULATED"
        return robot

    return open_robot


if __name__ == "__main__":
    run.connect_robot = open_fake
    sys.argv = ["realitygap", *sys.argv[1:]]
    main()
