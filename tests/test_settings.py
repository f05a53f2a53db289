from __future__ import annotations

import pickle

import pytest

from realitygap import Condition, NeatSettings, Study
from realitygap.errors import RealityGapError
from realitygap.evolution import NoveltySettings
from realitygap.platforms import JyroPlatform, SimPlatform
from realitygap.robots.twin import load_twin
from realitygap.study import ConditionNotes, ReportSection, StudySection, load_study
from realitygap.tasks import CoverageTask
from realitygap.world import ArenaSettings, Distribution, load_arena, load_calibration, load_robot

UNKNOWN = "unknown setting. Did you mean "


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: NeatSettings(popultion=3), f"NeatSettings.popultion: {UNKNOWN}'population'?"),
        (lambda: NeatSettings(population="x"), "NeatSettings.population: expected a whole number, got 'x'."),
        (lambda: NeatSettings(population=1), "NeatSettings.population: expected at least 2, got 1."),
        (lambda: NeatSettings(crossover=2), "NeatSettings.crossover: expected at most 1.0, got 2."),
        (
            lambda: NeatSettings(weight_limit=float("nan")),
            "NeatSettings.weight_limit: expected a finite number, got nan.",
        ),
        (
            lambda: NeatSettings(activation="tan"),
            (
                "NeatSettings.activation: expected 'tanh', 'sigmoid' or 'identity', got 'tan'. Did you mean "
                "'tanh'?"
            ),
        ),
        (
            lambda: NeatSettings.named("default", popultion=3),
            f"NeatSettings.popultion: {UNKNOWN}'population'?",
        ),
        (lambda: JyroPlatform(stepz=3), f"JyroPlatform.stepz: {UNKNOWN}'steps'?"),
        (lambda: JyroPlatform(steps=1.5), "JyroPlatform.steps: expected a whole number, got 1.5."),
        (lambda: ArenaSettings(stat="left"), f"ArenaSettings.stat: {UNKNOWN}'start'?"),
        (
            lambda: ArenaSettings(start="lef"),
            "ArenaSettings.start: expected 'corner', 'center' or 'left', or a list, got 'lef'.",
        ),
        (lambda: CoverageTask(cell="line"), f"CoverageTask.cell: {UNKNOWN}'cells'?"),
        (lambda: NoveltySettings(archive=3), f"NoveltySettings.archive: {UNKNOWN}'archive_size'?"),
        (lambda: Condition(), "Condition.name: missing, and it has no default."),
        (
            lambda: Condition(name="a", neat={"popultion": 3}),
            f"Condition.neat.popultion: {UNKNOWN}'population'?",
        ),
        (lambda: Condition(name="a", neat=3), "Condition.neat: expected a table, got 3."),
        (lambda: StudySection(name="a", sed=3), f"StudySection.sed: {UNKNOWN}'seed'?"),
        (
            lambda: ConditionNotes(published=[0.1, 2.0]),
            "ConditionNotes.published[2]: expected at most 1.0, got 2.0.",
        ),
        (
            lambda: Study(
                about=StudySection(name="a"), report=ReportSection(), conditions=(), notes=(ConditionNotes(),)
            ),
            "Study: there are 1 notes, expected 0: one a condition, such as ConditionNotes().",
        ),
    ],
)
def test_a_mistake_is_told_in_one_line_of_ours(make, text):
    with pytest.raises(ValueError, match=":") as caught:
        make()
    assert str(caught.value) == text
    assert type(caught.value) is ValueError


def test_all_mistakes_are_told_at_once_a_line_each():
    with pytest.raises(ValueError, match=":") as caught:
        NeatSettings(population=1, generations=0, tournament=3)
    places = [line.split(":")[0] for line in str(caught.value).splitlines()]
    assert sorted(places) == [
        "NeatSettings.generations",
        "NeatSettings.population",
        "NeatSettings.tournament",
    ]


def test_a_mistake_within_a_table_is_told_once_with_its_place():
    """A constructor of ours that pydantic calls for the inner table would tell of it as of one wrong value."""
    with pytest.raises(ValueError, match=":") as caught:
        Condition(name="a", neat={"population": 1}, jyro={"steps": 0})
    assert str(caught.value).splitlines() == [
        "Condition.neat.population: expected at least 2, got 1.",
        "Condition.jyro.steps: expected at least 1, got 0.",
    ]


def test_settings_are_made_copied_and_pickled_as_before():
    settings = NeatSettings.named("rosenzweig-remy", population=20)
    assert (
        settings == NeatSettings.model_validate(settings.model_dump()) == pickle.loads(pickle.dumps(settings))
    )
    assert NeatSettings(settings="rosenzweig-remy", population=20) == settings
    with pytest.raises(ValueError, match="frozen"):
        settings.population = 3


FORMATS = {
    load_twin: 'format = "realitygap twin 1"\n',
    load_calibration: 'format = "realitygap calibration 1"\n',
}
WHERE_NUMBERS_GO = [
    (load_robot, 'name = "r"\ndrive = { speed = true, track = 0.1 }\n', "drive.speed: expected a number"),
    (load_arena, 'name = "a"\nwall = [[0, 0, true, 0]]\nstart = [1, 1, 0]\n', "wall.0.x2: expected a number"),
    (load_twin, "[body]\nmass = true\n", "body.mass: expected a number"),
    (load_calibration, '[numbers]\n"drive.track" = true\n', "numbers.drive.track: expected a number"),
    (
        load_calibration,
        '[draws]\n"drive.track" = [0, false]\n',
        "draws.drive.track[2]: expected a number as value 2",
    ),
    (load_study, '[study]\nname = "s"\nseed = true\n', "study.seed: expected a whole number"),
    (
        load_study,
        '[platform.sim.set]\n"drive.track" = { uniform = [true, 2] }\n',
        "platform.sim.set: drive.track.uniform[1]: expected a number",
    ),
]


@pytest.mark.parametrize(("load", "text", "said"), WHERE_NUMBERS_GO)
def test_true_and_false_are_no_numbers_in_a_file(load, text, said, tmp_path):
    """They were read as 1 and 0."""
    file = tmp_path / "file.toml"
    file.write_text(FORMATS.get(load, "") + text)
    with pytest.raises(RealityGapError, match="mistake") as caught:
        load(file)
    came = "False" if "false" in text else "True"
    assert len([line for line in str(caught.value).splitlines() if f"{said}, got {came}" in line]) == 1


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: JyroPlatform(steps=True), "JyroPlatform.steps: expected a whole number, got True."),
        (lambda: Distribution(choice=[1, True]), "Distribution.choice[2]: expected a number, got True."),
        (lambda: ConditionNotes(published=[True, 1]), "ConditionNotes.published[1]: expected a number, got True."),
        (lambda: Condition(name="a", noise=True), "Condition.noise: expected a number, got True."),
    ],
)  # fmt: skip
def test_true_and_false_are_no_numbers_in_python(make, text):
    with pytest.raises(ValueError, match=":") as caught:
        make()
    assert str(caught.value).startswith(text)


def test_a_setting_that_is_true_or_false_may_be_so():
    assert NeatSettings(recurrent=True).recurrent
    assert not SimPlatform(noise=False).noise
