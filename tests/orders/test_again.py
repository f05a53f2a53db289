"""Plans and trials of one controller that are repeated from their JSON."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from realitygap.cli import app
from realitygap.errors import StudyError
from realitygap.evolution import NeatSettings, Population
from realitygap.orders import CloseOrder, OrderError, PlanOrder, read_order
from realitygap.study import plan_gap
from tests.commands import run_command as realitygap

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    "words",
    ["try champion.json --on sim --steps 5 --seed 3", "plan --correlation 0.9 --least 0.7 --seed 2"],
)
def test_again_repeats_a_command_from_its_json(words, tmp_path):
    settings = NeatSettings.named("rosenzweig-remy", population=2)
    Population(3, 2, settings, seed=5).ask()[0].save(tmp_path / "champion.json")
    first = realitygap(*words.split(), "--json", cwd=tmp_path)
    assert first.returncode == 0, first.stderr
    (tmp_path / "result.json").write_text(first.stdout)
    again = realitygap("again", "result.json", "--json", cwd=tmp_path)
    assert json.loads(again.stdout) == json.loads(first.stdout), again.stderr
    assert read_order(tmp_path / "result.json").words() == words.split()


def test_again_repeats_a_folder_next_to_it_unless_another_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("closed", "closed-2"):
        Path(name).mkdir()
        Path(name, "order.toml").write_text(CloseOrder(sim="jyro", target="sim").to_toml())  # is refused
    for words, out in (
        (["closed"], "--out closed-3"),
        (["closed/"], "--out closed-3"),
        (["closed-2"], "--out closed-2-2"),
        (["closed", "-o", "mine"], "-o mine"),
    ):
        done = CliRunner().invoke(app, ["again", *words])
        assert done.stderr.splitlines()[0] == f"realitygap close jyro sim {out}"
        assert isinstance(done.exception, StudyError)


def test_question_and_its_value_are_short_for_a_field_of_that_name():
    assert plan_gap("effect", 0.05, trials=[2]) == plan_gap(effect=0.05, trials=[2])
    assert PlanOrder.by_place("margin", 0.1) == {"margin": 0.1}
    with pytest.raises(OrderError, match="question is 'size', expected one of effect, margin, correlation"):
        PlanOrder.by_place("size", 0.1)
