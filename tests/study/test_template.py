"""The file that `realitygap new-study` writes."""

import re

import pytest

from realitygap.runs import Condition
from realitygap.settings import is_hidden
from realitygap.study import (
    SECTIONS,
    ConditionNotes,
    ReportSection,
    StudySection,
    load_study,
    named_studies,
    parse_study,
    study_template,
)


def test_template_is_a_study_with_the_defaults():
    study = parse_study(study_template("mine"), "mine.toml")
    first, second = study.conditions
    assert first == Condition(name="coverage-10", seed=1, pair=True)
    assert second.arena.start == "center"
    assert study.about == StudySection(name="mine")


def test_every_setting_stands_in_the_template():
    text = study_template("mine")
    for model in (StudySection, ReportSection, ConditionNotes, *SECTIONS.values()):
        for key, info in model.model_fields.items():
            if is_hidden(info):
                continue
            assert re.search(rf"^(# )?{key} = ", text, re.MULTILINE), (model, key)


def test_settings_shown_as_defaults_can_be_switched_on_and_change_nothing():
    text = study_template("mine")
    until_conditions = text.split("[[condition]]")[0]
    on = re.sub(r"^# (\w+ = )", r"\1", until_conditions, flags=re.MULTILINE)
    assert on != until_conditions
    rest = text[len(until_conditions) :]
    assert parse_study(on + rest, "on.toml").conditions == parse_study(text, "off.toml").conditions


def test_every_line_of_the_template_can_be_switched_on():
    """`baseline = ""` named a condition that there is not."""
    on = re.sub(r"^# (\w+ = )", r"\1", study_template("mine"), flags=re.MULTILINE)
    study = parse_study(on, "on.toml")
    assert study.notes[0].published == [0.154, 0.222, 0.166]
    assert study.notes[1].baseline == study.conditions[0].name


@pytest.mark.parametrize("source", named_studies())
def test_a_copy_is_the_study_by_another_name(source):
    study, copy = load_study(source), parse_study(study_template("mine", source), "mine.toml")
    assert copy.conditions == study.conditions
    assert (copy.about.name, copy.about.title) == ("mine", "mine")


@pytest.mark.parametrize("name", ["", "a b", 'a"b', "a\n", "ä", "x" * 81, None])
def test_a_name_that_no_study_can_have_is_refused(name):
    """The file that came could not be read again."""
    with pytest.raises(ValueError, match="expected at most 80 letters"):
        study_template(name)
