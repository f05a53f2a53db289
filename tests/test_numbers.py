"""Numbers as texts for people."""

import pytest

from realitygap._wording import fixed, significant
from realitygap.cli._robot import _row
from realitygap.world import length_text


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (4381.2, 3, "4,380"), (-4381.2, 3, "-4,380"), (0.00317, 3, "0.00317"), (22.0, 3, "22"), (999.7, 3, "1,000"),
        (0, 3, "0"), (52_614_339, 4, "52,610,000"), (1e18, 3, "1e+18"), (float("nan"), 3, "nan"),
        (float("inf"), 3, "inf"), (150.0, 2, "150"),
    ],
)  # fmt: skip
def test_numbers_have_no_exponent_that_people_would_have_to_resolve(value, digits, text):
    assert significant(value, digits) == text


def test_zeros_show_how_exact_a_number_is():
    assert [significant(value, 4, keep_zeros=True) for value in (0.5, 250.0, 999.0, 1234.0, 100_000)] == [
        "0.5000", "250.0", "999.0", "1,234", "100,000",
    ]  # fmt: skip


def test_no_number_fills_the_screen_with_digits():
    texts = {0.25: "0.250", -1e6: "-1000000.000", 1e300: "1e+300", float("inf"): "inf"}
    assert {value: fixed(value, 3) for value in texts} == texts
    assert length_text(1e300) == "1e+300 m"
    line = {"kind": "call", "name": "drive", "t": 1e300, "values": {"move": 1e300}}
    assert _row(line) == ("1e+300", "call", "drive", "move 1e+300")
