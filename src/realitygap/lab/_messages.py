"""Messages between the lab's server and its processes: one line of JSON each, with the name of the class as `kind`.

A process is begun with one `Work`. After that the server sends a `Wish` or an `Answer`, and the process a `Report` or a
`Question`. Messages hold what JSON has: numbers, texts, lists, and tables with known keys.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal, dataclass_transform

from typing_extensions import TypedDict  # pydantic reads it with Python 3.11, too

from realitygap.playback import PackedScene, PackedTrial

Choice = Literal["", "go", "redo", "stop", "void", "driven", "yes", "no"]
"""The button that answers a question; empty if the question has only one."""
Activity = Literal["preflight", "picture", "place"]
"""What a robot that is driven by hand can be asked for."""


_KINDS: dict[str, type[Message]] = {}


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
class Message:
    """A message in either direction. Each subclass is a frozen dataclass."""

    def __init_subclass__(cls) -> None:
        _KINDS[cls.__name__] = dataclass(frozen=True)(cls)


def to_line(message: Message) -> str:
    """Return the line of a message."""
    return json.dumps({"kind": type(message).__name__, **vars(message)}, separators=(",", ":")) + "\n"


def from_line(line: str) -> Message:
    """Return the message of a line.

    Raises:
        ValueError: It is no message: no JSON, of an unknown kind, or with other fields.
    """
    values = json.loads(line)
    kind = values.pop("kind", None) if isinstance(values, dict) else None
    if not isinstance(kind, str) or kind not in _KINDS:
        raise ValueError(f"A message of kind {kind!r} came, expected one of {', '.join(_KINDS)}.")
    try:
        return _KINDS[kind](**values)
    except TypeError as error:
        raise ValueError(f"A message of kind {kind} has other fields than expected: {error}.") from error


# tables in messages


class TrialCard(TypedDict):
    """A trial that an operator places or watches; a blind trial hides its condition."""

    trial: int
    title: str
    pen: str
    sheet: int
    n_steps: int
    n_left: int


class SummaryRow(TypedDict):
    """The best coverage of a condition; the interval of its median is None if there are too few runs."""

    condition: str
    label: str
    n: int
    line_median: float | None
    line_low: float | None
    line_high: float | None


class CurvePoint(TypedDict):
    """The median best coverage in a generation, its interval, and the number of runs."""

    n: int
    median: float
    low: float | None
    high: float | None


class Curve(TypedDict):
    """The best coverage of a condition by generation."""

    condition: str
    label: str
    search: str
    noise: float
    points: list[CurvePoint]


class GenerationPaths(TypedDict):
    """Paths of a generation: x and y of their points [mm], in turn. That of the best individual is the last one."""

    generation: int
    coverage: float
    paths: list[list[int]]


class Figure(TypedDict, total=False):
    """A figure as SVG for wide and narrow pages; only a `text` if it cannot be drawn."""

    caption: str
    alt: str
    wide: str
    narrow: str
    text: str


class TrialChoice(TypedDict, total=False):
    """A trial of a study; numbers that are missing are those of the typical run."""

    condition: str
    replicate: int
    generation: int
    individual: int


class PlaceGrid(TypedDict):
    """The numbers of a `Grid`."""

    x: float
    y: float
    cell: float
    columns: int
    rows: int


class Place(TypedDict):
    """The arena of an emulated robot: walls and start [m, rad], and its grid."""

    walls: list[list[float]]
    grid: PlaceGrid
    start: list[float]


class ControllerScores(TypedDict):
    """The mean score of a controller on both sides of a gap, with intervals of 95 %."""

    name: str
    isChampion: bool
    means: list[float]
    ends: list[list[float]]


class ScorePairs(TypedDict):
    """The scores of all controllers of a gap, and the names of the two sides and of the score."""

    sides: list[str]
    score: str
    points: list[ControllerScores]


class ReadingPoint(TypedDict):
    """The mean reading of each sensor in a trial of a calibration, 0 to 1.

    `at` is its distance from the wall [in] if `purpose` is `sensors`, and its number otherwise.
    """

    at: float
    purpose: str
    means: list[float]


# works: the first message to a process


class Work(Message):
    """The purpose of a process.

    Attributes:
        function: Function that does it, as `module:name` in this package. It takes the channel and the work.
    """

    function: ClassVar[str]


class CheckWork(Work):
    """Wait for one `StudyText`, and answer it.

    Attributes:
        root: Folder of the lab.
        allow_code: Whether Python files of tasks may run.
    """

    function: ClassVar[str] = "_checks:answer_text"
    root: str
    allow_code: bool = False


class StudyWork(Work):
    """Run a study, or resume it.

    Attributes:
        folder: Folder of its results.
        allow_code: Whether Python files of tasks may run.
        text: The study file of a new study; None to resume.
        replicates: New number of runs per condition; None to keep it.
        threads: Number of threads; None for the default.
        port: Port of the robot; empty if none drives.
        witness: HOST:PORT of the witness of an emulator in another program.
        camera: Camera above the robot, as `read_camera` takes it.
        counts: Who scores: `page`, `camera`, or `witness`.
        when: When trials are scored: `sheet` or `trial`.
        lock: Whether the design of the trials on a robot is locked before the first one.
        who: Person who locks it.
    """

    function: ClassVar[str] = "_study:run"
    folder: str
    allow_code: bool = False
    text: str | None = None
    replicates: int | None = None
    threads: int | None = None
    port: str = ""
    witness: str = ""
    camera: str = ""
    counts: str = ""
    when: str = "sheet"
    lock: bool = False
    who: str = ""


class IdentifyWork(Work):
    """Ask the robot on a port for its name."""

    function: ClassVar[str] = "_hand:identify"
    port: str


class HandWork(Work):
    """Drive a robot by hand.

    Attributes:
        port: Port of the robot.
        witness: HOST:PORT of the witness of an emulator in another program.
    """

    function: ClassVar[str] = "_hand:drive"
    port: str
    witness: str = ""


class DrawingWork(Work):
    """Draw what is wished for, until nobody wishes for anything.

    Attributes:
        allow_code: Whether Python files of tasks may run.
    """

    function: ClassVar[str] = "_drawing:draw"
    allow_code: bool = False


class GapWork(Work):
    """Measure a gap.

    Attributes:
        order: Message of a `GapOrder`.
        page: File of the report.
        closes: True to calibrate then, and to measure again.
    """

    function: ClassVar[str] = "_gap:measure"
    order: dict[str, Any]
    page: str
    closes: bool = False


class CalibrationWork(Work):
    """Calibrate; `order` is the message of a `CalibrateOrder`."""

    function: ClassVar[str] = "_calibration:calibrate"
    order: dict[str, Any]


class PhotoWork(Work):
    """Read a photograph of a sheet.

    Attributes:
        folder: Folder of the study.
        photo, picture: Files to read and to write.
        name, sha256: Name and hash of the photograph.
        sheet: Number of the sheet.
    """

    function: ClassVar[str] = "_photos:read"
    folder: str
    photo: str
    picture: str
    name: str
    sha256: str
    sheet: int


class VideoWork(Work):
    """Look for trials in a video.

    Attributes:
        folder: Folder of the study.
        root: Folder of the video.
        spec: The video, as `read_camera` takes it.
        trials: Their numbers.
    """

    function: ClassVar[str] = "_video:track"
    folder: str
    root: str
    spec: str
    trials: list[int]


class LiveWork(Work):
    """Have a network of a study drive one trial while visitors watch.

    Attributes:
        folder: Folder of the study.
        platform: Platform, as `open_robot` takes it; empty for that of the condition.
        trial: The network's trial.
    """

    function: ClassVar[str] = "_live:drive_live"
    folder: str
    platform: str = ""
    trial: TrialChoice = field(default_factory=TrialChoice)


# wishes: further messages to a process


class Wish(Message):
    """Something that a process is to do."""


class Quit(Wish):
    """Stop the robot, save, and end."""


class Stop(Wish):
    """Stop the motors, and with them the trial."""


class Release(Wish):
    """Stop, because the drive pad was let go."""


class Drive(Wish):
    """Drive for the next moment: parts of full speed, ahead and to the left positive."""

    move: float
    turn: float


class Ask(Wish):
    """Have a robot that is driven by hand do something else."""

    what: Activity


class StudyText(Wish):
    """A study file to read into a form, or to check."""

    do: Literal["read", "check"]
    text: str


class FiguresWish(Wish):
    """Draw figures of a study.

    Attributes:
        folder: Folder of the study.
        done: Number of complete runs: simulated, and driven.
        names: Figures to draw; None for all, which are saved.
        condition: Condition of those figures that show one. Default: the one with the highest median.
    """

    folder: str
    done: Sequence[int]
    names: list[str] | None = None
    condition: str = ""


class ThumbnailWish(Wish):
    """Save the small picture and the summary of a study; `done` as in `FiguresWish`."""

    folder: str
    done: Sequence[int]


class ReplayWish(Wish):
    """Compute trials for a player; the answer has the same key."""

    folder: str
    key: str
    choices: list[TrialChoice]


class ArchiveWish(Wish):
    """List the elites of the typical run of a condition; the answer has the same key."""

    folder: str
    key: str
    condition: str


class TouchWish(Wish):
    """Run a trial again with other weights by link, and without some inputs; the answer has the same key."""

    folder: str
    key: str
    choice: TrialChoice
    weights: dict[str, float]
    cut: list[str]


class RunWish(Wish):
    """Trace the paths of a run: the last one that is published, or the typical one. The answer has the same key."""

    folder: str
    key: str
    condition: str
    is_last: bool


class ReportWish(Wish):
    """Write the report of a study."""

    folder: str


class Answer(Message):
    """An answer to a question.

    Attributes:
        number: Number of the question.
        choice: The button.
        trial: Trial to score again.
        cells: Marked cells.
        lengths: Entered texts by the keys of a `LengthsQuestion`.
    """

    number: int = 0
    choice: Choice = ""
    trial: int | None = None
    cells: list[int] = field(default_factory=list)
    lengths: dict[str, str] = field(default_factory=dict)


# questions of a process to visitors


class Question(Message):
    """A question that a process waits for; the channel numbers it."""

    number: int = field(default=0, kw_only=True)


class MeetQuestion(Question):
    """Is the robot on free floor, for its pre-flight?"""


class AcceptQuestion(Question):
    """Shall it drive although the pre-flight found problems? yes or no."""

    problems: list[str]


class PlaceQuestion(Question):
    """Is the robot at the start of a trial? `is_placed`: the emulator places it."""

    card: TrialCard
    is_placed: bool


class SettleQuestion(Question):
    """Does a trial that was cut off count? driven or void."""

    card: TrialCard
    problem: str


class ContinueQuestion(Question):
    """May the study continue after a visitor stopped an emulated robot?"""

    card: TrialCard
    problem: str


class ScoreQuestion(Question):
    """Shall these trials be scored later? They are scored on other pages, which ends the question."""

    trials: list[int]
    sheet: int
    is_full: bool


class CloseQuestion(Question):
    """Shall the generation be closed? An answer with a trial has this one scored again."""

    trials: list[int]


class StartQuestion(Question):
    """Is the robot where a trial of a calibration begins? go, redo (the trial before), or stop."""

    text: str
    trial: int
    n: int


class RepeatQuestion(Question):
    """Does a trial of a calibration count that was cut off? driven, if `can_count`, or void."""

    problem: str
    can_count: bool


class LengthsQuestion(Question):
    """Where did the path end? Lengths, or redo. `problem`: why the last answer cannot be used."""

    labels: dict[str, str]
    problem: str = ""


class CellsQuestion(Question):
    """Which cells does the line cross?"""


# reports of all processes


class Report(Message):
    """Something that a process says."""


class Answered(Report):
    """A question is not asked any more."""

    number: int


class Pulse(Report):
    """A robot answers in a trial, or the trial has ended."""

    is_driving: bool


class Failure(Report):
    """The work has failed; `is_of_robot`: the robot did not answer or obey."""

    text: str
    is_of_robot: bool = False


class Interrupted(Report):
    """The process was told to end."""


class Ended(Report):
    """The process has ended; the server adds this."""

    status: int


# reports of a study


class StudyProgress(Report):
    """The progress of simulated runs; see `realitygap.study.Progress`."""

    n_done: int
    n_runs: int
    n_computed: int
    seconds: float
    waiting_for: str = ""


class RobotMet(Report):
    """The robot of a study has answered."""

    label: str


class PreflightResult(Report):
    """The result of a pre-flight check."""

    facts: dict[str, str]
    problems: list[str]


class TrialBegun(Report):
    """A trial is being driven."""

    card: TrialCard


class Step(Report):
    """A step of a trial begins; see `Observation` and `Command`."""

    step: int
    n_steps: int
    raw: list[float]
    stalled: bool
    move: float
    turn: float


class RobotPose(Report):
    """The pose of an emulated robot [m, rad], and the cells that it has entered."""

    pose: list[float]
    cells: list[int]


class TrialDriven(Report):
    """A trial has ended."""


class CameraNote(Report):
    """A report of the camera above the robot, such as a trial that it did not see."""

    text: str


class StudyDone(Report):
    """The study has run as far as it can; `waiting`: what it waits for, empty if it is complete."""

    waiting: str


# reports of a robot on a port


class Identified(Report):
    """A robot has told its name; `facts` has the others, too."""

    label: str
    facts: dict[str, str]


class HandMet(Report):
    """The robot that is driven by hand has answered.

    Attributes:
        label: REAL or EMULATED.
        facts: Name and other facts.
        n_sensors: Number of its range sensors.
        kinds: Kinds of its other sensors, such as `light`.
        has_camera, has_battery: Whether it takes pictures, and reports the voltage of its battery.
        place: Where an emulated robot is; None for another.
    """

    label: str
    facts: dict[str, str]
    n_sensors: int
    kinds: list[str]
    has_camera: bool
    has_battery: bool
    place: Place | None = None


class Senses(Report):
    """The readings of a robot that is driven by hand.

    Attributes:
        readings: Raw readings by kind of sensor; `range` for the range sensors.
        stalled: Whether the robot is blocked.
        moves: Whether its motors run.
        cells: Cells that it has entered, if it is emulated.
        pose: Its pose [m, rad], if it is emulated.
    """

    readings: dict[str, list[float]]
    stalled: bool
    moves: bool
    cells: list[int]
    pose: list[float] | None = None


class Battery(Report):
    """The voltage of the battery [V]."""

    volts: float


class Picture(Report):
    """A picture of the robot's camera: PNG in base64."""

    png: str


