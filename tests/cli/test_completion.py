"""The Tab key, in real shells on a pseudo-terminal."""

import os
import pty
import select
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

SHELLS = {
    "bash": (["--norc", "--noprofile", "-i"], 'eval "$(realitygap --show-completion bash)"'),
    "zsh": (
        ["-f", "-i"],
        'autoload -Uz compinit && compinit -u -D && eval "$(realitygap --show-completion zsh)"',
    ),
}
PATIENCE_S = 60.0


@pytest.mark.slow
@pytest.mark.parametrize("name", SHELLS)
def test_tab_completes_commands_and_options(name, tmp_path):
    shell = shutil.which(name)
    if shell is None:
        pytest.skip(f"no {name} on this machine; the package {name} has it")
    options, setup = SHELLS[name]
    with _Terminal([shell, *options], tmp_path) as terminal:
        terminal.type(f"PS1='go''> '; {setup}\n", until="go> ")
        terminal.type("realitygap print-\t\t", until="print-tags")
        assert "print-sheet" in terminal.seen
        terminal.type("\x15realitygap run --repl\t", until="--replicates")
        terminal.type("\x15realitygap gap sim jyro --observe enc\t", until="encoders")


class _Terminal:
    """A shell on a pseudo-terminal."""

    def __init__(self, command: list[str], home: Path) -> None:
        self.seen = ""
        self._master, slave = pty.openpty()
        path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
        environment = os.environ | {"HOME": str(home), "PATH": path, "TERM": "dumb", "COLUMNS": "200"}
        self._process = subprocess.Popen(
            command,
            stdin=slave,
            stdout=slave,
            stderr=slave,
            env=environment,
            cwd=home,
            start_new_session=True,
        )
        os.close(slave)

    def __enter__(self) -> "_Terminal":
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()
        os.close(self._master)

    def type(self, keys: str, *, until: str) -> None:
        """Type keys, and wait until a text appears."""
        self.seen = ""
        os.write(self._master, keys.encode())
        end = time.monotonic() + PATIENCE_S
        while until not in self.seen:
            ready, _, _ = select.select([self._master], [], [], max(0.0, end - time.monotonic()))
            assert ready, f"no {until!r} after {keys!r}: {self.seen!r}"
            self.seen += os.read(self._master, 1 << 16).decode(errors="replace")
