"""Orders of calibrations, and calibrations that are made again."""

import json

import pytest

from realitygap.orders import CalibrateOrder, OrderError, read_order
from realitygap.study import make_calibration
from realitygap.world import load_calibration
from tests.commands import run_command as realitygap


@pytest.mark.parametrize(
    ("values", "field"),
    [
        ({}, "robot"),
        ({"robot": "sim", "data": ("x.jsonl",)}, "robot"),
        ({"data": ("x.jsonl",), "choose": True}, "data"),
        ({"robot": "sim", "out": "fit.txt"}, "out"),
        ({"data": ("x.csv",), "radius_mm": 27.5}, "radius_mm"),
        ({"data": ("x.csv",), "step": 0.1}, "step"),
    ],
)
def test_settings_that_exclude_each_other_are_refused_at_their_field(values, field):
    with pytest.raises(OrderError) as error:
        CalibrateOrder(**{"what": "path", "out": "fit.toml"} | values)
    assert list(error.value.problems) == [field]


@pytest.mark.slow
def test_calibration_states_its_order_and_is_repeated_from_it(tmp_path):
    out = tmp_path / "fit.toml"
    made = make_calibration("path", robot="sim", budget=4, seed=2, out=out)
    order = CalibrateOrder(what="path", robot="sim", budget=4, seed=2, out=out)
    assert load_calibration(out).order == made.order == order.record()
    assert read_order(out).record() == order.record()
    done = realitygap("again", "fit.toml", "-o", "second.toml", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    second = load_calibration(tmp_path / "second.toml")
    assert (second.numbers, second.order) == (load_calibration(out).numbers, made.order)
    assert json.loads(done.stdout)["order"] == made.order
