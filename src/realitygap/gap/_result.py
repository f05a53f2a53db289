"""All measures of a gap together."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Any

from ._estimate import Estimate

MEASURES = (
    *("rms", "level", "srcc", "srcc_disattenuated", "noise_ceiling", "mmrv", "mmrv_floor", "energy"),
    "equivalence",
)
"""What `--json` gives, each with estimate, low, high and n."""


@dataclass(frozen=True)
class GapResult:
    """How far two platforms are apart: the transfer gap, of the same controllers on both.

    Differences are target less simulator: below 0 where the target does worse than the simulator says.

    Attributes:
        source: Name of the simulator.
        target: Name of the target.
        labels: Of both: SIM, TWIN, EMULATED or REAL.
        trials: Of each controller on both.
        rms: Root mean square over controllers of the difference of means, the variance of noise taken out.
        level: Mean over controllers of the difference of means.
        a12: How likely a trial on the target is above one of the same controller in simulation.
        srcc: Spearman's correlation of means over controllers.
        srcc_disattenuated: The same, over the noise ceiling.
        noise_ceiling: The correlation that noise alone leaves of a perfect one.
        mmrv: Mean maximum rank violation of the simulator's order, in units of the target's quality.
        mmrv_floor: That of one half of the target's trials by the other half.
        energy: Energy distance of behaviors (visited cells), mean over controllers; `more` has its p.
        equivalence: The level with the 90 % interval of TOST; `more` has margin, p and whether they are equivalent.
        energy_ends: Energy distance of the places where trials end [m]; refused where nobody saw them.
        misspecified: Whether the simulator cannot make what was observed; None where nobody checked.
        luck: What champions lose on fresh seeds where they were selected; refused where none was selected.
        reevolved: Champions evolved and tried on the target less champions evolved and tried in simulation; refused
            where none were.
        notes: What else there is to say.
    """

    source: str
    target: str
    labels: tuple[str, str]
    trials: tuple[int, int]
    rms: Estimate
    level: Estimate
    a12: Estimate
    srcc: Estimate
    srcc_disattenuated: Estimate
    noise_ceiling: Estimate
    mmrv: Estimate
    mmrv_floor: Estimate
    energy: Estimate
    equivalence: Estimate
    energy_ends: Estimate
    misspecified: bool | None = None
    luck: Estimate = field(default_factory=lambda: Estimate.refusal(0, "No controller was selected."))
    reevolved: Estimate = field(default_factory=lambda: Estimate.refusal(0, "Nothing was evolved apart."))
    notes: tuple[str, ...] = ()

    @property
    def excludes_no_gap(self) -> bool:
        """Whether the interval of the RMS gap begins above 0."""
        return self.rms.low is not None and self.rms.low > 0

    @property
    def verdict(self) -> str:
        """The whole in one sentence."""
        from ._verdict import verdict_of

        return verdict_of(self)

    def to_dict(self) -> dict[str, Any]:
        """The measures, `misspecified` and `verdict`; beside them, what they are of."""
        named = {name: getattr(self, name).to_dict() for name in MEASURES}
        about = {
            "source": self.source,
            "target": self.target,
            "labels": list(self.labels),
            "trials": list(self.trials),
        }
        others = {name: getattr(self, name).to_dict() for name in ("a12", "energy_ends", "luck", "reevolved")}
        return (
            named
            | {"misspecified": self.misspecified, "verdict": self.verdict}
            | others
            | {"notes": list(self.notes)}
            | about
        )

    def to_json(self) -> str:
        """As text."""
        return json.dumps(self.to_dict(), indent=2)
