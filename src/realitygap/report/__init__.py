"""From the results of a study to a table, figures and one page that needs no other file.

Only records are read; nothing here runs a study. Trials that are drawn are recomputed one by one.
`write_report` makes the whole page, `summarize` its main table as a frame, and each `draw_...` one figure as
SVG with the caption that says what was drawn.
"""

from realitygap.report._agreement import Agreement, measure_agreement
from realitygap.report._arena_figure import draw_arena_and_robot
from realitygap.report._audit import (
    Audit,
    AuditedCondition,
    AuditedPair,
    AuditProgress,
    DoubtfulValue,
    audit_notes,
    audit_results,
)
from realitygap.report._champions import Champions, retry_champions
from realitygap.report._choices_figure import Choice, compare_choices, draw_choices
from realitygap.report._comparisons import Comparison, compare_conditions
from realitygap.report._coverage_figure import draw_coverage
from realitygap.report._distance_audit import (
    Confound,
    DistanceAudit,
    Estimate,
    audit_distance,
    distance_notes,
)
from realitygap.report._distance_figure import draw_distance, save_distance
from realitygap.report._divergence_figure import Side, compare_trials, draw_divergence, save_divergence
from realitygap.report._drawing import NARROW, WIDE, Drawing
from realitygap.report._effects import (
    Interval,
    a12,
    bca_interval,
    detectable_effect,
    newcombe_interval,
    runs_needed,
)
from realitygap.report._formats import save_drawing, save_picture
from realitygap.report._frame_file import export_frame
from realitygap.report._gap_maps_figure import draw_gap_maps
from realitygap.report._gap_order_figure import draw_gap_differences, draw_gap_pairs
from realitygap.report._gap_page import refuse_gap_page, write_gap_report
from realitygap.report._gap_replay_figure import draw_gap_replay
from realitygap.report._gap_why_figure import draw_gap_why
from realitygap.report._individual_file import export_individual
from realitygap.report._individuals_figure import draw_better_individuals, draw_individuals
from realitygap.report._lineage_figure import draw_lineage
from realitygap.report._motion import Each, choose_moving, watch, write_movie
from realitygap.report._networks_figure import draw_networks
from realitygap.report._page import REPORT_NAME, write_report
from realitygap.report._paper_audit import Finding, audit_paper
from realitygap.report._path_figure import draw_paths
from realitygap.report._permutation import (
    holm,
    permutation_p,
    runs_for_a_claim,
    sign_flip_p,
    smallest_p,
)
from realitygap.report._questions import Variety, chance_of_best, measure_variety
from realitygap.report._show import save_arena, save_robot, save_view
from realitygap.report._species_figure import draw_species
from realitygap.report._statistics import (
    IntervalRanks,
    MedianInterval,
    Quartiles,
    interval_ranks,
    median_interval,
    quartiles,
)
from realitygap.report._summary import SUMMARY_SCHEMA, summarize
from realitygap.report._task_summary import TASK_SCHEMA, summarize_tasks
from realitygap.report._trial_figure import draw_trial

__all__ = [  # noqa: RUF022 - grouped by subject
    # the page
    "write_report",
    "REPORT_NAME",
    # the gap between two platforms
    "write_gap_report",
    "refuse_gap_page",
    "draw_gap_pairs",
    "draw_gap_differences",
    "draw_gap_maps",
    "draw_gap_replay",
    "draw_gap_why",
    # numbers
    "summarize",
    "summarize_tasks",
    "SUMMARY_SCHEMA",
    "TASK_SCHEMA",
    "compare_choices",
    "Choice",
    "compare_conditions",
    "Comparison",
    "retry_champions",
    "Champions",
    "measure_variety",
    "Variety",
    "measure_agreement",
    "Agreement",
    # small tables of anyone's
    "audit_results",
    "audit_notes",
    "Audit",
    "AuditedCondition",
    "AuditedPair",
    "AuditProgress",
    "DoubtfulValue",
    "audit_paper",
    "Finding",
    # distances of behaviors
    "audit_distance",
    "distance_notes",
    "DistanceAudit",
    "Confound",
    "Estimate",
    "draw_distance",
    "save_distance",
    # figures
    "draw_coverage",
    "draw_paths",
    "draw_arena_and_robot",
    "draw_individuals",
    "draw_better_individuals",
    "draw_networks",
    "draw_species",
    "draw_lineage",
    "draw_trial",
    "draw_choices",
    "Drawing",
    "save_drawing",
    "save_picture",
    "save_view",
    "save_arena",
    "save_robot",
    # two platforms
    "compare_trials",
    "Side",
    "draw_divergence",
    "save_divergence",
    # in motion
    "write_movie",
    "watch",
    "choose_moving",
    "Each",
    # for other programs
    "export_individual",
    "export_frame",
    "WIDE",
    "NARROW",
    # statistics
    "quartiles",
    "Quartiles",
    "median_interval",
    "MedianInterval",
    "interval_ranks",
    "IntervalRanks",
    "sign_flip_p",
    "permutation_p",
    "smallest_p",
    "runs_for_a_claim",
    "holm",
    "a12",
    "bca_interval",
    "newcombe_interval",
    "Interval",
    "runs_needed",
    "detectable_effect",
    "chance_of_best",
]