class Placed(Report):
    """The emulated robot is at its start."""


class Refused(Report):
    """The robot cannot do what it was asked for."""

    text: str


# reports of a gap and a calibration


class TrialCount(Report):
    """Number of trials that are done on a platform."""

    name: str
    done: int
    total: int


class GapMeasured(Report):
    """The result with this number of trials of each controller.

    Attributes:
        trials: The number.
        verdict: Verdict in a sentence.
        measures: Title and words of each measure above the report.
        rms: RMS gap and its interval; None if there is no interval.
        pairs: Scores of each controller.
    """

    trials: int
    verdict: str
    measures: list[tuple[str, str]]
    rms: tuple[float, float, float] | None
    pairs: ScorePairs
    before: ScorePairs | None = None


class GapDone(Report):
    """All trials are done, and the report is written; `is_calibrated`: whether the simulator is a calibration."""

    is_calibrated: bool = False


class CalibrationTrials(Report):
    """Number of recorded trials of a calibration, their total, and their readings."""

    done: int
    n: int
    readings: list[ReadingPoint]


class CalibrationMade(Report):
    """A calibration is written.

    Attributes:
        fitted: Each fitted number, as `Fitted.model_dump` has it.
        notes: Remarks.
        misspecified: Whether the simulator was rejected.
        p: p value of that test.
    """

    fitted: list[dict[str, Any]]
    notes: list[str]
    misspecified: bool
    p: float


