"""The mistakes in the paper's own numbers, which its page lists."""

from __future__ import annotations

import sys
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parents[1] / "docs"))  # as for a script that runs there

from paper_audit import TABLE_2, audit_paper, largest_of_uniform, steps_for, table_2

from tests.kernels.noisy import largest_noisy

EXAMPLE = Path(__file__).parents[1] / "examples" / "table-2.csv"


def test_example_is_the_papers_table():
    lines = [line.rsplit(",", 2) for line in EXAMPLE.read_text("utf-8").splitlines()[1:]]
    assert lines == [[name, str(k), text] for name, texts in TABLE_2.items() for k, text in enumerate(texts)]


def test_70_steps_and_the_count_that_gives_87():
    found = audit_paper()[0]
    assert "69.8: 70 steps" in found.found
    assert "4 moves long" in found.found
    assert "15.75" in found.found
    assert "= 87.3" in found.found
    assert round(steps_for(Fraction("13.75"), Fraction("19.7"))) == 70


def test_every_point_of_the_audit_is_there():
    text = " ".join(f"{each.section} {each.printed} {each.found} {each.bearing}" for each in audit_paper())
    for part in (
        "0.5 m = 19.69 in", "7.87 in", ".154 (11/72 = .1528)", ".432 (31/72 = .4306)", ".166 (12/72 = .1667)",
        ".180 (13/72 = .1806)", "is 1/2 on average", "+0.05, +0.25, +0.40", "below 0.10", "corrected 0.60",
        "Table 2.1", "Table 3.2", "Leyden", "Jakobi", "Two gaps", "bias input",
    ):  # fmt: skip
        assert part in text


def test_largest_of_three_uniform_numbers_is_a_half_on_average():
    assert largest_of_uniform(1) == 0
    assert float(largest_of_uniform(3)) == 0.5
    # 200,000 draws with a standard deviation of 0.39: off by more than 0.005 less than once in a million times
    drawn = np.random.default_rng(3).uniform(-1, 1, (200_000, 3)).max(axis=1).mean()
    assert drawn == pytest.approx(0.5, abs=0.005)


def test_the_offset_is_that_of_the_simulated_sensors():
    values = largest_noisy([0.5] * 3, 0.8, 20_000)
    # 20,000 steps with a standard deviation of 0.31: off by more than 0.011 less than once in a million times
    assert np.mean(values) - 0.5 == pytest.approx(0.8 * 0.5, abs=0.011)


def test_table_2_of_the_paper_is_read_as_numbers():
    assert table_2()["Physical robot"].tolist() == [0.431, 0.583, 0.333]
