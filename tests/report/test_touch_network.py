"""A trial of a study, run again with a changed network."""

from __future__ import annotations

import pytest

from realitygap.report import touch_network
from realitygap.study import parse_study, run_study

STUDY = """
[study]
name = "small"
replicates = 2

[neat]
population = 4
generations = 2

[[condition]]
name = "coverage-10"
noise = 0.1
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("touched") / "small"
    run_study(parse_study(STUDY, "study.toml"), path)
    return path


def test_network_without_changes_drives_as_recorded(folder):
    (recorded, again), weights, inputs = touch_network(folder, {}, [], condition="coverage-10")
    assert (recorded.poses == again.poses).all()
    assert {link.split(" → ")[0] for link in weights} <= {*inputs, "hidden"}


def test_weights_and_cut_sensors_change_the_path_of_the_copy_alone(folder):
    (before, _), weights, inputs = touch_network(folder, {}, [])
    for weights_now, cut in (({link: -w for link, w in weights.items()}, []), ({}, inputs)):
        (recorded, changed), known, _ = touch_network(folder, weights_now, cut)
        assert (recorded.poses == before.poses).all()
        assert known == weights
        assert not (changed.poses == recorded.poses).all()
