"""The card of a calibration, for notebooks."""

from __future__ import annotations

from realitygap.drawing import Bar, Card, Table, card_of

from ._calibration import Calibration, Fitted


@card_of.register(Calibration)
def calibration_card(calibration: Calibration) -> Card:
    """Return the parameters, with their intervals in the range of the prior, and the origin of the numbers."""
    n_identified = sum(each.identified for each in calibration.fitted)
    warning = ""
    if calibration.misspecified:
        warning = (
            f"Rejected: the simulator cannot reproduce this robot (p = {calibration.misspecification_p:.2g}). Don't "
            "use this calibration for conclusions."
        )
    elif calibration.recommended == "nominal numbers":
        warning = "The numbers that this calibration started from predict held-out trials better."
    rows: list[list[str | Bar]] = [
        [
            f"{each.name} [{each.unit}]" if each.unit else each.name,
            *each.shown,
            _bar(each),
            "yes" if each.identified else f"no. {each.advice}",
        ]
        for each in calibration.fitted
    ]
    origin = {
        "built on": calibration.robot,
        "observed": calibration.observe,
        "arena": calibration.arena,
        "date": calibration.date,
        "seed": str(calibration.seed),
        "draws": f"{calibration.n_draws:,}",
        "software": calibration.software,
        "method": calibration.method,
    }
    about = [[key, value] for key, value in origin.items() if value]
    return Card(
        f"Calibration ({calibration.kind}) of {calibration.target}",
        [calibration.label],
        f"{n_identified} of {len(rows)} parameters identified from {calibration.trials:,} trials",
        warning,
        parts=[
            Table(
                ["parameter", "estimate", "90 % interval", "in the range thought possible", "identified"],
                rows,
            ),
            Table(["", ""], about, "Origin", closed=True),
            *calibration.remarks,
        ],
    )


def _bar(fitted: Fitted) -> Bar:
    start, end = min(fitted.prior_low, fitted.low), max(fitted.prior_high, fitted.high)
    return Bar(fitted.estimate, fitted.low, fitted.high, start, end)
