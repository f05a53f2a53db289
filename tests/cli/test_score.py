"""A sheet is printed, its photo read, and what is confirmed stands in the ledger."""

from __future__ import annotations

import hashlib
import io
import json

import numpy as np
import pytest

import realitygap.vision
from realitygap.records import LEDGER_NAME, Ledger
from realitygap.testing import photograph_sheet
from realitygap.vision import SheetLayout
from realitygap.world import cells_along, paper_arena

from .fake_port import STUDY

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module", autouse=True)
def _one_reading_of_each_photo():
    """Each photo is read once for each set of pens that drew on it."""
    scores = {}
    score_sheet = realitygap.vision.score_sheet

    def read(image, layout, drawn=None):
        key = image.tobytes(), layout.pens, None if drawn is None else tuple(drawn)
        if key not in scores:
            scores[key] = score_sheet(image, layout, drawn)
        return scores[key]

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(realitygap.vision, "score_sheet", read)
        yield


@pytest.fixture
def driven(tmp_path, no_terminal):
    study, out = tmp_path / "small.toml", tmp_path / "out"
    study.write_text(STUDY)
    assert no_terminal("drive", study, "--port", "real", "--out", out, "--no-wait").returncode == 0
    return out


@pytest.fixture(scope="module")
def lines():
    x, y, _ = paper_arena().start
    there = np.linspace(0, 1, 200)
    return [
        np.column_stack([x + 0.6 * there, y + 0.25 * np.sin(3 * there)]),
        np.column_stack([x + 0.1 * np.sin(9 * there), y + 0.3 * there]),
    ]


@pytest.fixture(scope="module")
def photo(tmp_path_factory, lines):
    path = tmp_path_factory.mktemp("photo") / "sheet.jpg"
    path.write_bytes(
        photograph_sheet(SheetLayout.of(paper_arena(), ("red", "blue")), lines, 1, size=(1600, 1200)).jpeg
    )
    return path


def test_a_photo_is_entered_once_somebody_has_looked(driven, photo, lines, no_terminal):
    shown = no_terminal("score", photo, "--study", driven, "--generation", "0", "--who", "anna")
    assert shown.returncode == 0, shown.stderr
    assert "Nothing was entered" in shown.stdout
    assert (driven / "sheet-1.png").read_bytes().startswith(b"\x89PNG")
    with Ledger.open(driven / LEDGER_NAME) as ledger:
        assert [trial.state for trial in ledger.trials()] == ["driven", "driven"]
    words = ("score", photo, "--study", driven, "--generation", "0", "--who", "anna", "--json")
    values = json.loads(no_terminal(*words).stdout)
    assert (values["entered"], values["overlay"]) == (0, str(driven / "sheet-1.png"))
    values = json.loads(no_terminal(*words, "--yes").stdout)
    assert (values["entered"], len(values["trials"])) == (2, 2)
    with Ledger.open(driven / LEDGER_NAME) as ledger:
        for trial, line in zip(ledger.trials(), lines, strict=True):
            assert trial.state == "scored"
            known = set(cells_along(line, paper_arena().grid))
            assert len(known & set(trial.cells)) / len(known | set(trial.cells)) > 0.9
        events = [event for event in ledger.events() if event["what"] == "scored"]
    digest = hashlib.sha256(photo.read_bytes()).hexdigest()
    for event in events:
        assert event["details"]["who"] == "anna"
        assert event["details"]["photo"]["sha256"] == digest
        assert event["details"]["photo"]["file"] == "sheet.jpg"
        assert event["details"]["photo"]["is_confirmed"] is True


def test_the_counts_of_a_photo_go_on_as_any_others(driven, photo, no_terminal, tmp_path):
    no_terminal("score", photo, "--study", driven, "--sheet", "1", "--yes", "--who", "anna")
    second = no_terminal(
        "score", photo, "--study", driven, "--sheet", "1", "--yes", "--second", "--who", "ben"
    )
    assert second.returncode == 0, second.stderr
    assert "100.0 % judged alike" in no_terminal("trials", "agreement", driven).stdout
    again = no_terminal("score", photo, "--study", driven, "--sheet", "1", "--yes", "--who", "anna")
    assert again.returncode == 1
    assert "none of these trials waits for its cells; they are 2 scored" in again.stderr
    run = no_terminal("drive", tmp_path / "small.toml", "--port", "real", "--out", driven, "--no-wait")
    assert run.returncode == 0, run.stderr
    corrected = no_terminal(
        "score", photo, "--study", driven, "--sheet", "1", "--yes", "--correct", "--who", "anna"
    )
    assert "2 trials entered." in corrected.stdout


