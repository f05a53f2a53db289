"""The paper's study in five lines.

Nine conditions, twenty runs of each, best coverage by generation: every run is a line, the median is drawn with its
95 % interval. The paper had three runs of three conditions.
"""

import sys

import realitygap
from realitygap.report import draw_coverage, save_drawing

study = realitygap.run_study("paper", "results/paper", replicates=20)
print(realitygap.summarize(study.folder))
save_drawing(draw_coverage(study.folder), sys.argv[1] if len(sys.argv) > 1 else "coverage.svg")