class CalibrationPaused(Report):
    """The operator stopped the calibration; its trials are saved."""


# reports of drawings


class StudyReport(Report):
    """Something about the study in a folder."""

    folder: str


class FigureDrawn(StudyReport):
    """A figure of a study."""

    name: str
    figure: Figure


class StudySummary(StudyReport):
    """The rows and curves of a study's conditions."""

    rows: list[SummaryRow]
    curves: list[Curve]


class FiguresDrawn(StudyReport):
    """All figures are drawn; `seconds`: processor time [s]."""

    seconds: float


class ThumbnailDrawn(StudyReport):
    """The small picture is saved."""


class Replay(StudyReport):
    """Trials for a player, or the paths of a run by generation; weights by link and inputs of a touched network."""

    key: str
    scene: PackedScene
    trials: list[PackedTrial]
    weights: dict[str, float] = field(default_factory=dict)
    inputs: list[str] = field(default_factory=list)
    generations: list[GenerationPaths] = field(default_factory=list)


class Archive(StudyReport):
    """The elites of a run, as `EliteMaps` has them; none if the condition has no archive."""

    key: str
    maps: dict[str, Any]


class ReplayRefused(StudyReport):
    """The trials of this key cannot be played, or its elites not listed."""

    key: str
    text: str


class ReportWritten(StudyReport):
    """The report is written; `problem`: why it is not, empty if it is."""

    problem: str = ""


