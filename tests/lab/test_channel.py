"""A process of the lab hears that it is to end, wherever Python is."""

import subprocess
import sys

LOSES_ONE = """
import signal, time, weakref
from realitygap.lab._channel import keep_interrupts

class Thing:
    pass

signal.signal(signal.SIGINT, signal.default_int_handler)
keep_interrupts()
thing = Thing()
watched = weakref.ref(thing, lambda _: signal.raise_signal(signal.SIGINT))
try:
    del thing
    print("lost", flush=True)
    time.sleep(20)
except KeyboardInterrupt:
    print("heard")
"""


def test_ctrl_c_that_comes_in_the_callback_of_a_weak_reference_is_not_lost():
    done = subprocess.run(
        [sys.executable, "-c", LOSES_ONE], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.stdout.split() == ["lost", "heard"]
    assert done.stderr == ""
