"""A study file made from a form says what was entered."""

from __future__ import annotations

from datetime import UTC

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realitygap.lab._form import condition_fields, entered, form_sections, read_form, toml_value, written_form

TEXTS = st.text(st.characters(exclude_categories=["Cs"]))
VALUES = st.recursive(
    st.booleans()
    | st.integers(-(2**63), 2**63 - 1)
    | st.floats(allow_nan=False)
    | st.datetimes(timezones=st.none() | st.just(UTC))
    | st.dates()
    | st.times()
    | TEXTS,
    lambda each: st.lists(each, max_size=3),
    max_leaves=4,
)
TABLES = st.dictionaries(TEXTS, VALUES, min_size=1, max_size=3)
PLATFORMS = st.dictionaries(TEXTS, TABLES, min_size=1, max_size=2)
NAMES = st.sampled_from(["study", "arena", "task", "neat", "novelty", "trials", "report"])


@given(
    st.dictionaries(NAMES | TEXTS, TABLES | VALUES, max_size=2),
    st.lists(st.dictionaries(TEXTS, VALUES | TABLES, max_size=2), max_size=2),
    PLATFORMS,
)
def test_a_written_form_is_read_as_it_was(rest, conditions, platforms):
    data = {**rest, "platform": platforms, **({"condition": conditions} if conditions else {})}
    assert read_form(written_form(data)) == data


@given(VALUES)
def test_a_value_is_entered_as_it_is_shown(value):
    field = next(each for each in form_sections()["arena"] if each.kind == "toml")
    assert entered(field, toml_value(value)) == value


def test_every_setting_has_an_explanation():
    fields = [field for each in form_sections().values() for field in each] + condition_fields()
    assert [field.place for field in fields if not field.description] == []


@pytest.mark.parametrize("text", ["a = " + "[" * 5000, "[", "a", 'a = "'])
def test_reading_a_wrong_study_file_raises_a_value_error(text):
    with pytest.raises(ValueError):  # noqa: PT011  # of TOML's reader, or ours
        read_form(text)


@pytest.mark.parametrize("text", ["[" * 5000, "1 2", "x", "="])
def test_a_wrong_value_is_reported_with_its_place(text):
    field = next(each for each in form_sections()["neat"] if each.kind == "whole")
    with pytest.raises(ValueError, match=f"{field.place}: expected a whole number"):
        entered(field, text)
