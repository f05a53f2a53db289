"""Plans from a pilot, or from trials that were observed."""

import math

import pytest

from realitygap.errors import StudyError
from realitygap.study import (
    open_target,
    plan_gap,
    recorded_spreads,
    sample_controllers,
)
from realitygap.study._gap.plan import Spreads, pilot_spreads
from realitygap.study._gap.study import study_gap
from realitygap.world import paper_arena

pytestmark = pytest.mark.slow


def test_a_pilot_tells_how_trials_and_controllers_vary():
    found = pilot_spreads(1)
    assert 0 < found.noise < found.controllers < 0.5
    assert "30 random controllers" in found.origin


def test_observed_trials_tell_the_same(tmp_path):
    path, arena = tmp_path / "trials.sqlite", paper_arena()
    controllers = sample_controllers("random", 30, 1)
    study_gap(
        open_target("sim", arena, key=1),
        open_target("sim", arena, key=2),
        controllers,
        trials=6,
        results=path,
    )
    found, pilot = recorded_spreads(str(path)), pilot_spreads(1)
    assert found.controllers == pytest.approx(pilot.controllers, rel=0.2)
    assert found.noise == pytest.approx(pilot.noise, rel=0.5)


def test_a_larger_effect_takes_fewer_controllers_and_the_best_row_the_fewest_trials():
    spreads = pilot_spreads(1)
    small, large = (plan_gap("effect", each, spreads=spreads) for each in (0.03, 0.1))
    assert small.needed[0].controllers > large.needed[0].controllers
    assert small.best.on_target == min(row.on_target for row in small.needed)


@pytest.mark.parametrize("value", [0.0, -0.05, math.nan, math.inf])
@pytest.mark.parametrize("question", ["effect", "margin", "correlation"])
def test_plan_refuses_a_value_out_of_range_before_its_pilot(question, value, monkeypatch):
    refuse_pilots(monkeypatch)
    with pytest.raises(StudyError, match=f"{question} is {value}"):
        plan_gap(question, value)


@pytest.mark.parametrize(
    ("setting", "value"),
    [("power", 1.0), ("least", 0.95), ("spread", -0.1), ("spread", math.nan), ("trials", (5, 0))],
)
def test_plan_refuses_a_setting_out_of_range_before_its_pilot(setting, value, monkeypatch):
    refuse_pilots(monkeypatch)
    with pytest.raises(StudyError, match=f"{setting} is"):
        plan_gap("correlation", 0.9, **{setting: value})
    with pytest.raises(StudyError, match="question is 'size'"):
        plan_gap("size", 0.1)


def refuse_pilots(monkeypatch):
    def pilot(*_):
        pytest.fail("A pilot was made for a question that cannot be answered.")

    monkeypatch.setattr("realitygap.study._gap.plan.pilot_spreads", pilot)


def test_plan_for_a_tiny_effect_is_a_table_without_controllers():
    plan = plan_gap("effect", 1e-9, spreads=Spreads(0.02, 0.1, "a test"))
    assert [row.controllers for row in plan.needed] == [None] * len(plan.needed)
    assert plan.best is None


def test_plan_refuses_goals_that_cannot_be_reached():
    spreads = pilot_spreads(1)
    with pytest.raises(StudyError, match="effect is -1"):
        plan_gap("effect", -1.0, spreads=spreads)
    with pytest.raises(StudyError, match="least"):
        plan_gap("correlation", 0.4, spreads=spreads)
