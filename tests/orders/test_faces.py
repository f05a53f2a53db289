"""All faces of an order have the same fields, defaults, and refusals."""

import inspect
import json
import math
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

import realitygap.study
from realitygap.cli import app
from realitygap.lab._mistakes import Mistakes
from realitygap.orders import ORDERS, OrderError, read_order
from realitygap.settings import MISSING

FUNCTIONS = {
    "calibrate": "make_calibration",
    "close": "close_gap",
    "estimate": "estimate_score",
    "compare": "compare_scores",
    "gap": "gap_between",
    "plan": "plan_gap",
    "transfer": "run_transfer",
    "try": "try_genome",
}
SMALLEST = {
    "calibrate": {"what": "path", "robot": "sim", "out": "fit.toml"},
    "close": {"sim": "sim", "target": "twin:worn.toml"},
    "estimate": {"sim": "sim", "target": "jyro"},
    "compare": {"table": "scores.csv"},
    "gap": {"sim": "sim", "target": "jyro"},
    "plan": {"effect": 0.1},
    "transfer": {"study": "sim-paper", "to": "jyro"},
    "try": {"genome": "champion.json", "on": "sim"},
}
"""Values of the smallest order."""

WITH = {
    "calibrate": {
        "what": {"what": "motion"},
        "data": {"robot": None},
        "radius_mm": {"what": "sensors"},
        "step": {"what": "motion"},
        "drop_bad_rows": {"what": "motion"},
        "out": {"out": "there.toml"},
    },
    "close": {},
    "estimate": {"range": {"range": "0:100"}, "minus": {"of": "A"}},
    "compare": {"range": {"range": "0:100"}},
    "gap": {},
    "plan": {
        "margin": {"effect": None},
        "correlation": {"effect": None, "correlation": 0.9},
        "alpha": {"sequential": True},
    },
    "transfer": {},
    "try": {
        name: {"against": "other.json", "trials": 40, "out": "pairs.sqlite"}
        for name in ("against", "margin", "null", "alpha", "blind")
    },
}
"""Values that a field needs with it."""

ONLY_IN_THE_COMMAND = {
    "calibrate": {"camera", "figure", "allow_code", "as_json"},
    "close": {"allow_code", "as_json", "open_page"},
    "estimate": {"camera", "allow_code", "as_json"},
    "compare": {"report", "full", "as_json"},
    "gap": {"camera", "report", "full", "allow_code", "as_json"},
    "plan": {"allow_code", "as_json"},
    "transfer": {"allow_code", "as_json"},
    "try": {"allow_code", "as_json"},
}
"""Options of a command that choose how its result is shown, or who is at the robot."""

NOT_IN_THE_FORM = {
    "calibrate": {"what", "out", "data", "map_file", "hold_out", "radius_mm", "step", "drop_bad_rows"},
    "gap": {"results", "processes"},
}
"""Fields of files that the lab names, of fits without a robot, and what cards of the page choose."""

COMMANDS = typer.main.get_command(app).commands


@pytest.fixture(params=ORDERS)
def name(request):
    return request.param


def wrong_values(field):
    """Yield values beyond the limits of a field, as a command gets them."""
    if field.choices:
        yield "no such choice"
    if field.kind in (int, float):
        yield "nan" if field.kind is float else "1.5"
    if field.limits.low is not None:
        yield str(field.limits.low - 1)
    if field.limits.low is not None and not field.limits.low_is_allowed:
        yield str(field.limits.low)
    if field.limits.high is not None:
        yield str(field.limits.high + 1)


def test_command_has_the_fields_with_their_defaults_ranges_and_help(name):
    options = {parameter.name: parameter for parameter in COMMANDS[name].params}
    fields = {field.name: field for field in ORDERS[name].fields()}
    assert set(options) == set(fields) | ONLY_IN_THE_COMMAND[name]
    for key, field in fields.items():
        option = options[key]
        assert option.required == field.is_required, key
        assert field.is_required or option.default == field.default, key
        assert option.help.startswith(field.help), key
        assert field.face.default_is in option.help, key
        assert option.opts == ([key] if field.face.is_argument else list(field.options)), key
        assert option.max == field.limits.high, key
    assert COMMANDS[name].help == ORDERS[name].help_text()


def test_function_has_the_fields_with_their_defaults_and_help(name):
    function = getattr(realitygap.study, FUNCTIONS[name])
    parameters = inspect.signature(function).parameters
    for field in ORDERS[name].fields():
        parameter = parameters[field.name]
        assert (parameter.default is parameter.empty) == field.is_required, field.name
        assert field.is_required or parameter.default == field.default, field.name
        assert f"    {field.name}: " in function.__doc__, field.name


