"""Orders of gaps, and gaps that are measured again."""

import json

import pytest

from realitygap.errors import StudyError
from realitygap.orders import GapOrder, OrderError, read_order
from realitygap.report import write_gap_report
from realitygap.study import gap_between
from realitygap.world import paper_arena
from tests.commands import run_command as realitygap

SMALL = {"sim": "sim", "target": "sim", "n_controllers": 3, "trials": 2}


@pytest.mark.parametrize(
    ("values", "text"), [({"noise": 0.5}, "noise is 0.5"), ({"trials": 1}, "at least 2 trials")]
)
def test_why_is_refused_with_settings_that_exclude_it(values, text):
    with pytest.raises(OrderError, match=text) as error:
        GapOrder(sim="sim:fit.toml", target="sim", why=True, **values)
    assert list(error.value.problems) == ["why"]


def test_function_takes_the_order_or_its_fields(tmp_path):
    by_order = gap_between(GapOrder(**SMALL))
    by_fields = gap_between("sim", "sim", n_controllers=3, trials=2)
    assert by_order.order == by_fields.order == GapOrder(**SMALL)
    assert by_order.study.result.to_json() == by_fields.study.result.to_json()


def test_gap_in_an_arena_without_a_name_has_no_order_to_repeat(tmp_path):
    gap = gap_between("sim", "sim", n_controllers=2, trials=1, arena=paper_arena())
    assert gap.order is None
    page = write_gap_report(gap, tmp_path / "gap.html")
    with pytest.raises(StudyError, match="does not state how it was made"):
        read_order(page)


@pytest.mark.slow
def test_again_repeats_a_gap_from_its_page_and_from_its_json(tmp_path):
    words = ("gap", "sim", "sim", "--n-controllers", "3", "--trials", "2", "--seed", "5")
    first = realitygap(*words, "--report", "gap.html", "--json", cwd=tmp_path)
    (tmp_path / "gap.json").write_text(first.stdout)
    for file in ("gap.html", "gap.json"):
        again = realitygap("again", file, "--report", "gap.html", "--json", cwd=tmp_path)
        assert json.loads(again.stdout) == json.loads(first.stdout), again.stderr
    more = json.loads(realitygap("again", "gap.json", "--trials=3", "--json", cwd=tmp_path).stdout)
    assert more["order"] == {**json.loads(first.stdout)["order"], "trials": 3}


@pytest.mark.parametrize(
    ("file", "content", "text"),
    [
        ("nothing.html", None, "No such file"),
        ("page.html", "<html></html>", "does not state how it was made"),
        ("fit.toml", "[order]\ncommand = 'gab'\n", "Did you mean 'gap'"),
        ("fit.toml", "[order]\ncommand = 'gap'\nsim = 'sim'\ntarget = '--report=x'\n", "expected a name"),
        ("fit.toml", "[order]\ncommand = 'gap'\nsim = 'sim'\ntarget = 'sim'\ntrials = 0\n", "trials is 0"),
        ("fit.json", "[1", "cannot be read"),
        ("fit.json", "[1]", "does not state how it was made"),
    ],
)
def test_file_without_an_order_that_can_be_carried_out_is_refused(file, content, text, tmp_path):
    if content is not None:
        (tmp_path / file).write_text(content)
    with pytest.raises(StudyError, match=text):
        read_order(tmp_path / file)
