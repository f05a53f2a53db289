"""`[controller]`: what networks see and answer, as a setting of a study."""

from __future__ import annotations

import numpy as np
import pytest

from realitygap.errors import StudyError
from realitygap.evolution import Genome
from realitygap.records import ResultsFolder
from realitygap.report import export_individual
from realitygap.runs import Condition, genome_of, run_replicates
from realitygap.study import parse_study, run_study
from realitygap.tasks import ControllerSettings

DECLARED = {"inputs": ["range.0", "range.2", "time", "bias"], "outputs": ["left", "right"]}
SMALL = {"population": 8, "generations": 3}

STUDY = """
[study]
name = "wheels"
replicates = 2
[controller]
inputs = ["range.0", "range.2", "time", "bias"]
outputs = ["left", "right"]
[neat]
population = 6
generations = 2
[[condition]]
name = "{platform}"
platform = "{platform}"
[condition.{platform}]
steps = 12
"""


def test_declaration_is_stored_only_if_it_is_set():
    assert "controller" not in Condition(name="a").settings()
    plain = Condition(name="a", controller={"outputs": ["move", "turn"]})
    assert plain.hash() == Condition(name="a").hash()
    wheels = Condition(name="a", controller={"outputs": ["left", "right"]})
    assert wheels.settings()["controller"] == {"outputs": ["left", "right"]}
    assert wheels.network_inputs == Condition(name="a").network_inputs
    declared = Condition(name="a", selection="novelty", controller=DECLARED)
    assert (declared.network_inputs, declared.output_names) == (
        ("range.0", "range.2", "time", "bias"),
        ("left", "right"),
    )
    for condition in (wheels, declared):
        assert Condition.from_settings("a", condition.settings()).hash() == condition.hash()
    assert Condition(name="a", selection="novelty", controller={"inputs": ["time"]}).network_inputs == (
        "time",
    )


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (
            {"controller": {"outputs": ["left", "turn"]}},
            r'expected \["move", "turn"\] or \["left", "right"\]',
        ),
        ({"controller": {"inputs": ["bias", "time"]}}, "bias as the last"),
        ({"controller": {"inputs": [""]}}, "expected a name for each"),
        ({"controller": {"inputs": ["range.9"]}}, r"range\.9 is missing"),
        (
            {"controller": DECLARED, "task": {"bias_input": "never"}},
            r"task\.bias_input and controller\.inputs both",
        ),
        (
            {"controller": DECLARED, "platform": "sim", "task": {"kind": "avoid", "inputs": ["range.0"]}},
            r"task\.inputs and controller\.inputs both define the inputs of networks\. Leave task\.inputs out",
        ),
    ],
)
def test_declarations_that_cannot_be_are_one_message(settings, message):
    with pytest.raises(ValueError, match=message):
        Condition(name="a", **settings)


def test_mistakes_of_a_study_file_have_their_place():
    text = STUDY.format(platform="sim").replace('outputs = ["left", "right"]', 'outputs = ["wheels"]')
    with pytest.raises(StudyError, match=r"controller\.?.*outputs: expected"):
        parse_study(text, "wheels.toml")


@pytest.mark.parametrize("selection", ["coverage", "novelty"])
def test_whole_runs_of_jyro_are_those_by_generations(selection):
    condition = Condition(name="a", selection=selection, controller=DECLARED, neat=SMALL)
    whole, staged = (run_replicates(condition, 0, 2, staged=each) for each in (False, True))
    assert whole.equals(staged)
    others = condition.model_copy(update={"controller": ControllerSettings(inputs=DECLARED["inputs"])})
    assert not whole["cells"].equals(run_replicates(others, 0, 2)["cells"])


@pytest.mark.parametrize("platform", ["jyro", "sim"])
def test_study_of_wheels_and_single_sensors_exports_its_declaration(tmp_path, platform):
    study = parse_study(STUDY.format(platform=platform), "wheels.toml")
    run_study(study, tmp_path / "results")
    row = ResultsFolder.open(tmp_path / "results").scan().collect().row(3, named=True)
    genome = genome_of(study.conditions[0], row)
    path = export_individual(
        tmp_path / "results",
        tmp_path / "champion.json",
        individual=row["individual"],
        generation=row["generation"],
    )
    exported = Genome.load(path)
    for each in (genome, exported, Genome.from_json(exported.to_json())):
        assert each.interface.inputs == tuple(DECLARED["inputs"])
        assert each.interface.outputs == ("left", "right")
        assert each.rules.drives_wheels
    assert np.isfinite(row["fitness"])
