"""The module that pyserial loads to open emulator://HOST."""

from urllib.parse import urlsplit

from realitygap.robot_families import default_family, load, robot_families


def serial_class_for_url(url: str) -> tuple[str, type]:
    """Return the class of the port that a URL names; one without a family's host is left to the default family."""
    host = urlsplit(url).netloc
    emulators = {
        host: reference for family in robot_families() for host, reference in family.emulators.items()
    }
    return url, load(emulators.get(host) or next(iter(default_family().emulators.values())))
