"""From the results of a study to a table, figures and one page that needs no other file.

Only records are read; nothing here runs a study. Trials that are drawn are recomputed one by one.
`write_report` makes the whole page, `summarize` its main table as a frame, and each `draw_...` one figure as
SVG with the caption that says what was drawn.
"""

from realitygap.report._choices_figure import Choice, compare_choices, draw_choices
from realitygap.report._coverage_figure import draw_coverage
from realitygap.report._drawing import NARROW, WIDE, Drawing
from realitygap.report._page import REPORT_NAME, write_report
from realitygap.report._path_figure import draw_paths
from realitygap.report._statistics import (
    IntervalRanks,
    MedianInterval,
    Quartiles,
    interval_ranks,
    median_interval,
    quartiles,
)
from realitygap.report._summary import SUMMARY_SCHEMA, summarize

__all__ = [  # noqa: RUF022 - grouped by subject
    # the page
    "write_report",
    "REPORT_NAME",
    # numbers
    "summarize",
    "SUMMARY_SCHEMA",
    "compare_choices",
    "Choice",
    # figures
    "draw_coverage",
    "draw_paths",
    "draw_choices",
    "Drawing",
    "WIDE",
    "NARROW",
    # statistics
    "quartiles",
    "Quartiles",
    "median_interval",
    "MedianInterval",
    "interval_ranks",
    "IntervalRanks",
]
