"""A process of the lab that dies while it speaks."""

import subprocess
import sys
from threading import Event

from realitygap.lab._child import Child
from realitygap.lab._messages import Ended, Quit


def test_a_message_that_was_cut_by_the_end_of_its_process_is_dropped(tmp_path, monkeypatch, capfd):
    popen = subprocess.Popen
    dies = 'import os; os.write(1, b\'{"kind": "progress", "text": "ha\'); os._exit(3)'
    monkeypatch.setattr(
        subprocess, "Popen", lambda _, **options: popen([sys.executable, "-c", dies], **options)
    )
    heard, ended = [], Event()

    def hear(message):
        heard.append(message)
        if isinstance(message, Ended):
            ended.set()

    Child(Quit(), tmp_path, hear)
    assert ended.wait(60)
    assert heard == [Ended(3)]
    assert capfd.readouterr().err == ""
