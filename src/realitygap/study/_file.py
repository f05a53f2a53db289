"""Reading a study file (TOML)."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from realitygap._limits import MOST_TOML_BYTES, parse_toml, read_file
from realitygap.errors import StudyError, did_you_mean
from realitygap.evolution import NAMED_SETTINGS, NeatSettings, NoveltySettings
from realitygap.platforms import (
    ARENA,
    Platform,
    as_numbers,
    built_in_platforms,
    platform_class,
    platform_names,
    split_spec,
    study_platforms,
)
from realitygap.runs import ArchiveSettings, Condition
from realitygap.settings import MISSING, mistakes
from realitygap.tasks import ControllerSettings, CoverageTask, task_model
from realitygap.world import ArenaSettings

from ._named_files import find_files
from ._problems import Problems, StudyFileError
from ._study import ConditionNotes, ReportSection, Study, StudySection, TrialsSection, replaced, same_file

DEFAULT_NEAT = "rosenzweig-remy"
SECTIONS: dict[str, type[BaseModel]] = {
    "arena": ArenaSettings,
    "task": CoverageTask,
    "controller": ControllerSettings,
    "neat": NeatSettings,
    "novelty": NoveltySettings,
    "archive": ArchiveSettings,
}


def platform_sections() -> dict[str, type[Platform]]:
    """Return the settings of each platform that conditions can be on; those of other packages are not imported."""
    return {model.name: model for model in built_in_platforms() if model.is_for_studies}


_OWN_KEYS = ("name", "selection", "platform", "noise")


def named_studies() -> list[str]:
    """Return the names of the studies that come with realitygap."""
    folder = resources.files(__package__) / "studies"
    return sorted(
        entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml")
    )


def read_named_study(name: str) -> str:
    """Return the file of a study that comes with realitygap.

    Raises:
        StudyError: There is none of that name.
    """
    if name not in named_studies():
        raise StudyError(f"Unknown study {name!r}. {did_you_mean(name, named_studies())}")
    return (resources.files(__package__) / "studies" / f"{name}.toml").read_text("utf-8")


def load_study(
    study: str | Path,
    *,
    seed: int | None = None,
    replicates: int | None = None,
    randomize: str | None = None,
) -> Study:
    """Read a study by name or from a file, and resolve every setting.

    Args:
        study: A name of `named_studies`, or a path of a TOML file.
        seed: Seed that replaces the file's.
        replicates: Number of replicates that replaces the file's.
        randomize: posterior, or no: whether the robots of calibrations are drawn; as the file says when None.

    Raises:
        StudyError: No such study, a file that cannot be read, or mistakes in it: all of them, each with its
            place; or no condition has a robot that could be drawn.
    """
    resolved = _load_study(study, seed, replicates)
    return resolved if randomize is None else _randomized(resolved, randomize)


def _load_study(study: str | Path, seed: int | None, replicates: int | None) -> Study:
    if not isinstance(study, str | Path):
        raise TypeError(f"study is {study!r}, expected the name of one, or the path of a study file.")
    name = str(study)
    if name in named_studies():
        return parse_study(read_named_study(name), name, seed=seed, replicates=replicates)
    path = Path(study)
    if not name or not path.exists():
        if path.suffix == ".toml" or len(path.parts) > 1:
            raise StudyError(
                f"There is no file {path}. `realitygap new-study {shlex.quote(str(path))}` writes one to start from."
            )
        if name and path.with_suffix(".toml").exists():
            raise StudyError(f"Unknown study {name!r}. Did you mean the file {path.with_suffix('.toml')}?")
        raise StudyError(
            f"Unknown study {name!r}. {did_you_mean(name, named_studies())} A file of your own ends in .toml; "
            "`realitygap new-study` writes one."
        )
    if path.suffix == ".py":
        raise StudyError(
            f"{path} is a Python file, expected a study file (.toml). Its task may be 'python:{path}:FUNCTION'. "
            "`realitygap new-study` writes one."
        )
    if path.joinpath("study.json").is_file():
        raise StudyError(
            f"{path} is a folder of results, expected a study by name or its file. To look at the results: realitygap "
            f"report {shlex.quote(str(path))}"
        )
    try:
        text = read_file(path, MOST_TOML_BYTES).decode("utf-8")
    except UnicodeDecodeError as error:
        raise StudyError(
            f"{path} is not a text file in UTF-8 (byte {error.start} is not). Expected a study file, as "
            "`realitygap new-study` writes one."
        ) from error
    except OSError as error:
        raise StudyError(
            f"{path} cannot be read: {error.strerror or error}. Expected a study file, as `realitygap new-study` "
            "writes one."
        ) from error
    return parse_study(text, str(path), seed=seed, replicates=replicates)


def parse_study(text: str, origin: str, *, seed: int | None = None, replicates: int | None = None) -> Study:
    """Resolve a study from the text of its file; arguments and errors as in `load_study`.

    Args:
        text: TOML.
        origin: Name of the file in messages.
        seed, replicates: Values that replace the file's.
    """
    try:
        data = parse_toml(text)
    except ValueError as error:
        raise StudyError(f"{origin} is not TOML: {error}.") from error
    _refuse_other_files(data, origin)
    problems = Problems()
    find_files(data, Path(origin).parent, problems)
    study = _resolve(data, problems, replaced(seed=seed, replicates=replicates))
    if problems.lines or study is None:
        count = len(problems.lines)
        head = f"{origin} has {count} mistake{'s' if count != 1 else ''}; nothing was run."
        raise StudyFileError(head, problems.lines)
    return study


def _refuse_other_files(data: dict[str, Any], origin: str) -> None:
    """Raise an error that says how a study names the file, if it is a robot or an arena."""
    if "study" in data or "condition" in data:
        return
    if {"body", "drive", "range"} & set(data):
        raise StudyError(
            f"{origin} is a robot file, expected a study file. A study names it as robot = {Path(origin).name!r} in "
            "[platform.sim], and its conditions have platform = 'sim'."
        )
    if {"wall", "start"} & set(data):
        raise StudyError(
            f"{origin} is an arena file, expected a study file. A study names it as file = {Path(origin).name!r} in "
            "[arena]."
        )


def _randomized(study: Study, randomize: str) -> Study:
    """Return the study with robots of calibrations drawn, or not."""
    if randomize not in ("no", "posterior"):
        raise StudyError(f"randomize is {randomize!r}, expected no or posterior.")

    def changed(condition: Condition) -> Condition:
        return condition.model_copy(update={"on": condition.on.randomized(randomize)})

    conditions = tuple(changed(condition) for condition in study.conditions)
    if randomize == "posterior" and conditions == study.conditions and not any(map(_is_drawn, conditions)):
        raise StudyError(
            "--randomize posterior draws robots from a calibration, and no condition of this study has one with "
            'draws. Expected platform = "sim:FILE" with a file that `realitygap calibrate` wrote.'
        )
    return study.model_copy(update={"conditions": conditions})


def _is_drawn(condition: Condition) -> bool:
    return condition.on.is_randomized


def _resolve(data: dict[str, Any], problems: Problems, changes: dict[str, Any]) -> Study | None:
    known = {"study", "report", "trials", "platform", "condition", *SECTIONS}
    for key in data:
        if key not in known:
            problems.add(key, f"unknown section. {did_you_mean(key, known)}")
    if "study" not in data:
        problems.add("study", "missing. Expected a section [study] with at least a name.")
    about_values = problems.table("study", data.get("study", {}))
    about_values |= changes
    is_table = isinstance(data.get("study"), dict)
    about = problems.check(StudySection, about_values, "study") if is_table else None
    report = problems.check(ReportSection, problems.table("report", data.get("report", {})), "report")
    trials = problems.check(TrialsSection, problems.table("trials", data.get("trials", {})), "trials")
    base = {section: problems.table(section, data.get(section, {})) for section in SECTIONS}
    platforms = problems.table("platform", data.get("platform", {}))
    of_platforms: dict[str, BaseModel] = {}
    for section, values in base.items():
        _check_section(section, values, section, problems)
    for key, value in platforms.items():
        if key in study_platforms():
            base[key] = problems.table(f"platform.{key}", value)
            checked = problems.check(platform_class(key), base[key], f"platform.{key}", is_part=True)
            if checked is not None:
                of_platforms[key] = checked
        else:
            problems.add(f"platform.{key}", f"unknown platform. {did_you_mean(key, study_platforms())}")
    listed = data.get("condition", [])
    if not isinstance(listed, list) or not listed:
        problems.add("condition", "expected at least one [[condition]] (two brackets), with a name.")
        listed = []
    conditions: list[Condition] = []
    notes: list[ConditionNotes] = []
    names: list[str] = []
    for index, value in enumerate(listed):
        values = problems.table(f"condition[{index + 1}]", value)
        if not isinstance(value, dict):
            continue
        name = values.get("name")
        place = f"condition[{index + 1}]" + (f" {name!r}" if isinstance(name, str) else "")
        if name in names:
            problems.add(f"{place}.name", "an earlier condition has this name. Give each condition its own.")
        elif isinstance(name, str) and (alike := same_file(name, names)) is not None:
            problems.add(
                f"{place}.name",
                f"differs from {alike!r} in capitals only, and some disks take their files for one.",
            )
        names.append(name if isinstance(name, str) else "")
        condition, note = _condition(values, base, about, place, problems)
        if condition is not None and note is not None:
            conditions.append(condition)
            notes.append(note)
    _refuse_unused(of_platforms, listed, problems)
    for index, note in enumerate(notes):
        if note.baseline is not None and note.baseline not in names:
            place = f"condition {conditions[index].name!r}.baseline"
            problems.add(
                place, f"there is no condition {note.baseline!r}. {did_you_mean(note.baseline, names)}"
            )
    if problems.lines or about is None or report is None or trials is None:
        return None
    return Study(about=about, report=report, trials=trials, conditions=tuple(conditions), notes=tuple(notes))


def _refuse_unused(tables: Mapping[str, BaseModel], conditions: Sequence[Any], problems: Problems) -> None:
    """Record settings of platforms that no condition is on: the study would run on another platform."""
    used = {
        split_spec(str(each.get("platform", "jyro")))[0] for each in conditions if isinstance(each, Mapping)
    }
    for name, table in tables.items():
        if name not in used and not _is_default(table):
            problems.add(
                f"platform.{name}",
                f'no condition is on this platform. Write platform = "{name}" in a condition, or remove the settings.',
            )


def _is_default(table: BaseModel) -> bool:
    try:
        return table == type(table)()
    except ValidationError:  # some settings have no default
        return False


def _check_section(section: str, values: dict[str, Any], place: str, problems: Problems) -> None:
    """Record the mistakes of one section, with their positions."""
    if section == "neat":
        name = values.get("settings", DEFAULT_NEAT)
        if not isinstance(name, str) or name not in NAMED_SETTINGS:
            problems.add(
                f"{place}.settings", f"unknown set {name!r}. {did_you_mean(str(name), NAMED_SETTINGS)}"
            )
            values = {**values, "settings": DEFAULT_NEAT}
    model = SECTIONS.get(section) or platform_class(section)
    if section == "task":
        try:
            model = task_model(values)
        except ValueError as error:
            problems.add(f"{place}.kind", f"{error}.")
            return
        if model is CoverageTask:
            values = {key: value for key, value in values.items() if key != "kind"}
    problems.check(model, values, place, is_part=section not in SECTIONS)


def _laid_over(section: str, below: dict[str, Any], above: dict[str, Any]) -> dict[str, Any]:
    """Return a section of a condition over that of the study: key by key, and numbers by name, but for another task."""
    if section == "task" and any(
        above.get(key, below.get(key)) != below.get(key) for key in ("kind", "source")
    ):
        return above
    merged = {**below, **above}
    if isinstance(below.get("set"), dict) and isinstance(above.get("set"), dict):
        merged["set"] = {**below["set"], **above["set"]}
    return merged


def _check_arena_numbers(platform: str, merged: dict[str, Any], place: str, problems: Problems) -> None:
    """Note what is wrong with the arena's numbers among those of the platform, which a condition looks at last."""
    given = merged[platform].get("set")
    try:
        arena = ArenaSettings(**merged["arena"]).arena()
        numbers, _ = as_numbers(given if isinstance(given, dict) else {})
    except ValueError:
        return  # the arena's own mistakes are reported
    try:
        arena.with_numbers({name: value for name, value in numbers.items() if name.startswith(ARENA)})
    except ValueError as error:
        for line in str(error).split("\n"):
            message = line.removeprefix("ArenaFile").lstrip(".: ").replace("mean '", f"mean '{ARENA}")
            problems.add(f"{place}.{platform}.set", ARENA + message)


