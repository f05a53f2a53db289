"""A learner's mistakes end in one message that says what to do."""

import subprocess
import sys

import numpy as np
import pytest

import realitygap.classroom.myro as myro
from realitygap.classroom.myro import MyroError
from realitygap.classroom.myro._mistakes import choice, explanation, is_on, number, whole
from realitygap.errors import RealityGapError


def test_a_number_may_be_of_any_kind_of_number():
    assert [number("it", value) for value in (1, 0.5, np.float32(0.5), np.int64(3), True)] == [
        1,
        0.5,
        0.5,
        3,
        1,
    ]


@pytest.mark.parametrize("value", ["fast", None, [1], float("nan"), float("inf")])
def test_values_that_are_no_numbers_are_refused_by_name(value):
    with pytest.raises(MyroError, match=r"^forward: the speed is .*, expected a number"):
        number("forward: the speed", value)


def test_text_that_looks_like_a_number_gets_a_hint():
    with pytest.raises(MyroError, match=r"float\('0.5'\)"):
        number("wait: the seconds", "0.5")


def test_a_number_out_of_range_is_refused_with_the_range():
    with pytest.raises(MyroError, match=r"it is -1, expected a number of at least 0\."):
        number("it", -1, 0)
    with pytest.raises(MyroError, match=r"it is 11, expected a number from 0 to 10\."):
        number("it", 11, 0, 10)
    with pytest.raises(MyroError, match=r"it is 2.5, expected a whole number from 0 to 3\."):
        whole("it", 2.5, 0, 3)


def test_a_wrong_word_is_refused_with_the_words_that_are_known():
    with pytest.raises(
        MyroError, match=r"getLight: the position is 'lfet', expected .*'left'.* Did you mean 'left'\?"
    ):
        choice("getLight: the position", "lfet", {"left": 0, "right": 1, 0: 0, 1: 1})
    with pytest.raises(MyroError, match="is 7, expected 'left', 'right', 0 or 1"):
        choice("it", 7, {"left": 0, "right": 1, 0: 0, 1: 1})
    with pytest.raises(MyroError, match="expected"):
        choice("it", ["left"], {"left": 0})


def test_words_are_known_in_any_case_and_numbers_of_any_kind():
    assert choice("it", "LEFT", {"left": 5}) == 5
    assert choice("it", 1.0, {1: 5}) == 5


def test_switches_accept_on_and_off_and_refuse_other_words():
    assert [is_on("it", value) for value in ("on", "OFF", 1, 0, True, None)] == [
        True,
        False,
        True,
        False,
        True,
        False,
    ]
    with pytest.raises(MyroError, match="expected 'on' or 'off'"):
        is_on("it", "yes")


ROBOT_FUNCTIONS = [
    ("forward", (1, 1)), ("turnLeft", ()), ("getLight", ("left",)), ("takePicture", ()), ("playSong", ([],)),
    ("set", ("led", "left", "on")), ("wall", ()), ("getAll", ()),
]  # fmt: skip


@pytest.mark.parametrize(("name", "arguments"), ROBOT_FUNCTIONS)
def test_without_a_robot_each_function_says_how_to_get_one(name, arguments):
    with pytest.raises(MyroError, match=rf'^{name}\(\) needs a robot, .*initialize\("sim"\)'):
        getattr(myro, name)(*arguments)


def test_without_a_robot_stop_does_nothing_as_in_myro():
    assert myro.stop() is None


def test_mistakes_are_caught_like_all_of_ours():
    assert issubclass(MyroError, RealityGapError)


def test_the_explanation_names_the_line_of_the_program(tmp_path):
    program = tmp_path / "program.py"
    program.write_text("from realitygap.classroom.myro import *\n\n\ndef go():\n    forward(1)\n\n\ngo()\n")
    try:
        exec(compile(program.read_text(), str(program), "exec"), {})
    except MyroError as error:
        text = explanation(error, error.__traceback__)
    assert text.splitlines()[0] == "Line 5 of program.py: forward(1)"
    assert text.splitlines()[1].startswith("MyroError: forward() needs a robot")


def test_a_program_ends_with_the_message_and_without_a_traceback(tmp_path):
    program = tmp_path / "program.py"
    program.write_text("from realitygap.classroom.myro import *\nforward(1)\n")
    done = subprocess.run([sys.executable, program], capture_output=True, text=True)
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    assert done.stderr.startswith("Line 2 of program.py: forward(1)\nMyroError: forward() needs a robot")


def test_other_exceptions_keep_their_traceback(tmp_path):
    program = tmp_path / "program.py"
    program.write_text("from realitygap.classroom.myro import *\n1 / 0\n")
    done = subprocess.run([sys.executable, program], capture_output=True, text=True)
    assert "Traceback" in done.stderr
    assert "ZeroDivisionError" in done.stderr
