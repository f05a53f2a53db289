"""Jyro's ready-made sensors: infrared and bumpers of the Scribbler, sonars and light sensors of the Pioneer."""

from __future__ import annotations

from typing import ClassVar

from realitygap.world.jyro_stock import DEVICES, SONAR_RANGE

from ._sensors import Bumper, LightMode, LightSensor, RangeSensor

_PARTS = (
    "all", "front", "front-left", "front-right", "front-all", "left", "right", "left-front", "right-front",
    "left-back", "right-back", "back-right", "back-left", "back", "back-all",
)  # fmt: skip

_Groups = dict[str, tuple[int, ...]]


def _groups(n: int, **parts: tuple[int, ...]) -> _Groups:
    """Return groups for all of Jyro's names for parts of `n` sensors. Those not given are empty."""
    named = {name.replace("_", "-"): which for name, which in parts.items()}
    return {name: tuple(range(n)) if name == "all" else named.get(name, ()) for name in _PARTS}


_PAIR = _groups(
    2, front=(0, 1), front_left=(0,), front_right=(1,), front_all=(0, 1),
    left=(0,), right=(1,), left_front=(0,), right_front=(1,),
)  # fmt: skip


class MyroIR(RangeSensor):
    """Two infrared sensors that look to the front left and right, with a range of 0.5 m.

    Their mounts are outside the Scribbler's box, as in Jyro. Close to a wall, the rays begin behind the wall.
    """

    def __init__(self) -> None:
        stock = DEVICES["MyroIR"]
        super().__init__(stock["geometry"], stock["max_range"], kind="ir", groups=_PAIR)


class MyroBumper(Bumper):
    """Two feelers of 0.2 m at the front, to the left and the right."""

    def __init__(self) -> None:
        stock = DEVICES["MyroBumper"]
        super().__init__(stock["geometry"], stock["max_range"], groups=_PAIR)


class _Sonars(RangeSensor):
    _groups: ClassVar[_Groups]

    def __init__(self, max_range: float = SONAR_RANGE, *, arc: float = 0.0, noise: float = 0.0) -> None:
        mounts = DEVICES[type(self).__name__]["geometry"]
        super().__init__(mounts, max_range, kind="sonar", groups=self._groups, arc=arc, noise=noise)


class PioneerFrontSonar(_Sonars):
    """A sonar in the center that faces ahead."""

    _groups: ClassVar[_Groups] = {"all": (0,)}


class PioneerFrontSonars(_Sonars):
    """The eight front sonars of a Pioneer, from the left over the front to the right."""

    _groups = _groups(
        8, front=(3, 4), front_left=(1, 2, 3), front_right=(4, 5, 6), front_all=(1, 2, 3, 4, 5, 6),
        left=(0,), right=(7,), left_front=(1, 2), right_front=(5, 6),
    )  # fmt: skip


class PioneerBackSonars(_Sonars):
    """The eight rear sonars of a Pioneer, from the right over the back to the left."""

    _groups = _groups(
        8, left=(7,), right=(0,), left_back=(7,), right_back=(0,),
        back_right=(1, 2, 3), back_left=(4, 5, 6), back=(3, 4), back_all=(1, 2, 3, 4, 5, 6),
    )  # fmt: skip


class Pioneer16Sonars(_Sonars):
    """All sixteen sonars of a Pioneer, clockwise from the left."""

    _groups = _groups(
        16, front=(3, 4), front_left=(1, 2, 3), front_right=(4, 5, 6), front_all=(1, 2, 3, 4, 5, 6),
        left=(0, 15), right=(7, 8), left_front=(0,), right_front=(7,), left_back=(15,), right_back=(8,),
        back_right=(9, 10, 11), back_left=(12, 13, 14), back=(11, 12), back_all=(9, 10, 11, 12, 13, 14),
    )  # fmt: skip


class Pioneer4Sonars(_Sonars):
    """Four sonars of a Pioneer: front left and right, back right and left."""

    _groups = _groups(
        4, front=(0, 1), front_left=(0,), front_right=(1,), front_all=(0, 1),
        back_right=(2,), back_left=(3,), back=(2, 3), back_all=(2, 3),
    )  # fmt: skip


class PioneerFrontLightSensors(LightSensor):
    """Two light sensors at the front corners of a Pioneer."""

    def __init__(self, max_range: float, *, mode: LightMode = "linear") -> None:
        super().__init__(DEVICES[type(self).__name__]["geometry"], max_range, mode=mode, groups=_PAIR)


class Pioneer4FrontLightSensors(LightSensor):
    """Four light sensors along the front of a Pioneer, from left to right."""

    def __init__(self, max_range: float, *, mode: LightMode = "linear") -> None:
        groups = _groups(
            4, front=(1, 2), front_left=(0,), front_right=(3,), front_all=(0, 1, 2, 3),
            left=(0, 1), right=(2, 3), left_front=(0,), right_front=(3,),
        )  # fmt: skip
        super().__init__(DEVICES[type(self).__name__]["geometry"], max_range, mode=mode, groups=groups)


class MyroLightSensors(LightSensor):
    """Two light sensors at the front of a Scribbler, to the left and the right.

    Args:
        max_range: Distance at which linear light has faded [m].
        mode: Law by which light fades.

    Source: Jyro 0.3.2. Differs: there making one fails, because its range is not defined; here the range is given.
    """

    def __init__(self, max_range: float, *, mode: LightMode = "linear") -> None:
        super().__init__(DEVICES[type(self).__name__]["geometry"], max_range, mode=mode, groups=_PAIR)
