"""The rows of the summary of `closing-the-gap`, as its file has them."""

from __future__ import annotations

from typing import Any, NotRequired, TypedDict


class NumberRow(TypedDict):
    """A number with the ends of its 95 % interval; None for what is unknown."""

    estimate: float | None
    low: float | None
    high: float | None


class OrderRow(TypedDict):
    """Numbers of a gap on the order of controllers, and its level; `mmrv_ratio` is MMRV over its floor."""

    srcc: float | None
    srcc_disattenuated: float | None
    mmrv: float | None
    mmrv_floor: float | None
    level: float | None
    mmrv_ratio: float | None


class MeansRow(TypedDict):
    """Mean coverage of each held-out controller in simulation, and on the twin."""

    source: list[float]
    target: list[float]


class GapRow(TypedDict):
    """A gap over the held-out controllers: RMS, order, means, and the RMS gap of each kind of controllers."""

    rms: NumberRow
    gap: OrderRow
    means: MeansRow
    parts: dict[str, NumberRow]


class CalibratedRow(GapRow):
    """The gap of a twin after one calibration, its fall, and the checks of the fit.

    Attributes:
        observe: Observation level of the calibration.
        budget: Its number of trials.
        rms_point: RMS gap with the estimate.
        rms_draws: RMS gap with draws from the posterior.
        recommended: Numbers that the calibration recommends.
        fall: Share by which the RMS gap falls.
        misspecified: Verdict of the predictive check.
        misspecification_p: Its p.
        at_prior_end: Numbers at an end of their range.
    """

    observe: str
    budget: int
    rms_point: NumberRow
    rms_draws: NumberRow | None
    recommended: str
    fall: float | None
    misspecified: bool
    misspecification_p: float
    at_prior_end: list[str]


class MeanRow(TypedDict):
    """A mean of some values with the ends of its 95 % interval."""

    estimate: float
    low: float | None
    high: float | None


class TransferRow(TypedDict):
    """The quality of a strategy of transfer on a twin."""

    strategy: str
    quality: MeanRow


class TwinRow(GapRow):
    """A twin with the uncalibrated simulator, and after each calibration; `counts` if goals are about it."""

    twin: str
    family: str
    standard_error: float | None
    counts: bool
    stalled: list[float]
    calibrated: list[CalibratedRow]
    transfer: NotRequired[list[TransferRow]]
    seconds: NotRequired[float]


class FamilyGapRow(TypedDict):
    """Median RMS gap of a family, and its median fall, by observation level and budget."""

    family: str
    observe: str
    budget: int
    n: int
    rms: NumberRow
    n_counted: int
    fall: NumberRow


class StrategyRow(NumberRow):
    """Mean quality on the twins of a strategy of transfer."""

    strategy: str
    n: int


class MissRow(TypedDict):
    """A twin that misses a goal, with its figure, and the checks of its calibration if the goal is about one."""

    twin: str
    family: str
    figure: float
    rms_before: NotRequired[float | None]
    rms_after: NotRequired[float | None]
    misspecified: NotRequired[bool]
    misspecification_p: NotRequired[float]
    at_prior_end: NotRequired[list[str]]


class UnknownRow(TypedDict):
    """A twin by which a goal cannot be judged, and why."""

    twin: str
    why: str


class GoalRow(TypedDict):
    """A goal with its figure, its interval over twins, and its verdict as `is_met` returns it."""

    name: str
    figure: float | None
    low: float | None
    high: float | None
    n: int
    unknown: list[UnknownRow]
    goal: float
    sense: str
    met: bool | None
    why: list[MissRow]


class ClosingSummary(TypedDict):
    """The summary of the study; the plan is that of its folder."""

    study: str
    software: str
    plan: dict[str, Any]
    label: str
    budget: int
    n_done: int
    n_units: int
    n_counted: int
    twins: list[TwinRow]
    families: list[FamilyGapRow]
    strategies: list[StrategyRow]
    goals: list[GoalRow]