def test_a_pen_that_drew_a_void_trial_too_is_left_out(driven, photo, no_terminal, tmp_path):
    no_terminal("trials", "void", driven, "1", "--text", "it was pushed")
    no_terminal("drive", tmp_path / "small.toml", "--port", "real", "--out", driven, "--no-wait")
    done = no_terminal("score", photo, "--study", driven, "--sheet", "1", "--yes")
    assert "the pen also drew trial 1, which is void" in done.stderr
    assert "1 trials entered." in done.stdout
    with Ledger.open(driven / LEDGER_NAME) as ledger:
        assert [trial.state for trial in ledger.trials()] == ["void", "driven", "scored"]


def test_without_a_study_it_only_shows(photo, lines, no_terminal, tmp_path):
    done = no_terminal("score", photo, "--pens", "red,blue", "--json", "--overlay", tmp_path / "seen.png")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert [trace["pen"] for trace in told["traces"]] == ["red", "blue"]
    for trace, line in zip(told["traces"], lines, strict=True):
        known = set(cells_along(line, paper_arena().grid))
        assert len(known & set(trace["cells"])) / len(known | set(trace["cells"])) > 0.9
        assert len(trace["confidence"]) == len(trace["cells"])
    assert (tmp_path / "seen.png").exists()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--generation", "0"), "--generation: expected a study"),
        (("--yes",), "--yes: expected a study"),
        (("--pens", "red,red"), "expected different names such as black,red,blue"),
        (("--arena", "papr"), "Did you mean 'paper'?"),
        (("--study", "none"), "There is no ledger at"),
        (("--study", "none", "--second", "--correct"), "exclude each other"),
        (("--study", "none", "--pens", "red"), "--pens cannot be combined with --study"),
    ],
)
def test_wrong_options_get_one_clear_message(photo, options, said, no_terminal):
    done = no_terminal("score", photo, *options)
    assert done.returncode == 1
    assert said in done.stderr
    assert "Traceback" not in done.stderr


def test_a_photo_of_something_else_enters_nothing(driven, tmp_path, no_terminal):
    from PIL import Image

    other = tmp_path / "other.jpg"
    Image.new("RGB", (800, 600), (200, 180, 160)).save(other)
    done = no_terminal("score", other, "--study", driven, "--generation", "0", "--yes")
    assert done.returncode == 1
    assert "Of the sheet's four tags 0 were found" in done.stderr
    assert done.stderr.count("\n") == 1


def _bytes_of(kind: str, photo) -> bytes:
    if kind == "torn":
        return photo.read_bytes()[: photo.stat().st_size // 2]
    if kind == "gray":
        from PIL import Image

        file = io.BytesIO()
        with Image.open(photo) as picture:
            picture.convert("L").save(file, "JPEG")
        return file.getvalue()
    fixed = {"empty": b"", "text": b"cells: 1 2 3\n" * 50, "heic": b"\x00\x00\x00\x18ftypheic" + bytes(99)}
    return fixed[kind]


@pytest.mark.parametrize(
    ("kind", "said"),
    [
        ("torn", "Is the file whole?"),
        ("gray", "The picture is gray, and its 2 pens are identified by color. Take a photo in color."),
        ("empty", "is empty"),
        ("text", "no picture that can be read"),
        ("heic", "It looks like HEIC"),
    ],
)
def test_an_upload_that_is_no_color_photo_gets_one_message_and_enters_nothing(
    driven, photo, tmp_path, no_terminal, kind, said
):
    other = tmp_path / "other.jpg"
    other.write_bytes(_bytes_of(kind, photo))
    done = no_terminal("score", other, "--study", driven, "--generation", "0", "--yes")
    assert done.returncode == 1
    assert said in done.stderr
    assert done.stderr.count("\n") == 1
    assert not (driven / "sheet-1.png").exists()
    with Ledger.open(driven / LEDGER_NAME) as ledger:
        assert [trial.state for trial in ledger.trials()] == ["driven", "driven"]


def test_generations_that_are_not_there_are_said(driven, photo, no_terminal):
    done = no_terminal("score", photo, "--study", driven, "--generation", "7")
    assert done.returncode == 1
    assert "has no such trials" in done.stderr


def test_a_sheet_is_printed(tmp_path, no_terminal, driven):
    out = tmp_path / "sheet.pdf"
    done = no_terminal("print-sheet", "-o", out, "--paper", "arena")
    assert done.stdout == f"Written: {out} (1 page; the sheet is 1091 x 634 mm)\n"
    assert out.read_bytes().startswith(b"%PDF")
    assert no_terminal("print-sheet", "-o", out, "--study", driven).returncode == 0
    wrong = no_terminal("print-sheet", "-o", out, "--paper", "a44")
    assert wrong.returncode == 1
    assert "Did you mean 'a4'" in wrong.stderr
