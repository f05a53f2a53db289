"""What the paper's distance weighs.

Novelty compares sorted lists of cells place by place, so a cell early in the list shifts all that follow: the map shows
how far one more cell moves a behavior, the other panel that the distance is mostly one between lengths.
"""

import sys

from realitygap.report import audit_distance, distance_notes, save_distance

audit = audit_distance("paper", n_walks=400, n_pairs=400)
print("\n".join(distance_notes(audit)))
save_distance(audit, sys.argv[1] if len(sys.argv) > 1 else "leverage.svg")
