"""The memory of a robot and its Fluke that lasts while they are switched off."""

from __future__ import annotations

import json
import secrets
import warnings
from pathlib import Path
from typing import Any

from realitygap._limits import MOST_JSON_BYTES, parse_json, read_file
from realitygap.errors import RobotError

NAME = b"Scribby".ljust(16)
PASSWORDS = {"s1": b"Scribby".ljust(16), "s2": b"YBBIRCs".ljust(16)}
TRIM = bytes((127, 127, 127, 127, 0, 0, 0, 0))
PAGES, PAGE_BYTES = 512, 264  # of the Fluke's serial memory
SCRIBBLER_AHEAD = 0xDF  # first byte of that memory; anything else means Fluke ahead
BLANK = 0xFF


class Memory:
    """The robot's EEPROM and the Fluke's serial memory.

    Attributes:
        name: 16 characters.
        password: 16 characters.
        data: Eight bytes for the user; the first four trim the motors.
        echo: Whether every answer ends with its opcode.
        broadcast: Whether the name is sent once a second after switching on.
        quiet: Whether the speaker is off.
        volume: Volume of an S2's speaker, 0 to 100.
        pages: Pages of the Fluke's serial memory that were ever written.

    Args:
        model: "s1" or "s2", which differ in their first password.
        file: File of the memory. Default: none.

    Raises:
        RobotError: The file is there and cannot be read, or cannot be written.
    """

    def __init__(self, model: str, file: Path | None = None) -> None:
        self.name = bytearray(NAME)
        self.password = bytearray(PASSWORDS[model])
        self.data = bytearray(TRIM)
        self.echo, self.broadcast, self.quiet, self.volume = 0, 0, 0, 25
        self.pages: dict[int, bytearray] = {}
        self._file = file
        if file is not None and file.exists():
            self._load(file)
        self._write()  # a file that cannot be kept is better known now than when a client sets something

    def read_page(self, page: int, offset: int) -> int:
        """Return a byte of the serial memory; addresses beyond its end wrap around."""
        return self.pages.get(page % PAGES, bytes([BLANK]) * PAGE_BYTES)[offset % PAGE_BYTES]

    def write_page(self, page: int, offset: int, value: int) -> None:
        """Write a byte of it."""
        self.pages.setdefault(page % PAGES, bytearray([BLANK] * PAGE_BYTES))[offset % PAGE_BYTES] = value
        self.save()

    def erase_page(self, page: int) -> None:
        """Make a page blank."""
        self.pages.pop(page % PAGES, None)
        self.save()

    @property
    def fluke_ahead(self) -> bool:
        """End that is ahead."""
        return self.read_page(0, 0) != SCRIBBLER_AHEAD

    def set_echo(self, value: int) -> None:
        """Keep echo mode."""
        if value != self.echo:
            self.echo = value
            self.save()

    def save(self) -> None:
        """Write the file, if there is one; a robot whose file cannot be written any more lives on, with a warning."""
        try:
            self._write()
        except RobotError as error:
            warnings.warn(f"{error} It will be forgotten with this emulator.", stacklevel=2)

    def _write(self) -> None:
        if self._file is None:
            return
        try:
            # a random name, so that no other user can put a link there
            beside = self._file.with_name(f".{self._file.name}.{secrets.randbits(63)}.tmp")
            try:
                with beside.open("x", encoding="utf-8") as file:
                    file.write(json.dumps(self._to_dict(), indent=2) + "\n")
                beside.replace(self._file)
            finally:
                beside.unlink(missing_ok=True)
        except OSError as error:
            raise RobotError(
                f"{self._file}: the robot's memory cannot be kept ({error.strerror})."
            ) from error

    def _to_dict(self) -> dict[str, Any]:
        return {
            "name": self.name.hex(),
            "password": self.password.hex(),
            "data": self.data.hex(),
            "echo": self.echo,
            "broadcast": self.broadcast,
            "quiet": self.quiet,
            "volume": self.volume,
            "pages": {str(page): data.hex() for page, data in sorted(self.pages.items())},
        }

    def _load(self, file: Path) -> None:
        try:
            text = read_file(file, MOST_JSON_BYTES)
        except OSError as error:
            raise RobotError(f"{file}: the robot's memory cannot be read ({error.strerror}).") from error
        try:
            values = parse_json(text)
            self.name[:] = _bytes(values["name"], 16)
            self.password[:] = _bytes(values["password"], 16)
            self.data[:] = _bytes(values["data"], 8)
            self.echo, self.broadcast, self.quiet, self.volume = (
                int(values[key]) & 0xFF for key in ("echo", "broadcast", "quiet", "volume")
            )
            for page, data in values["pages"].items():
                self.pages[int(page) % PAGES] = bytearray(_bytes(data, PAGE_BYTES))
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise RobotError(
                f"{file} is not the memory of an emulated robot ({type(error).__name__}: {error}). Remove it to begin "
                "with a new robot."
            ) from error


def _bytes(text: str, length: int) -> bytes:
    data = bytes.fromhex(text)
    if len(data) != length:
        raise ValueError(f"{len(data)} bytes, expected {length}")
    return data
