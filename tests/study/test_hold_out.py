"""The verdict on a fit by its errors on what it did not see, for every calibration with held-out data."""

from realitygap.calibration import Fit
from realitygap.study._calibrate.hold_out import FITTED, NOISE, NOMINAL, TABLE, Compared, chosen_parts

PARTS = Fit((), {"drive.gain_left": 1.1}, {"drive.gain_left": [1.1]}, "given", reasons=("Windows disagree.",))


def judged(fitted: float, nominal: float, table: float | None) -> Fit:
    errors = {FITTED: fitted, NOMINAL: nominal, NOISE: 2 * nominal}
    errors |= {} if table is None else {TABLE: table}
    return chosen_parts(PARTS, Compared("mean distance", "m", 9, errors), {"drive.speed": 0.2})


def test_verdict_names_the_numbers_that_stay_and_a_lookup_table_that_is_better():
    for fitted, nominal, table, stays, is_worse in (
        (0.1, 0.2, 0.3, False, False),
        (0.1, 0.2, None, False, False),
        (0.1, 0.2, 0.05, False, True),
        (0.2, 0.1, 0.3, True, False),
        (0.2, 0.1, 0.15, True, False),
        (0.2, 0.1, 0.05, True, True),
        (0.0, 0.0, 0.0, True, False),
    ):
        case = fitted, nominal, table
        parts = judged(*case)
        assert (parts.numbers == {"drive.speed": 0.2}) == stays, case
        assert ("stay" in parts.verdict) == stays, case
        assert ("worse than a lookup table" in parts.verdict) == is_worse, case
        assert parts.reasons[-1] == "Windows disagree."
        assert "nominal numbers: " in parts.reasons[0], case
        assert parts.evidence["held_out"]["errors"][FITTED] == fitted


def test_without_held_out_data_there_is_no_verdict():
    parts = chosen_parts(PARTS, None, {})
    assert (parts.verdict, parts.reasons, parts.numbers) == ("", PARTS.reasons, PARTS.numbers)


def test_fit_that_is_worse_after_some_time_is_not_used():
    errors = {"fitted": 0.1, "nominal numbers": 0.3}
    later = {"after 5 s": {"fitted": 0.06, "nominal numbers": 0.05}}
    within = {"after 5 s": {"fitted": (0.04, 0.08), "nominal numbers": (0.03, 0.07)}}
    compared = Compared("mean distance", "m", 9, errors, later, intervals=within)
    made = chosen_parts(PARTS, compared, {"drive.speed": 0.2})
    assert compared.recommended == "nominal numbers"
    assert dict(made.numbers) == {"drive.speed": 0.2}
    assert "after 5 s" in made.verdict
    assert any("0.04" in reason and "0.08" in reason for reason in made.reasons)
