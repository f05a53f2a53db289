"""The module that pyserial loads to open emulator://HOST."""

from urllib.parse import urlsplit

from realitygap.errors import RobotError
from realitygap.robot_families import default_family, load, robot_families


def serial_class_for_url(url: str) -> tuple[str, type]:
    """Return the class of the port that a URL names; without a host, that of the default family.

    Raises:
        RobotError: No family has a robot of this name.
    """
    host = urlsplit(url).netloc
    emulators = {
        host: reference for family in robot_families() for host, reference in family.emulators.items()
    }
    if host and host not in emulators:
        known = ", ".join(f"emulator://{name}" for name in emulators)
        raise RobotError(f"There is no emulated robot emulator://{host}. Expected {known}.")
    return url, load(emulators[host] if host else next(iter(default_family().emulators.values())))
