"""What distances weigh: the bias that the paper found, the one that it missed, and distances that have neither."""

from __future__ import annotations

import itertools
import json
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from realitygap.errors import RecordError
from realitygap.evolution import DISTANCES, sorted_cells_distance
from realitygap.records import ResultsFolder
from realitygap.report import NARROW, audit_distance, distance_notes, draw_distance, save_distance
from realitygap.report._distance_audit import changed_walk, random_walk, weight_bias
from realitygap.study import run_study

pytestmark = pytest.mark.slow

STUDY = """
[study]
name = "small"
replicates = 8
[[condition]]
name = "novelty"
selection = "novelty"
[[condition]]
name = "random"
selection = "random"
noise = 0.8
"""


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> ResultsFolder:
    folder = tmp_path_factory.mktemp("study")
    (folder / "small.toml").write_text(STUDY)
    return run_study(folder / "small.toml", folder / "results").folder


@pytest.fixture(scope="module")
def audits():
    return {name: audit_distance(name, n_walks=150, n_pairs=800) for name in DISTANCES}


def test_low_numbered_cells_weigh_most_in_the_papers_distance_alone(audits):
    """Its authors' own finding (section 4); three standard errors are far from the other side of each bound."""
    paper = audits["paper"]
    assert weight_bias(paper) == 1
    assert paper.front_over_back.low > 2.5
    assert paper.order_correlation.high < -0.97
    assert paper.leverage[0, 0] > 3 * paper.leverage[5, 11]
    for name in set(DISTANCES) - {"paper"}:
        assert weight_bias(audits[name]) == 0, name


def test_sorted_the_other_way_the_lower_rows_weigh_most():
    audit = audit_distance("paper", n_walks=80, n_pairs=10, sort="y-then-x")
    assert weight_bias(audit) == 1
    rows = audit.leverage.mean(axis=1)
    assert (np.diff(rows) < 0).all()
    assert np.ptp(audit.leverage.mean(axis=0)) < 0.2 * np.ptp(rows)


def test_the_papers_distance_is_nearly_one_of_lengths_and_jaccards_is_not(audits):
    """The second bias: Spearman's correlation near 0.94 on random walks."""
    found = {name: audit.confounds[0].correlation for name, audit in audits.items()}
    assert 0.91 < found["paper"].value < 0.97
    assert found["paper"].low > 0.9
    assert found["ordered"].low > 0.8
    assert found["jaccard"].high < 0.4
    assert found["alignment"].high < 0.4
    assert abs(found["final"].value) < 0.15
    assert audits["paper"].confounds[0].shared > 8 * audits["jaccard"].confounds[0].shared


def test_a_weight_is_the_mean_distance_to_the_walk_with_the_cell_changed():
    audit = audit_distance("paper", n_walks=10, n_pairs=10, seed=3)
    rng = np.random.default_rng(3)
    walks = [random_walk(rng, 12, 6, 0.6) for _ in range(20)][:10]
    for cell in (0, 40, 71):
        apart = [sorted_cells_distance(walk, sorted(set(walk) ^ {cell})) for walk in walks]
        row, column = divmod(cell, 12)
        assert audit.leverage[row, column] == pytest.approx(np.mean(apart))
        assert audit.leverage_low[row, column] <= np.mean(apart) <= audit.leverage_high[row, column]


@pytest.mark.parametrize(
    ("walk", "cell", "expected"),
    [
        ([1, 2, 1, 0], 1, [2, 0]),
        ([5, 6, 5, 6, 7], 19, [5, 6, 5, 6, 7, 19]),  # above cell 7
        ([5, 6, 5], 18, [5, 6, 18, 5]),
        ([5], 5, []),
    ],
)
def test_a_cell_is_taken_out_of_a_walk_or_put_in_as_a_detour(walk, cell, expected):
    assert changed_walk(walk, cell, 12) == expected


@pytest.mark.parametrize("straight", [0.0, 0.6, 1.0])
def test_a_random_walk_goes_from_cell_to_next_cell(straight):
    rng = np.random.default_rng(1)
    walks = [random_walk(rng, 12, 6, straight) for _ in range(50)]
    for walk in walks:
        assert 2 <= len(walk) <= 88
        for one, other in itertools.pairwise(walk):
            (y, x), (v, u) = divmod(one, 12), divmod(other, 12)
            assert abs(x - u) + abs(y - v) == 1
    assert len({walk[0] for walk in walks}) > 25


def test_an_audit_is_a_function_of_its_seed(audits):
    again = audit_distance("jaccard", n_walks=150, n_pairs=800)
    assert again.to_dict() == audits["jaccard"].to_dict()
    assert audit_distance("jaccard", n_walks=150, n_pairs=800, seed=2).to_dict() != again.to_dict()


def test_trials_of_a_study_are_compared_run_against_run(study):
    audit = audit_distance("jaccard", study, n_walks=10, n_pairs=60)
    assert [each.of for each in audit.confounds] == ["random walks", "novelty", "random"]
    assert [each.label for each in audit.confounds] == ["", "SIM", "SIM"]
    for each in audit.confounds[1:]:
        assert 40 < each.n_pairs <= 60
        assert 1 <= each.mean_cells <= 72
        assert 0 <= each.contained <= 1
    assert json.loads(json.dumps(audit.to_dict()))["confounds"][1]["of"] == "novelty"


def test_notes_of_an_audit_name_the_data_behind_them(study):
    notes = distance_notes(audit_distance("paper", study, n_walks=60, n_pairs=200))
    assert "low-numbered cells weigh most" in notes[2]
    assert notes[3].startswith("Length, random walks: Spearman's correlation")
    assert notes[4].startswith("Length, SIM, novelty:")
    assert "60 random walks" in notes[-1]
    assert "seed 1" in notes[-1]
    plain = distance_notes(audit_distance("hamming", n_walks=10, n_pairs=20))
    assert plain[2] == "Weight: all cells weigh the same, 1."


@pytest.mark.parametrize("width", [9.6, NARROW])
@pytest.mark.parametrize("name", ["paper", "final"])
def test_the_drawing_has_a_number_in_each_cell(audits, name, width):
    root = ET.fromstring(draw_distance(audits[name], width=width).svg)
    texts = ["".join(each.itertext()).strip() for each in root.iter() if each.tag.endswith("text")]
    weights = [f"{weight:.1f}" for weight in audits[name].relative_leverage.ravel()]
    assert all(texts.count(each) >= weights.count(each) for each in set(weights))
    assert f"What each cell weighs: {name}" in texts


def test_conditions_are_drawn_and_the_file_stands_alone(study, tmp_path):
    audit = audit_distance("edit", study, n_walks=10, n_pairs=60)
    path = save_distance(audit, tmp_path / "edit.svg")
    text = path.read_text("utf-8")
    assert "SIM, novelty" in text
    assert "Used: 10 random walks" in text
    assert text == save_distance(audit, tmp_path / "again.svg").read_text("utf-8")


def test_an_audit_refuses_wrong_input(study, tmp_path):
    with pytest.raises(ValueError, match="Unknown distance 'jacard'"):
        audit_distance("jacard")
    with pytest.raises(ValueError, match="n_walks is 3, expected 10 to"):
        audit_distance("paper", n_walks=3)
    with pytest.raises(ValueError, match="straight is 2"):
        audit_distance("paper", straight=2)
    with pytest.raises(
        ValueError, match="compares where trials ended, which the rows of a study do not hold"
    ):
        audit_distance("final", study, n_walks=10, n_pairs=10)
    with pytest.raises(RecordError, match="does not exist"):
        audit_distance("paper", tmp_path / "none", n_walks=10, n_pairs=10)
