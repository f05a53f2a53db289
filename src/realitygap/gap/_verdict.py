"""A gap in one sentence."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ._estimate import Estimate

if TYPE_CHECKING:
    from ._result import GapResult


def verdict_of(result: GapResult) -> str:
    """What was found, in one sentence, with what n cannot carry left out."""
    parts = [_size(result), _order(result), _equivalence(result.equivalence)]
    if result.misspecified:
        parts.append("the simulator cannot make what was observed, whatever its numbers")
    where = f"Between {result.labels[0]} {result.source} and {result.labels[1]} {result.target}"
    return f"{where}, " + "; ".join(part for part in parts if part) + "."


def _size(result: GapResult) -> str:
    rms, level = result.rms, result.level
    if rms.estimate is None:
        return "the size of the gap cannot be told" + _side_if_any(level)
    if rms.high is None:
        return f"the transfer gap is {rms.estimate:.3f} RMS, of too few controllers to say how sure that is"
    if not result.excludes_no_gap:
        return f"no gap is shown (RMS at most {rms.high:.3f})"
    side = _side(level)
    return f"the transfer gap is {rms} RMS over {rms.n} controllers{side}"


def _side_if_any(level: Estimate) -> str:
    side = _side(level)
    return "" if side.endswith("both sides") else side


def _side(level: Estimate) -> str:
    if level.estimate is None or level.low is None or level.high is None:
        return ""
    if level.high < 0:
        return f", and the target does worse by {-level.estimate:.3f}"
    if level.low > 0:
        return f", and the target does better by {level.estimate:.3f}"
    return ", to both sides"


def _order(result: GapResult) -> str:
    raw, ceiling = result.srcc, result.noise_ceiling
    if raw.estimate is None:
        return ""
    if ceiling.estimate is None or result.srcc_disattenuated.estimate is None:
        return f"the correlation over controllers is {raw.estimate:.2f}"
    return f"the correlation over controllers is {raw.estimate:.2f} where noise allows {ceiling.estimate:.2f}"


def _equivalence(found: Estimate) -> str:
    margin = found.more.get("margin")
    if margin is None or found.more.get("equivalent") is None:
        return ""
    shown = (
        "are equivalent in level" if found.more["equivalent"] else "are not shown to be equivalent in level"
    )
    return f"they {shown} at a margin of {margin:g}"
