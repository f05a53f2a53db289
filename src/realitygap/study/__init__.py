"""Studies: conditions x replicates, read from a file, run, and resumed."""

from realitygap.platforms import open_target

from . import _cards  # noqa: F401  # what notebooks show
from ._advise import Advice, Advised, BlindAdvice, Planned, advise_on
from ._bench import measure_speed
from ._calibrate.from_log import calibrate_from_log
from ._calibrate.from_table import calibrate_from_table
from ._calibrate.one import calibrate, save_calibration
from ._calibrate.ordered import make_calibration
from ._calibrate.whole import calibrate_all
from ._camera import OWN_POSES, CameraObserver, OwnPosesObserver, marks_of, read_camera, tag_of
from ._close import ClosedGap, close_gap
from ._code import AllowCode, check_files, python_functions, task_named
from ._compare import ComparedScores, compare_scores
from ._controllers import sample_controllers
from ._design import DESIGN_NAME, amend_design, unblind_design
from ._deviations import DesignReport, design_report
from ._duration import estimate_seconds
from ._estimated import EstimatedScore
from ._fieldtrial import write_fieldtrial
from ._file import DEFAULT_NEAT, SECTIONS, load_study, named_studies, parse_study, platform_sections
from ._gap.between import GapBetween, gap_between
from ._gap.estimate import estimate_score
from ._gap.plan import GapPlan, plan_gap, recorded_spreads
from ._gap.study import MOST_CONTROLLERS, GapStudy, ShownTrials
from ._kept_target import StoppedByPerson
from ._mazes import MAZE_SEEDS, measure_maze
from ._paired import advise, advise_ledger
from ._physical import physical_conditions
from ._placing import parse_length, placing_words, with_ruled_end
from ._problems import StudyFileError
from ._realism import measure_realism
from ._run import Progress, StudyResult, check_has_robot, drive_study, machine_facts, run_study
from ._study import ConditionNotes, ReportSection, Study, StudySection, TrialsSection
from ._targets import observations_head
from ._task import measure_task, task_settings
from ._template import study_template
from ._tracked import (
    TrackedTrial,
    TrialToTrack,
    note_of_track,
    place_trial,
    score_tracked,
    trial_of_ledger,
)
from ._transfer.ordered import run_transfer
from ._transfer.result import TransferResult
from ._transfer.strategies import choose_condition, transfer
from ._trial_export import export_trials, write_trials
from ._try_on import try_genome, try_on
from ._try_pairs import TriedPairs, try_pairs

__all__ = [
    "DEFAULT_NEAT",
    "DESIGN_NAME",
    "MAZE_SEEDS",
    "MOST_CONTROLLERS",
    "OWN_POSES",
    "SECTIONS",
    "Advice",
    "Advised",
    "AllowCode",
    "BlindAdvice",
    "CameraObserver",
    "ClosedGap",
    "ComparedScores",
    "ConditionNotes",
    "DesignReport",
    "EstimatedScore",
    "GapBetween",
    "GapPlan",
    "GapStudy",
    "OwnPosesObserver",
    "Planned",
    "Progress",
    "ReportSection",
    "ShownTrials",
    "StoppedByPerson",
    "Study",
    "StudyFileError",
    "StudyResult",
    "StudySection",
    "TrackedTrial",
    "TransferResult",
    "TrialToTrack",
    "TrialsSection",
    "TriedPairs",
    "advise",
    "advise_ledger",
    "advise_on",
    "amend_design",
    "calibrate",
    "calibrate_all",
    "calibrate_from_log",
    "calibrate_from_table",
    "check_files",
    "check_has_robot",
    "choose_condition",
    "close_gap",
    "compare_scores",
    "design_report",
    "drive_study",
    "estimate_score",
    "estimate_seconds",
    "export_trials",
    "gap_between",
    "load_study",
    "machine_facts",
    "make_calibration",
    "marks_of",
    "measure_maze",
    "measure_realism",
    "measure_speed",
    "measure_task",
    "named_studies",
    "note_of_track",
    "observations_head",
    "open_target",
    "parse_length",
    "parse_study",
    "physical_conditions",
    "place_trial",
    "placing_words",
    "plan_gap",
    "platform_sections",
    "python_functions",
    "read_camera",
    "recorded_spreads",
    "run_study",
    "run_transfer",
    "sample_controllers",
    "save_calibration",
    "score_tracked",
    "study_template",
    "tag_of",
    "task_named",
    "task_settings",
    "transfer",
    "trial_of_ledger",
    "try_genome",
    "try_on",
    "try_pairs",
    "unblind_design",
    "with_ruled_end",
    "write_fieldtrial",
    "write_trials",
]