def test_transfer_to_an_open_target_has_the_fields_of_its_order():
    parameters = inspect.signature(realitygap.study.transfer).parameters
    fields = {field.name: field for field in ORDERS["transfer"].fields()}
    assert set(fields) - set(parameters) == {"to", "strategy", "processes", "witness"}
    for key in set(fields) & set(parameters) - {"study", "budget", "out"}:
        assert parameters[key].default == fields[key].default, key
        assert f"    {key}: " in realitygap.study.transfer.__doc__, key


def test_form_has_every_other_field(name):
    without = {field.name for field in ORDERS[name].fields() if not field.face.label}
    assert name not in NOT_IN_THE_FORM or without == NOT_IN_THE_FORM[name]


def test_every_face_refuses_the_same_values(name, tmp_path):
    model, required = ORDERS[name], SMALLEST[name]
    words = model(**required).words()
    n_wrong = 0
    for field in model.fields():
        for wrong in wrong_values(field):
            n_wrong += 1
            done = CliRunner().invoke(app, [*words, f"{field.word}={wrong}"])
            assert done.exit_code != 0, (field.name, wrong)
            number = float(wrong) if field.kind in (int, float) else wrong
            value = (number,) if field.is_list else number
            for make in (model, getattr(realitygap.study, FUNCTIONS[name])):
                with pytest.raises(OrderError) as error:
                    make(**{**required, field.name: value})
                (place,) = error.value.problems
                assert place.partition("[")[0] == field.name, (field.name, wrong)
            if not field.choices:
                assert not field.limits.allow(number), (field.name, wrong)
            mistakes = Mistakes()
            mistakes.in_order(model, {**required, field.name: value}, tmp_path)
            assert field.name in mistakes.problems or field.is_list, (field.name, wrong)
    assert n_wrong >= 5


def test_missing_unknown_and_several_wrong_values_are_all_named(name):
    with pytest.raises(OrderError) as error:
        ORDERS[name](seedd=1)
    required = {field.name for field in ORDERS[name].fields() if field.is_required}
    assert {*required, "seedd"} == set(error.value.problems)
    assert error.value.problems["seedd"].endswith("Did you mean 'seed'?")
    assert all(error.value.problems[key] == MISSING for key in required)


def test_seed_fits_into_64_bits(name):
    largest = {**SMALLEST[name], "seed": 2**63 - 1}
    assert ORDERS[name](**largest).seed == 2**63 - 1
    with pytest.raises(OrderError, match="seed is 9223372036854775808, expected at most"):
        ORDERS[name](**{**largest, "seed": 2**63})


def other_value(field):
    """Return an allowed value that is not the default."""
    if field.kind is bool:
        return not field.default
    if field.choices:
        return next(choice for choice in field.choices if choice != field.default)
    if field.kind in (int, float):
        near = min(field.kind(field.limits.low or 0) + 1, field.limits.high or math.inf)
        return near if near != field.default else near + 1
    return Path("there.toml") if field.kind is Path else "there"


def other_orders(name):
    """Yield orders that each have one value other than the default."""
    for field in ORDERS[name].fields():
        value = other_value(field)
        value = (value,) if field.is_list else value
        yield ORDERS[name](**{**SMALLEST[name], field.name: value, **WITH[name].get(field.name, {})})


def test_message_to_a_worker_makes_the_same_order(name):
    for order in other_orders(name):
        assert type(order)(**json.loads(json.dumps(order.message()))) == order


def test_record_in_a_file_makes_the_same_order_without_its_outputs(name, tmp_path):
    for number, order in enumerate(other_orders(name)):
        outputs = {field.name: None for field in order.fields() if field.face.is_output}
        bare = order.model_copy(update=outputs)
        toml, page = tmp_path / f"{number}.toml", tmp_path / f"{number}.html"
        data = tmp_path / f"{number}.json"
        toml.write_text(order.to_toml())
        page.write_text(f'<html><pre id="order">{order.to_toml()}</pre></html>')
        data.write_text(json.dumps({"verdict": 1, "order": order.record()}))
        for path in (toml, page, data):
            assert read_order(path).record() == bare.record()


def test_words_of_an_order_are_the_command_that_makes_it(name):
    for order in other_orders(name):
        command, *words = order.words()
        context = COMMANDS[command].make_context(command, words)
        fields = [field.name for field in order.fields()]
        assert type(order)(**{key: context.params[key] for key in fields}) == order
