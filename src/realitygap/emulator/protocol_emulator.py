"""The module that pyserial loads to open emulator://."""

from urllib.parse import urlsplit

from ._port import EmulatedPort
from .thymio._port import HOST, PlaygroundPort


def serial_class_for_url(url: str) -> tuple[str, type]:
    """Return the class of the port that a URL names: a playground's, or a Scribbler's."""
    return url, PlaygroundPort if urlsplit(url).netloc == HOST else EmulatedPort
