"""Tables, figures, and one page that needs no other file, from the results of a study.

Only records are read; nothing here runs a study. Trials that are drawn are recomputed one by one.
`write_report` makes the whole page, `summarize` its main table as a frame, and each `draw_...` one figure as
SVG with the caption that says what was drawn.
"""

from realitygap.report._agreement import measure_agreement
from realitygap.report._archive_figure import draw_archive
from realitygap.report._audit import Audit, AuditProgress, audit_notes, audit_results
from realitygap.report._choices_figure import compare_choices, draw_choices
from realitygap.report._chosen_run import choose_run
from realitygap.report._compare_page import write_compared_scores
from realitygap.report._comparisons import compare_conditions
from realitygap.report._distance_audit import DistanceAudit, audit_distance, distance_notes
from realitygap.report._distance_figure import draw_distance, save_distance
from realitygap.report._divergence_figure import compare_trials, save_divergence
from realitygap.report._elites_figure import EliteMaps, draw_elites, elite_maps
from realitygap.report._files import export_frame, export_individual
from realitygap.report._formats import check_ending, save_drawing
from realitygap.report._gap_figures import draw_gap_pairs
from realitygap.report._gap_page import refuse_gap_page, write_closed_gap, write_gap_report
from realitygap.report._generations_figure import draw_best, draw_coverage, draw_scores
from realitygap.report._individuals_figure import draw_individuals
from realitygap.report._lineage_figure import draw_lineage
from realitygap.report._motion import Each, choose_moving, touch_network, watch, write_movie
from realitygap.report._networks_figure import draw_networks
from realitygap.report._page import write_report
from realitygap.report._path_figure import draw_paths
from realitygap.report._questions import measure_variety
from realitygap.report._sensor_figure import save_sensor_figure
from realitygap.report._show import Subject, save_arena, save_robot, save_twin, save_view
from realitygap.report._species_figure import draw_species
from realitygap.report._summary import summarize, summarize_tasks
from realitygap.report._table import TableOnPage
from realitygap.report._tally import Tally, read_tally
from realitygap.report._trial_figure import best_trials, choose_trial, draw_trial
from realitygap.report.charts.house import NARROW, Drawing

__all__ = [
    "NARROW",
    "Audit",
    "AuditProgress",
    "DistanceAudit",
    "Drawing",
    "Each",
    "EliteMaps",
    "Subject",
    "TableOnPage",
    "Tally",
    "audit_distance",
    "audit_notes",
    "audit_results",
    "best_trials",
    "check_ending",
    "choose_moving",
    "choose_run",
    "choose_trial",
    "compare_choices",
    "compare_conditions",
    "compare_trials",
    "distance_notes",
    "draw_archive",
    "draw_best",
    "draw_choices",
    "draw_coverage",
    "draw_distance",
    "draw_elites",
    "draw_gap_pairs",
    "draw_individuals",
    "draw_lineage",
    "draw_networks",
    "draw_paths",
    "draw_scores",
    "draw_species",
    "draw_trial",
    "elite_maps",
    "export_frame",
    "export_individual",
    "measure_agreement",
    "measure_variety",
    "read_tally",
    "refuse_gap_page",
    "save_arena",
    "save_distance",
    "save_divergence",
    "save_drawing",
    "save_robot",
    "save_sensor_figure",
    "save_twin",
    "save_view",
    "summarize",
    "summarize_tasks",
    "touch_network",
    "watch",
    "write_closed_gap",
    "write_compared_scores",
    "write_gap_report",
    "write_movie",
    "write_report",
]
