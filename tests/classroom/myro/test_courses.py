"""Whole programs in the style of the courses run unchanged, on emulated and on simulated robots."""

import io
import json
import subprocess
import sys
from contextlib import redirect_stdout
from pathlib import Path

import pytest

from realitygap.classroom.myro.__main__ import main

from .conftest import SETUPS

PROGRAMS = Path(__file__).parents[3] / "examples" / "myro"
SAYS = {
    "dance": "This dance is by Rosa",
    "wanderer": "I am done.",
    "light_follower": "Ambient",
    "line_follower": "Lines seen: [[0, 0]]",
    "song": "9 notes, 9 read again\nC5 0.25\nC5 0.25",
    "portrait": "Dark pixels: True corner: (255, 0, 0)",
    "square": "5 shapes",
}
NEED_A_FLUKE = {"wanderer", "light_follower", "line_follower", "portrait"}


def run(*arguments):
    out = io.StringIO()
    with redirect_stdout(out):
        code = main([str(argument) for argument in arguments])
    return code, out.getvalue()


def test_every_program_is_tried():
    assert {path.stem for path in PROGRAMS.glob("*.py")} == set(SAYS)


@pytest.mark.parametrize("name", SAYS)
@pytest.mark.parametrize("setup", SETUPS)
def test_a_program_runs_unchanged_on_each_robot(name, setup):
    model, fluke = SETUPS[setup]
    code, out = run(PROGRAMS / f"{name}.py", "--port", f"emulator://{model}?fluke={fluke}&speed=off")
    if fluke == "none" and name in NEED_A_FLUKE:
        assert code == 1
    else:
        assert SAYS[name] in out
        assert code == 0


@pytest.mark.parametrize("name", SAYS)
def test_a_program_runs_unchanged_on_the_simulator(name):
    code, out = run(PROGRAMS / f"{name}.py", "--port", "sim?speed=off&start=center")
    assert SAYS[name] in out
    assert "cells visited" in out
    assert code == 0


def test_a_missing_fluke_is_said_with_the_line(capsys):
    assert main([str(PROGRAMS / "portrait.py"), "--port", "emulator://s1?fluke=none&speed=off"]) == 1
    error = capsys.readouterr().err
    assert error.startswith("Line 9 of portrait.py: autoCamera()\n")
    assert "needs a Fluke" in error


def test_programs_are_graded_by_seeds():
    code, first = run(PROGRAMS / "wanderer.py", "--seeds", "1-3", "--json")
    rows = json.loads(first)
    assert code == 0
    assert [row["seed"] for row in rows] == [1, 2, 3]
    assert all(row["error"] is None and row["seconds"] > 20 and 1 <= row["cells"] <= 72 for row in rows)
    assert len({row["cells"] for row in rows}) > 1
    assert run(PROGRAMS / "wanderer.py", "--seeds", "1-3", "--json")[1] == first


def test_grades_are_printed_as_a_table(tmp_path):
    program = tmp_path / "program.py"
    program.write_text("from myro import *\ninit()\nforward(1, 1)\nforward('x')\n")
    code, out = run(program, "--seeds", "1,5")
    lines = out.splitlines()
    assert code == 1
    assert lines[0] == "seed  seconds  cells  coverage  ended"
    assert [line.split()[0] for line in lines[1:]] == ["1", "5"]
    assert lines[1].endswith("MyroError: forward: the speed is 'x', expected a number.")


def test_a_program_that_never_ends_is_stopped_at_its_limit(tmp_path):
    program = tmp_path / "program.py"
    program.write_text(
        "from myro import *\ninit()\nwhile True:\n    try:\n        forward(.5, .1)\n        print(getStall())\n"
        "    except Exception:\n        pass\n"
    )
    code, out = run(program, "--seeds", "4", "--limit", "5", "--json")
    assert code == 0
    assert 5 <= json.loads(out)[0]["seconds"] < 7


@pytest.mark.parametrize("loop", ["while True: pass_ = currentTime()", "for t in timer(0): pass"])
def test_a_program_that_only_looks_at_the_clock_is_stopped_too(tmp_path, loop):
    program = tmp_path / "program.py"
    program.write_text(f"from myro import *\ninit()\nforward(1)\n{loop}\n")
    code, out = run(program, "--seeds", "4", "--limit", "3", "--json")
    assert code == 0
    assert 3 <= json.loads(out)[0]["seconds"] < 5


def test_pythons_own_sleep_and_time_are_the_robots(tmp_path):
    program = tmp_path / "program.py"
    program.write_text(
        "import time\nfrom myro import *\ninit('com3')\nbegun = time.time()\nforward(1)\ntime.sleep(2)\nstop()\n"
        "assert 1.9 < time.time() - begun < 2.3\n"
    )
    code, out = run(program, "--port", "sim?speed=off")
    assert code == 0
    assert "cells visited" in out
    assert "1 of 72" not in out


def test_the_same_program_runs_under_the_names_of_other_versions(tmp_path):
    program = tmp_path / "program.py"
    program.write_text(
        "from Myro import *\nfrom Graphics import *\ninit('sim')\nrobot.forward(1, 1)\nprint(getName(), red)\n"
    )
    code, out = run(program, "--port", "sim?speed=off")
    assert code == 0
    assert "Scribby <Color instance" in out
    assert "Myro" not in sys.modules


@pytest.mark.parametrize(("ending", "code"), [("", 0), ("0", 0), ("3", 1), ("'no light'", 1)])
def test_a_program_that_ends_itself_has_ended_well_only_with_0(tmp_path, ending, code):
    program = tmp_path / "program.py"
    program.write_text(f"import sys\nfrom myro import *\ninit()\nsys.exit({ending})\n")
    assert run(program, "--seeds", "4", "--json")[0] == code


@pytest.mark.slow
def test_a_signal_ends_all_of_a_grading(tmp_path):
    program = tmp_path / "program.py"
    program.write_text(
        "import os, signal, sys\nfrom myro import *\ninit()\nprint('begun', file=sys.stderr)\nforward(1)\n"
        "os.kill(os.getpid(), signal.SIG{})\nwait(9)\n"
    )
    for name, code in (("TERM", 143), ("INT", 130)):
        one = tmp_path / f"{name}.py"
        one.write_text(program.read_text().format(name))
        done = subprocess.run(
            [sys.executable, "-m", "realitygap.classroom.myro", one, "--seeds", "1-3"],
            capture_output=True,
            text=True,
        )
        assert done.returncode == code
        assert done.stderr.count("begun") == 1
        assert "Traceback" not in done.stderr


def test_mistakes_of_the_command_are_said_plainly(tmp_path, capsys):
    assert main([str(tmp_path / "no.py")]) == 2
    assert "There is no program" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main([str(PROGRAMS / "dance.py"), "--seeds", "one"])
    assert "expected seeds as 1-10" in capsys.readouterr().err
    for wrong in (("--seeds", "5-1"), ("--limit", "nan"), ("--limit", "0")):
        with pytest.raises(SystemExit):
            main([str(PROGRAMS / "dance.py"), *wrong])
        assert "expected seeds as 1-10" in (said := capsys.readouterr().err) or "expected seconds" in said
    with pytest.raises(SystemExit, match="--seeds needs a simulated robot"):
        main([str(PROGRAMS / "dance.py"), "--seeds", "1", "--port", "com3"])


def test_help_has_an_example():
    done = subprocess.run(
        [sys.executable, "-m", "realitygap.classroom.myro", "--help"], capture_output=True, text=True
    )
    assert "python -m realitygap.classroom.myro dance.py --seeds 1-10" in done.stdout
