"""The robot's name, its versions, and its memory."""

from __future__ import annotations

from typing import Literal

from realitygap._version import __version__

from ._base import Base
from ._mistakes import MyroError, choice, number, whole

_FORWARDNESS: dict[str | int, Literal["fluke", "scribbler"]] = {
    "fluke-forward": "fluke", 1: "fluke",
    "scribbler-forward": "scribbler", 0: "scribbler",
}  # fmt: skip
_LONGEST = 16  # characters of a name or a password


class Identity(Base):
    """Name, password, eight bytes of data, and the end that is ahead. The robot stores them when it is switched off."""

    def getName(self) -> str:
        """Return the robot's name."""
        return self.driver.name

    def setName(self, name: str) -> None:
        """Give the robot a name of up to 16 characters."""
        self.driver.set_name(_short("setName: the name", name))

    def getPassword(self) -> str:
        """Return the robot's password."""
        return self.driver.password

    def setPassword(self, password: str) -> None:
        """Give the robot a password of up to 16 characters."""
        self.driver.set_password(_short("setPassword: the password", password))

    def getData(self, *position: int) -> int | list[int]:
        """Return the eight bytes that the robot keeps, or those at positions 0 to 7. Four correct its motors."""
        data = [int(value) for value in self.driver.data]
        picked = [data[whole("getData: the position", place, 0, 7)] for place in position]
        return data if not picked else picked[0] if len(picked) == 1 else picked

    def setData(self, position: int, value: int) -> None:
        """Set one of the eight bytes that the robot keeps, position 0 to 7, value 0 to 255."""
        self.setSingleData(position, value)

    def setSingleData(self, position: int, value: int) -> None:
        """Set data like `setData`."""
        self.driver.set_single_data(
            whole("setData: the position", position, 0, 7), whole("setData: the value", value, 0, 255)
        )

    def setFudge(self, f1: float, f2: float, f3: float, f4: float) -> None:
        """Correct a robot that does not drive straight: fast ahead, slow ahead, slow back, fast back.

        Args:
            f1, f2, f3, f4: Factors from 0 to 2: 1 changes neither wheel, above slows the left one, below the right one.
        """
        places = range(4) if self.driver.info.fluke == "none" else range(3, -1, -1)
        for place, fudge in zip(places, (f1, f2, f3, f4), strict=True):
            self.setSingleData(place, int(number("setFudge: a correction", fudge, 0, 2) * 127))

    def getFudge(self) -> tuple[float, float, float, float]:
        """Return the values that `setFudge` set, as the robot stores them."""
        values = [value / 127 if value else 1.0 for value in self.driver.data[:4]]
        f1, f2, f3, f4 = values if self.driver.info.fluke == "none" else values[::-1]
        return (f1, f2, f3, f4)

    def getForwardness(self) -> str:
        """Return the end that is ahead: "fluke-forward" or "scribbler-forward"."""
        return f"{self.driver.forwardness}-forward"

    def setForwardness(self, value: str | int) -> None:
        """Set which end is ahead: "fluke-forward" or 1, "scribbler-forward" or 0."""
        self.driver.set_forwardness(choice("setForwardness: the value", value, _FORWARDNESS))

    def identifyRobot(self) -> str:
        """Return the kind of the robot: "SCRIBBLER-1", "SCRIBBLER-2" or "UNKNOWN".

        Differs: told from what the robot said when it was opened; Myro's request resets the robot.
        """
        models = {"s1": "SCRIBBLER-1", "s2": "SCRIBBLER-2"}
        return models.get(self.driver.info.model or "", "UNKNOWN")

    def _facts(self) -> dict[str, str]:
        """Return the info line by its keys, and our version."""
        info = self.driver.info
        facts = {"fluke": info.fluke_version} if info.fluke != "none" else {}
        if info.model is not None:
            facts |= {
                "robot-version": info.robot_version,
                "robot": "Scribbler2" if info.model == "s2" else "Scribbler",
                "mode": "Serial",
            }
        return facts | {"myro": __version__}

    def getVersion(self) -> str:
        """Return the version of the robot's firmware."""
        return str(self.driver.info.robot_version)

    def getInfo(self, *item: str) -> str | list[str] | dict[str, str]:
        """Return the robot's identity by name: "robot", "robot-version", "fluke", "mode"; and "myro", ours.

        Args:
            item: Names of what is wanted; one gives its value, several a list, none all in a dictionary.

        Raises:
            MyroError: The robot says nothing of that.
        """
        info = self._facts()
        for name in item:
            if name.lower() not in info:
                raise MyroError(f"getInfo: this robot says nothing of {name!r}, only of {', '.join(info)}.")
        values = [info[name.lower()] for name in item]
        return info if not item else values[0] if len(values) == 1 else values


def _short(name: str, value: object) -> str:
    if not isinstance(value, str) or not value.isascii() or len(value) > _LONGEST:
        raise MyroError(f"{name} is {value!r}, expected up to {_LONGEST} letters and digits without accents.")
    return value
