"""Messages name a setting as its caller wrote it: an argument of a function, an option, or a label of a form."""

import inspect
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

import realitygap
import realitygap.study
from realitygap._caller import COMMAND, as_given, called_by
from realitygap.cli import app
from realitygap.errors import RealityGapError, StudyError
from realitygap.lab._mistakes import form_caller
from realitygap.orders import ORDERS
from tests.orders.test_faces import FUNCTIONS, SMALLEST

OPTION = re.compile(r"(?<![\w-])--?[a-z][a-z-]*")
COMMANDS = re.compile(r"`[^`]*`|realitygap [a-z][^;`)]*")
"""Commands to type have options."""


def refused(function, *args, **values):
    """Return the message with which a function refuses its arguments."""
    with pytest.raises((RealityGapError, TypeError, ValueError)) as error:
        function(*args, **values)
    return str(error.value)


def wrong_values(field):
    """Yield values of a wrong type, and a number out of range."""
    number = "5" if field.kind in (int, float) else 5 if field.kind is not bool else "maybe"
    yield (number,) if field.is_list else number
    if field.limits.low is not None:
        yield (field.limits.low - 1,) if field.is_list else field.limits.low - 1
    if field.choices:
        yield "no such choice"


@pytest.mark.parametrize("name", ORDERS)
def test_functions_name_the_argument_of_a_wrong_value(name):
    function = getattr(realitygap.study, FUNCTIONS[name])
    n_wrong = 0
    for field in ORDERS[name].fields():
        for wrong in wrong_values(field):
            n_wrong += 1
            message = refused(function, **{**SMALLEST[name], field.name: wrong})
            assert re.match(rf"{field.name}\b", message), (field.name, wrong, message)
            assert not OPTION.search(message), message
    assert n_wrong > len(ORDERS[name].fields())


CONFLICTS = {
    "calibrate": [
        {"what": "nothing"},
        {"what": "track", "robot": None},
        {"choose": True},
        {"data": ("x.csv",), "robot": None, "witness": "x:1"},
        {"radius_mm": 20.0},
        {"step": 0.1},
        {"out": "fit.txt"},
        {"what": "motion"},
    ],
    "close": [{"budget": 1}, {"target": "jyro", "observe": "cells", "what": "contact"}, {"task": "nothing"}],
    "gap": [
        {"why": True},
        {"why": True, "noise": 0.1},
        {"task": "nothing"},
        {"randomize": "posterior"},
        {"reevolved": "random", "n_controllers": 2},
        {"target": "recorded:nowhere.sqlite"},
    ],
    "plan": [{"effect": None}, {"margin": 0.1}, {"effect": None, "correlation": 0.3}],
    "transfer": [{"strategy": ("none",)}],
}
"""Settings that do not go together."""


@pytest.mark.parametrize("name", ORDERS)
def test_functions_name_no_option_if_settings_do_not_go_together(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    function = getattr(realitygap.study, FUNCTIONS[name])
    for values in CONFLICTS.get(name, ()):
        message = COMMANDS.sub("", refused(function, **{**SMALLEST[name], **values}))
        assert not OPTION.search(message), message


@pytest.mark.parametrize("name", ["calibrate", "gap"])
def test_commands_name_the_option(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    wrong = {"calibrate": {"what": "all", "choose": True, "budget": 1}, "gap": {"why": True}}[name]
    order = ORDERS[name](**{**SMALLEST[name], **wrong})
    done = CliRunner().invoke(app, order.words())
    assert f"--{list(wrong)[-1]}" in str(done.exception)


def test_a_caller_is_forgotten_and_commands_to_type_stay():
    text = "Name another folder (--out DIR), or restart (`realitygap run --fresh`). --hold-out is 3."
    assert (
        as_given(text)
        == "Name another folder (out=DIR), or restart (`realitygap run --fresh`). hold_out is 3."
    )
    with called_by(COMMAND):
        assert str(StudyError(text)) == text
    assert str(StudyError("--n-controllers is 3.")) == "n_controllers is 3."
    with called_by(form_caller()):
        assert (
            as_given("--n-controllers is 3 (--trials 2).") == "Controllers is 3 (Trials per controller: 2)."
        )
    assert as_given("realitygap gap sim jyro -o FILE") == "realitygap gap sim jyro -o FILE"


@pytest.mark.parametrize(
    ("verb", "values", "name"),
    [
        ("load_study", {"replicates": "5"}, "replicates"),
        ("load_study", {"replicates": 0}, "replicates"),
        ("load_study", {"seed": -1}, "seed"),
        ("load_study", {"seed": True}, "seed"),
        ("load_study", {"randomize": "maybe"}, "randomize"),
        ("load_study", {"randomize": "posterior"}, "randomize"),
        ("run_study", {"replicates": "5"}, "replicates"),
        ("run_study", {"seed": 0.5}, "seed"),
        ("run_study", {"threads": 0}, "threads"),
        ("run_study", {"chunk": "2"}, "chunk"),
        ("run_study", {"cluster": 5}, "cluster"),
        ("drive_study", {"port": "emulator://s2", "replicates": 0}, "replicates"),
    ],
)
def test_verbs_of_studies_name_the_argument(verb, values, name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    message = refused(getattr(realitygap, verb), "paper", **values)
    assert re.match(rf"{name}\b", message), message
    assert name in inspect.signature(getattr(realitygap, verb)).parameters
    assert not Path("results").exists()


def test_a_study_names_the_replicates_of_its_run():
    study = realitygap.load_study("paper")
    for wrong in ("5", 0, 2.5):
        assert refused(study.run, replicates=wrong).startswith("replicates is ")


def test_values_without_a_name_are_counted():
    assert "at most 2" in refused(realitygap.measure_gap, "sim", "jyro", 3)


def test_a_number_of_controllers_is_explained():
    message = refused(realitygap.measure_gap, "sim", "jyro", controllers=5)
    assert message.endswith("Their number is n_controllers.")
    assert "expected a text: random" in message
