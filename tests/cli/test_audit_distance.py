"""`realitygap audit-distance` as a user meets it."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from realitygap.cli import app
from realitygap.evolution import DISTANCES
from realitygap.report import audit_distance
from tests.cli.test_commands import one_message, realitygap


def test_the_papers_distance_has_both_biases_and_is_drawn(tmp_path):
    done = realitygap("audit-distance", "paper", "-o", "paper.png", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    for text in ("low-numbered cells weigh most", "+0.94", "seed 1", "Written: paper.png"):
        assert text in done.stdout
    assert (tmp_path / "paper.png").read_bytes().startswith(b"\x89PNG")


def test_json_is_what_python_gives():
    done = CliRunner().invoke(
        app, ["audit-distance", "jaccard", "--json", "--seed", "7", "--straight", "0.5"]
    )
    assert json.loads(done.stdout) == audit_distance("jaccard", seed=7, straight=0.5).to_dict()


@pytest.mark.parametrize(
    ("arguments", "texts"),
    [
        (["jacard"], ["Unknown distance 'jacard'", "Did you mean 'jaccard'?"]),
        (["paper", "-o", "p.txt"], ["p.txt ends in .txt", ".svg"]),
        (["paper", "nowhere"], ["nowhere does not exist"]),
    ],
)
def test_wrong_input_gets_one_message(arguments, texts, tmp_path):
    one_message(realitygap("audit-distance", *arguments, cwd=tmp_path), *texts)


def test_the_help_names_every_distance():
    page = CliRunner().invoke(app, ["audit-distance", "--help"]).stdout
    assert all(name in page for name in DISTANCES)