# reports of a check


class TextRead(Report):
    """The values of a study file."""

    data: dict[str, Any]


class TextRefused(Report):
    """A study file cannot be used; `places`: each mistake of which the place is known."""

    text: str
    places: list[str] = field(default_factory=list)


class TextChecked(Report):
    """A study file without mistakes: the name of the study, and its size."""

    name: str
    n_conditions: int
    replicates: int
    n_trials: int


class TimeEstimated(Report):
    """The computing time of the study on this machine [s]; None if it is unknown."""

    seconds: float | None


# reports on photographs, videos, and live drives


class PhotoStage(Report):
    """The present step of reading a photograph."""

    text: str


class PhotoRead(Report):
    """A photograph was read.

    Attributes:
        box: Left, lower, right, upper end of the picture [m].
        trials: Trials on the sheet.
        untried: Pens that were not tried in their boxes.
    """

    box: list[float]
    trials: list[int]
    untried: list[str]


class VideoShare(Report):
    """Share of a video that is done, 0 to 1."""

    share: float


class VideoDone(Report):
    """Trials that were found in a video, and why others were not."""

    found: list[int]
    missed: list[str]


class LiveBegun(Report):
    """A robot is ready to be watched."""

    scene: PackedScene
    trials: list[PackedTrial]


class LiveNews(Report):
    """News for players: `begin`, or where the robot is `now`; see `WatchedRobot`."""

    content: dict[str, Any]


class LivePlayed(Report):
    """The trial has ended; `problem`: why it was cut off."""

    trials: list[PackedTrial]
    problem: str
