"""Evolve robot controllers in simulation and on a real robot, measure the gap, shrink it.

The names here are those that most people need; each is loaded when it is first used.

    import realitygap as rg

    results = rg.load_study("paper", replicates=20).run()
    print(results.best())
    results.plot().save("coverage.svg")
    gap = rg.measure_gap("sim", "jyro", controllers=str(results.path))
    print(gap.rms, gap.verdict)
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from ._version import __version__

if TYPE_CHECKING:
    from . import emulator as emulator
    from . import evolution as evolution
    from . import gap as gap
    from . import lab as lab
    from . import logs as logs
    from . import platforms as platforms
    from . import playback as playback
    from . import records as records
    from . import report as report
    from . import robots as robots
    from . import runs as runs
    from . import study as study
    from . import tasks as tasks
    from . import trials as trials
    from . import vision as vision
    from . import world as world
    from .evolution import Genome, MapElites, NearestArchive, NeatSettings, PaperArchive, Population
    from .records import ResultsFolder
    from .report import summarize, watch, write_movie, write_report
    from .runs import Condition, replay
    from .study import Study, close_gap, compare_scores, drive_study, estimate_score, load_study, run_study
    from .study import gap_between as measure_gap
    from .study import make_calibration as calibrate
    from .trials import simulate_case
    from .world import Case

_HOME = {
    "Case": "world",
    "Condition": "runs",
    "Genome": "evolution",
    "MapElites": "evolution",
    "NearestArchive": "evolution",
    "NeatSettings": "evolution",
    "PaperArchive": "evolution",
    "Population": "evolution",
    "ResultsFolder": "records",
    "Study": "study",
    "calibrate": "study:make_calibration",
    "close_gap": "study",
    "compare_scores": "study",
    "drive_study": "study",
    "estimate_score": "study",
    "load_study": "study",
    "measure_gap": "study:gap_between",
    "replay": "runs",
    "run_study": "study",
    "simulate_case": "trials",
    "summarize": "report",
    "watch": "report",
    "write_movie": "report",
    "write_report": "report",
}

__all__ = [
    "Case",
    "Condition",
    "Genome",
    "MapElites",
    "NearestArchive",
    "NeatSettings",
    "PaperArchive",
    "Population",
    "ResultsFolder",
    "Study",
    "__version__",
    "calibrate",
    "close_gap",
    "compare_scores",
    "drive_study",
    "estimate_score",
    "load_study",
    "measure_gap",
    "replay",
    "run_study",
    "simulate_case",
    "summarize",
    "watch",
    "write_movie",
    "write_report",
]


_PACKAGES = {
    "calibration",
    "classroom",
    "drawing",
    "emulator",
    "errors",
    "evolution",
    "families",
    "gap",
    "gym",
    "lab",
    "logs",
    "orders",
    "platforms",
    "playback",
    "records",
    "report",
    "robots",
    "runs",
    "study",
    "tasks",
    "trials",
    "vision",
    "world",
}


def __getattr__(name: str) -> Any:
    if name in _PACKAGES:
        return import_module(f".{name}", __name__)
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home, _, named_there = _HOME[name].partition(":")
    return getattr(import_module(f".{home}", __name__), named_there or name)


def __dir__() -> list[str]:
    return __all__
