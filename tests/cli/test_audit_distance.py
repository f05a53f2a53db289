"""`realitygap audit-distance` as a user meets it."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from realitygap.cli import app
from realitygap.errors import RealityGapError
from realitygap.evolution import DISTANCES
from realitygap.report import audit_distance
from tests.cli.test_commands import one_message, realitygap

pytestmark = pytest.mark.slow


def test_the_papers_distance_has_both_biases_and_is_drawn(tmp_path):
    done = CliRunner().invoke(app, ["audit-distance", "paper", "-o", str(tmp_path / "paper.png")])
    assert done.exit_code == 0, done.output
    for text in ("low-numbered cells weigh most", "+0.94", "seed 1", "Written: "):
        assert text in done.stdout
    assert (tmp_path / "paper.png").read_bytes().startswith(b"\x89PNG")


def test_json_is_what_python_gives():
    done = CliRunner().invoke(
        app, ["audit-distance", "jaccard", "--json", "--seed", "7", "--straight", "0.5"]
    )
    assert (
        json.loads(done.stdout).items() >= audit_distance("jaccard", seed=7, straight=0.5).to_dict().items()
    )


def test_an_unknown_distance_gets_one_message(tmp_path):
    done = realitygap("audit-distance", "jacard", cwd=tmp_path)
    one_message(done, "Unknown distance 'jacard'", "Did you mean 'jaccard'?")


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["paper", "-o", "p.txt"], "p.txt ends in .txt"),
        (["paper", "nowhere"], "nowhere does not exist"),
        (["final", "nowhere"], "without a folder"),
    ],
)
def test_wrong_input_is_refused_at_once(arguments, text, tmp_path):
    done = CliRunner().invoke(app, ["audit-distance", *arguments])
    assert isinstance(done.exception, RealityGapError)
    assert text in str(done.exception)


def test_the_help_names_every_distance():
    page = CliRunner().invoke(app, ["audit-distance", "--help"]).stdout
    assert all(name in page for name in DISTANCES)
