"""`realitygap estimate`: a mean score on a robot from few trials there and many in simulation."""

from __future__ import annotations

import realitygap
from realitygap._terminal import echo
from realitygap._wording import counted
from realitygap.orders import EstimateOrder

from ._code import AllowPlatforms
from ._observer import CameraOfRobots, attending_observer, under_camera
from ._options import Json, print_json
from ._order import command_of
from ._progress import TrialsBar, resumable


@command_of(EstimateOrder)
def estimate(
    order: EstimateOrder,
    camera: CameraOfRobots = None,
    allow_code: AllowPlatforms = False,
    as_json: Json = False,
) -> None:
    """Estimate, and print both intervals."""
    arena = realitygap.world.load_arena(order.arena or "paper")
    observer = attending_observer(order.target, order.witness)
    with (
        resumable(order.results, "" if order.results else "To save trials, add -o FILE."),
        TrialsBar(quiet=as_json) as bar,
        under_camera(camera, arena, observer) as seen_by,
    ):
        found = realitygap.study.estimate_score(
            order, observer=seen_by, allow_code=allow_code, tell=bar.show, say=bar.say
        )
    if as_json:
        print_json(found.to_dict() | {"order": order.record()})
        return
    echo(found.title)
    echo(found.verdict)
    for name, words in found.rows:
        echo(f"  {name:19}{words}")
    sides = (
        f"{side.label}: {counted(side.n, 'controller')} with {counted(side.trials, 'trial')} each"
        for side in (found.target, found.source)
    )
    echo(f"{'; '.join(sides)}; {100 * found.assisted.estimate.level:g} % intervals")
    for note in found.notes:
        echo(note)
