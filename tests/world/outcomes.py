"""What comes of values by chance: something, or a message."""


def made_or_told(make):
    """What a function makes, or what it says is wrong."""
    try:
        return make()
    except ValueError as error:
        return str(error)
