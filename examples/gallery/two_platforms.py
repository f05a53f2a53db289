"""One network, two simulators: the gap before there is a robot.

The best network of a typical run in the paper's simulator, tried thirty times there and thirty times in `sim`, which
has the Scribbler's real outline, wheels, sensors and the half second that a command takes over Bluetooth. Below, how
far the two come apart; thin lines show how far repeats on one platform do, which is what noise alone does.
"""

import sys

import realitygap
from realitygap.report import save_divergence

study = realitygap.run_study("paper", "results/paper", replicates=20)
picture = sys.argv[1] if len(sys.argv) > 1 else "divergence.svg"
save_divergence(study.folder, picture, condition="novelty-50", against="sim")
