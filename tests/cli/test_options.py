"""Options of every command: one value means one, and messages name options that their command has."""

import pytest
import typer

from realitygap.cli import app


def commands():
    """Yield the words of every command, and the command."""
    for name, command in typer.main.get_command(app).commands.items():
        members = getattr(command, "commands", None)
        if members is None:
            yield (name,), command
        else:
            yield from (((name, key), member) for key, member in members.items())


def test_second_value_of_an_option_is_refused_by_every_command():
    """The last of several values counted, in silence."""
    n_options = 0
    for words, command in commands():
        for option in command.params:
            if option.param_type_name != "option" or option.is_flag or option.multiple or option.count:
                continue
            n_options += 1
            for first, second in ((option.opts[0], option.opts[-1]), (option.opts[-1], option.opts[0])):
                with pytest.raises(typer.BadParameter) as error:
                    command.make_context(words[-1], [first, "1", second, "2"])
                assert f"{option.opts[0]} is given 2 times" in error.value.message, (words, option.opts)
    assert n_options > 200
