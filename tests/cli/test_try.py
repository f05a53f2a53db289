"""`realitygap try`: controllers with other inputs than the paper's, on platforms that have them or not."""

from __future__ import annotations

import json
from functools import partial

import pytest

from realitygap.evolution import ControllerInterface, NeatSettings, Population
from realitygap.robots.twin import sample_twin

from .invoked import answered

RANGES = ("range.0", "range.1", "range.2", "bias")
LIGHTS = ("light.0", "light.1", "light.2", "bias")


tried = partial(answered, "try")


@pytest.fixture
def files(tmp_path):
    settings = NeatSettings.named("rosenzweig-remy", population=2)
    genome = Population(3, 2, settings, seed=5).ask()[0]
    for name, inputs in (("ranges", RANGES), ("lights", LIGHTS)):
        genome.with_interface(ControllerInterface(inputs)).save(tmp_path / f"{name}.json")
    genome.save(tmp_path / "paper.json")
    for family in ("same", "close"):
        (tmp_path / f"{family}.toml").write_text(sample_twin(family, 1).to_toml())
    return tmp_path


@pytest.mark.slow
@pytest.mark.parametrize("on", ["sim", "twin", "scribbler:emulator://s2?fluke=2&speed=off"])
def test_controller_of_single_sensors_drives_wherever_they_are(files, on):
    on = f"twin:{files / 'same.toml'}" if on == "twin" else on
    out = tried(files / "ranges.json", "--on", on, "--steps", 5, "--json")
    assert len(json.loads(out)["coverage"]) == 1


@pytest.mark.slow
def test_controller_that_sees_light_drives_where_light_is_and_is_refused_elsewhere(files):
    for on in ("sim", "scribbler:emulator://s2?fluke=2&arena=light&speed=off"):
        assert "mean coverage" in tried(files / "lights.json", "--on", on, "--arena", "light", "--steps", 5)
    for on in ("jyro", f"twin:{files / 'close.toml'}"):
        assert "light.0 to light.2 are missing" in tried(files / "lights.json", "--on", on, "--steps", 5)


def test_inputs_of_a_file_can_be_named(files):
    by_names = tried(files / "paper.json", "--on", "sim", "--steps", 5, "--inputs", ",".join(RANGES))
    assert by_names == tried(files / "ranges.json", "--on", "sim", "--steps", 5)
    assert "Name each of them" in tried(files / "paper.json", "--on", "sim", "--inputs", "range.0,bias")


def test_outputs_of_a_file_can_be_named(files):
    wheels = ("--steps", 5, "--outputs", "left,right")
    assert "mean coverage" in tried(files / "paper.json", "--on", "sim", *wheels)
    assert "expected move, turn, or left, right" in tried(
        files / "paper.json", "--on", "sim", "--outputs", "left,turn"
    )
