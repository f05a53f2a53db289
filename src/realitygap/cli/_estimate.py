"""`realitygap estimate`: a mean score on a robot from few trials there and many in simulation."""

from __future__ import annotations

import realitygap
from realitygap.orders import EstimateOrder

from ._code import AllowPlatforms
from ._observer import CameraOfRobots, measuring
from ._options import Json, print_json
from ._order import command_of
from ._results import print_finding


@command_of(EstimateOrder)
def estimate(
    order: EstimateOrder,
    camera: CameraOfRobots = None,
    allow_code: AllowPlatforms = False,
    as_json: Json = False,
) -> None:
    """Estimate, and print both intervals."""
    if order.is_of_table:
        found = realitygap.study.estimate_score(order)
    else:
        with measuring(order, camera, quiet=as_json) as how:
            found = realitygap.study.estimate_score(order, allow_code=allow_code, **how)
    if as_json:
        print_json(found.to_dict() | {"order": order.record()})
        return
    basis = f"{found.basis}; {100 * found.assisted.real_only.level:g} % intervals"
    print_finding(found.title, found.verdict, found.rows, basis, *found.notes)
