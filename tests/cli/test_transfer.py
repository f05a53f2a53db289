import json

import pytest
from typer.testing import CliRunner

from realitygap.cli import app
from realitygap.errors import RealityGapError, RecordError, StudyError
from realitygap.orders import read_order

pytestmark = pytest.mark.slow

SMALL = ["--budget", "3", "--runs", "4", "--repeats", "1", "--fresh-trials", "2"]


def run(*arguments):
    result = CliRunner().invoke(app, [str(each) for each in arguments])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("transfer") / "travels"
    result = run("transfer", "sim-paper", "--to", "jyro", "--strategy", "select", *SMALL, "-o", out)
    assert "sim-paper, coverage-sim: from simulation (SIM) to jyro (SIM)" in result.output
    assert "To compare strategies, add --replicates" in result.output
    return out


def test_json_is_the_result_in_the_folder(folder):
    arguments = [
        "transfer",
        "sim-paper",
        "--to",
        "jyro",
        "--strategy",
        "select",
        *SMALL,
        "-o",
        folder,
        "--json",
    ]
    found = json.loads(run(*arguments).stdout)
    written = json.loads((folder / "result.json").read_text())
    assert found == written | {
        "score": "coverage",
        "folder": str(folder),
        "champions_folder": str(folder / "champions"),
        "order": read_order(folder).record(),
    }
    (row,) = found["strategies"]
    assert set(row["quality"]) == set(row["regret"]) == {"estimate", "low", "high", "n"}


def test_a_champion_travels_over_the_wire_and_back(folder, tmp_path):
    champion = folder / "champions" / "select-3-0.json"
    kept = tmp_path / "wire.sqlite"
    wire = ["try", champion, "--on", "scribbler:emulator://s2?fluke=2&speed=off", "--steps", "20"]
    first = json.loads(run(*wire, "--json", "-o", kept).stdout)
    assert first["label"] == "EMULATED"
    assert len(first["coverage"]) == 1
    again = json.loads(run(*wire, "--json", "-o", kept).stdout)  # nothing is driven
    assert again == first
    back = json.loads(run("try", champion, "--on", "sim", "--steps", "20", "--json").stdout)
    assert back["label"] == "SIM"
    # the emulated robot is `sim` behind the wire: 20 commands end nearly where they do in simulation
    assert back["coverage"][0] == pytest.approx(first["coverage"][0], abs=3 / 72)


def test_mistakes_are_said_in_words(folder, tmp_path):
    champion = folder / "champions" / "select-3-0.json"
    with pytest.raises(StudyError, match="Did you mean 'plain'"):
        run("transfer", "sim-paper", "--to", "jyro", "--strategy", "plane", "-o", tmp_path)
    with pytest.raises(StudyError, match="is no platform"):
        run("try", champion, "--on", "simm")
    with pytest.raises(RealityGapError, match="Could not read"):
        run("try", tmp_path / "none.json", "--on", "sim")
    with pytest.raises(RecordError, match="belongs to another transfer"):
        run("transfer", "sim-paper", "--to", "sim", "--strategy", "select", *SMALL, "-o", folder)


def test_wrong_options_are_refused_before_a_trial_is_spent(folder, tmp_path):
    champion, out = folder / "champions" / "select-3-0.json", tmp_path / "travels"
    run("gap", "sim", "sim", "--n-controllers", "2", "--trials", "2", "-o", tmp_path / "gap.sqlite")
    recorded = f"recorded:{tmp_path / 'gap.sqlite'}"
    calibrated = ("transfer", "sim-paper", "--strategy", "calibrated", *SMALL, "-o", out)
    with pytest.raises(StudyError, match="supports at most 'cells'"):
        run("try", champion, "--on", recorded, "--observe", "track")
    with pytest.raises(StudyError, match="supports at most 'cells'"):
        run(*calibrated, "--to", recorded, "--observe", "track")
    assert not out.exists()
    backward = tmp_path / "backward.toml"
    backward.write_text(
        'format = "realitygap calibration 1"\nkind = "path"\nrobot = "scribbler-s2-fluke2"\ntarget = "sim"\n'
        'label = "SIM"\nobserve = "cells"\ntrials = 2\ndate = "2026-01-01"\nmethod = "by hand"\n'
        "[numbers]\n'drive.gain_left' = -0.5\n"
    )
    with pytest.raises(RealityGapError, match=r"drive\.gain_left: expected more than 0"):
        run(*calibrated, "--to", "sim", "--calibration", backward)
    assert not out.exists()
    with pytest.raises(StudyError, match="sim:e-puck has 8 range sensors and robot"):
        run(*calibrated, "--to", "sim:e-puck")
    assert not list((out / "calibrations").glob("*.sqlite"))
    for wrong in (("--budget", "5000"), ("--fresh-trials", "5001")):
        others = list(calibrated)
        if wrong[0] in others:
            at = others.index(wrong[0])
            del others[at : at + 2]
        result = run(*others, "--to", "sim", *wrong)
        assert result.exit_code == 2
        assert "expected at most" in result.output
