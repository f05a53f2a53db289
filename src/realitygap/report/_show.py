"""Files that `realitygap show` draws: a run, trial, network, lineage, or archive, species, an arena or a robot."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Literal, get_args

from realitygap.errors import did_you_mean
from realitygap.platforms import JyroPlatform
from realitygap.playback import save_movie
from realitygap.records import RecordWarning, ResultsFolder, refuse_results
from realitygap.report._elites_figure import draw_elites
from realitygap.report._formats import captioned, check_ending, save_drawing, save_picture
from realitygap.report._lineage_figure import draw_lineage
from realitygap.report._motion import choose_moving
from realitygap.report._networks_figure import draw_network
from realitygap.report._path_figure import draw_paths
from realitygap.report._species_figure import draw_species
from realitygap.report._tally import read_tally
from realitygap.report._trial_figure import choose_trial, draw_trial
from realitygap.report.charts.house import Drawing
from realitygap.robots.twin import TwinModel, load_twin, twin_picture
from realitygap.world import arena_picture, load_arena, load_robot, model_picture

Subject = Literal["run", "network", "species", "lineage", "archive"]

_STILL = (".pdf", ".png", ".svg")
_MOVING = (".gif", ".mp4")


def save_view(
    folder: ResultsFolder | str | Path,
    out: str | Path,
    *,
    subject: Subject = "run",
    condition: str | None = None,
    replicate: int | None = None,
    generation: int | None = None,
    individual: int | None = None,
    allow_code: bool = False,
) -> Path:
    """Draw something of a study's results into a file, recomputed from its rows.

    Args:
        folder: Results of a study, or the path to them.
        out: Path that ends in .svg, .pdf, .png or, for one trial, .gif or .mp4. An existing file is replaced.
        subject: run, the best path of each generation, or with `generation` or `individual` (or a .gif) one trial;
            network, that of one individual; species, their shares in one run and their number in all; lineage, the
            ancestors of one individual; archive, the elites of one run with MAP-Elites.
        condition: Condition. Default: the first one.
        replicate: Run. Default: the typical one, and for species the one with most of them.
        generation: Generation of a trial, network or lineage. Default: that of the run's best trial, and for a network
            the last one.
        individual: Individual of the generation. Default: the best one by the task.
        allow_code: True to run Python files of tasks and descriptors that the user has not allowed before. An archive
            that needs one is not corrected without.

    Returns:
        The path of the file.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, it holds no trials yet, a trial comes out
            otherwise than recorded, its settings are another version's, or the file cannot be written.
        TypeError: the number of a run, generation or individual is not a whole number.
        ValueError: there is no such subject, condition, run, generation, individual or ending; the message says which
            there are.
    """
    out = Path(out)
    _check_name("subject", subject, list(get_args(Subject)))
    ending = check_ending(out, (*_MOVING, *_STILL) if subject == "run" else _STILL)
    refuse_results(out)
    with warnings.catch_warnings():
        if not isinstance(folder, ResultsFolder):
            warnings.simplefilter("default", RecordWarning)
        tally = read_tally(folder, allow_code=allow_code)
    if subject == "archive":
        if generation is not None or individual is not None:
            raise ValueError(
                "An archive is shown at the end of its run: leave out generation and individual."
            )
        return _save(draw_elites(tally, condition, replicate), out, "Archive")
    if subject == "species":
        if generation is not None or individual is not None:
            raise ValueError("Species are shown over all generations: leave out generation and individual.")
        return _save(draw_species(tally, condition, replicate), out, "Species")
    if subject == "lineage":
        trial = choose_trial(tally, condition, replicate, generation, individual)
        drawing = draw_lineage(tally, condition, replicate, generation, individual)
        return _save(drawing, out, f"Lineage of {trial.title}")
    if subject == "network":
        trial = choose_trial(tally, condition, replicate, generation, individual, of_last=True)
        return _save(
            draw_network(trial.condition, trial.row, trial.measure), out, f"Network of {trial.title}"
        )
    if generation is None and individual is None and ending not in _MOVING:
        name = tally.name_of(condition)
        return _save(draw_paths(tally, name, replicate), out, f"A run of {name}")
    if ending in _MOVING:
        title, trials = choose_moving([tally.folder], None, condition, replicate, generation, individual)
        return save_movie(trials, out, title=title)
    trial = choose_trial(tally, condition, replicate, generation, individual)
    return _save(draw_trial(tally, condition, replicate, generation, individual), out, trial.title)


def _save(drawing: Drawing, out: Path, title: str) -> Path:
    return save_drawing(captioned(drawing, "figure"), out, title=title)


def save_arena(out: str | Path, name: str | Path = "paper", *, robot: str | Path | None = None) -> Path:
    """Draw an arena to scale into a file, with a robot at its start.

    Args:
        out: Path that ends in .svg, .pdf or .png. An existing file is replaced.
        name: Name of an arena, or the path of its TOML or SVG file.
        robot: Name or file of the robot. Default: `jyro` in the paper's arena, and none in other arenas.

    Returns:
        The path of the file.

    Raises:
        DescriptionError: there is no such arena or robot, or its file cannot be used; every mistake.
        RecordError: the file cannot be written.
        ValueError: there is no such ending.
    """
    check_ending(Path(out), _STILL)
    arena = load_arena(name)
    if robot is None and str(name) == "paper":
        paper_robot = JyroPlatform()
        return save_picture(arena_picture(arena, paper_robot.body, paper_robot.sensors), out)
    return save_picture(arena_picture(arena, None if robot is None else load_robot(robot)), out)


def save_robot(out: str | Path, name: str | Path = "jyro") -> Path:
    """Draw a robot by name or from its file into a file, with its sensors and dimensions; see `save_arena`."""
    check_ending(Path(out), _STILL)
    return save_picture(model_picture(load_robot(name)), out)


def save_twin(out: str | Path, twin: TwinModel | str | Path) -> Path:
    """Draw a twin, or that of a file, from above into a file, with its dimensions; see `save_arena`."""
    check_ending(Path(out), _STILL)
    return save_picture(twin_picture(twin if isinstance(twin, TwinModel) else load_twin(twin)), out)


def _check_name(what: str, name: str, known: list[str]) -> None:
    if name not in known:
        raise ValueError(f"Unknown {what} {name!r}. {did_you_mean(name, known)}")