def _condition(
    values: dict[str, Any],
    base: dict[str, dict[str, Any]],
    about: StudySection | None,
    place: str,
    problems: Problems,
) -> tuple[Condition | None, ConditionNotes | None]:
    before = len(problems.lines)
    platform = split_spec(str(values.get("platform", "jyro")))[0]
    known = [*_OWN_KEYS, *ConditionNotes.model_fields, *SECTIONS, *platform_names()]
    for key in values:
        if key not in known:
            problems.add(f"{place}.{key}", f"unknown setting. {did_you_mean(key, known)}")
    own = {key: values[key] for key in _OWN_KEYS if key in values}
    if "name" not in own:
        problems.add(f"{place}.name", "missing, and it has no default.")
    note_values = {key: values[key] for key in ConditionNotes.model_fields if key in values}
    notes = problems.check(ConditionNotes, note_values, place)
    merged: dict[str, Any] = {}
    for section in platform_names():
        if section in values and platform in study_platforms() and section != platform:
            problems.add(
                f"{place}.{section}", f"of no meaning here: the condition's platform is {platform!r}."
            )
    for section in (*SECTIONS, platform):
        changed = problems.table(f"{place}.{section}", values.get(section, {}))
        if changed:
            checked = _laid_over(section, base.get(section, {}), changed) if section == "task" else changed
            _check_section(section, checked, f"{place}.{section}", problems)
        merged[section] = _laid_over(section, base.get(section, {}), changed)
    merged["neat"] = {"settings": DEFAULT_NEAT, **merged["neat"]}
    if "name" in own:
        is_known = platform in study_platforms()
        problems.check(Condition, {k: v for k, v in own.items() if not (k == "platform" and is_known)}, place)
    if len(problems.lines) > before or about is None or platform not in study_platforms():
        return None, notes
    try:
        condition = Condition.model_validate({**own, "seed": about.seed, "pair": about.pair, **merged})
    except ValidationError as error:
        rest = f"{platform}.{platform_class(platform).rest_setting}"
        for name, text in mistakes(error, Condition, merged):
            section = name.partition(".")[0]
            shared = tuple(above + section + end for above in ("", "platform.") for end in ".:")
            if name == rest and ":" in str(own.get("platform")):
                problems.add(f"{place}.platform", text)
            elif text == MISSING or not any(line.startswith(shared) for line in problems.lines):
                problems.add(f"{place}.{name}".rstrip("."), text)  # otherwise it was noted there
        if any(problem["loc"][:1] == (platform,) for problem in error.errors()):
            _check_arena_numbers(platform, merged, place, problems)
        return None, notes
    return condition, notes
