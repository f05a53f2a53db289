import os
import signal
import sys
import threading

import pytest

from realitygap._interrupts import held_interrupts

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="a process cannot press Ctrl-C there"),
]


@pytest.fixture(autouse=True)
def _handled_as_in_a_command():
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def press():
    os.kill(os.getpid(), signal.SIGINT)


def in_a_block(*steps):
    with held_interrupts():
        for step in steps:
            step()


def test_one_is_raised_at_the_end_of_the_block():
    reached = []
    with pytest.raises(KeyboardInterrupt):
        in_a_block(press, lambda: reached.append("end"))
    assert reached == ["end"]
    with pytest.raises(KeyboardInterrupt):
        press()


def test_a_finalizer_does_not_swallow_it():
    class Held:
        def __del__(self):
            press()

    with pytest.raises(KeyboardInterrupt):
        in_a_block(Held)


def test_a_second_one_is_raised_at_once():
    reached = []
    with pytest.raises(KeyboardInterrupt):
        in_a_block(press, press, lambda: reached.append("end"))
    assert not reached


def test_an_error_of_the_block_is_what_is_told():
    with pytest.raises(ZeroDivisionError):
        in_a_block(press, lambda: 1 / 0)
    in_a_block()


def test_other_handlers_and_threads_are_left_alone():
    heard = []
    signal.signal(signal.SIGINT, lambda *_: heard.append(1))
    with held_interrupts():
        press()
        assert heard == [1]
    worked = []

    def work():
        with held_interrupts():
            worked.append(1)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert worked == [1]
