"""Commands in this process. Each argument is a word; paths and numbers become text."""

from __future__ import annotations

from typer.testing import CliRunner

from realitygap.cli import app
from realitygap.errors import RealityGapError


def printed(*words: object) -> str:
    """What a command prints; its errors as they reach `main`, which prints them as one message."""
    done = CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False)
    assert done.exit_code == 0, (words, done.output)
    return done.output


def refused(*words: object) -> str:
    """The message of a command that fails."""
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert isinstance(done.exception, RealityGapError), (words, done.output)
    return str(done.exception)


def answered(*words: object) -> str:
    """The words of a command, whether it succeeds or refuses."""
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exception is None or done.exit_code == 1, (words, done.output)
    return str(done.exception) if done.exception else done.output
