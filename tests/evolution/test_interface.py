"""Names of a controller's inputs and outputs."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realitygap.errors import ControllerError, RecordError
from realitygap.evolution import ControllerInterface, Genome, NeatSettings, Population, inputs_of_robot
from realitygap.evolution._interface import listed

AVOID = ControllerInterface(("range.0", "range.1", "bias"))


def genome(n_inputs: int = 3, *, bias: bool = False) -> Genome:
    settings = NeatSettings.named("rosenzweig-remy", population=2)
    return Population(n_inputs, 2, settings, seed=5, bias=bias).ask()[0]


def test_network_without_names_is_the_papers_if_its_numbers_fit():
    assert genome().interface.inputs == ("obstacle", "stall", "time")
    assert genome(bias=True).interface.inputs == ("obstacle", "stall", "time", "bias")
    with pytest.raises(ControllerError, match="6 inputs and 2 outputs, and does not name"):
        _ = genome(5, bias=True).interface


def test_names_come_back_from_json():
    named = genome(2, bias=True).with_interface(AVOID)
    again = Genome.from_json(named.to_json())
    assert again.interface == AVOID
    assert again == named
    assert again != genome(2, bias=True)


def test_names_of_the_paper_change_no_byte():
    plain = genome(bias=True)
    named = plain.with_interface(ControllerInterface(("obstacle", "stall", "time", "bias")))
    assert named == plain
    assert named.to_json() == plain.to_json()


def test_names_of_an_export_of_an_earlier_version_are_read():
    values = genome(2, bias=True).to_dict() | {
        "input_names": ["range.0", "range.1", "bias"],
        "output_names": ["move", "turn"],
    }
    assert Genome.from_dict(values).interface == AVOID


@pytest.mark.parametrize(
    "names",
    [
        {"inputs": ["range.0", "bias"], "outputs": ["move", "turn"]},
        {"inputs": ["bias", "range.0", "range.1"], "outputs": ["move", "turn"]},
        {"inputs": ["range.0", "", "bias"], "outputs": ["move", "turn"]},
        {"inputs": ["range.0", "range.1", "bias"], "outputs": ["left", "turn"]},
        {"inputs": "range", "outputs": ["move", "turn"]},
    ],
)
def test_names_that_do_not_fit_are_refused_in_one_message(names):
    values = genome(2, bias=True).to_dict() | {"version": 2, "interface": names}
    with pytest.raises(RecordError, match="not a whole genome"):
        Genome.from_json(json.dumps(values))


@given(
    st.lists(st.sampled_from(["obstacle", "stall", "time", "range.0", "range.1", "range.2"]), min_size=1),
    st.tuples(*[st.floats(0, 1)] * 3),
    st.booleans(),
    st.integers(0, 9),
)
def test_inputs_are_computed_by_their_names(names, readings, stalled, step):
    told = {"obstacle": max(readings), "stall": float(stalled), "time": step / 10}
    told |= {f"range.{k}": reading for k, reading in enumerate(readings)}
    sense = ControllerInterface((*names, "bias")).bind(10)
    assert sense(readings, stalled, step, {}) == [told[name] for name in names]


def test_one_message_names_all_inputs_that_a_robot_lacks():
    with pytest.raises(ControllerError) as refused:
        ControllerInterface(("range.1", "light.0", "light.1")).check(inputs_of_robot(3), "X", "Y")
    assert str(refused.value).startswith(
        "X sees range.1, light.0 to light.1, and Y has obstacle, stall, time, last_move, last_turn, range.0 to "
        "range.2: light.0 to light.1 are missing."
    )


def test_numbered_names_are_listed_as_ranges():
    assert (
        listed(["range.0", "range.2", "range.3", "light.4", "bias"])
        == "range.0, range.2 to range.3, light.4, bias"
    )
