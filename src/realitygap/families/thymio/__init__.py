"""The Thymio II, driven over its own protocol (Aseba). It was tried on Aseba's playground, never on a robot.

`playground` starts that simulator, and `enki` is its engine alone, as a platform.
"""

from typing import TYPE_CHECKING

from realitygap._lazy import lazy_names
from realitygap.robot_families import NetworkProgram, Reading, RobotFamily

if TYPE_CHECKING:
    from ._aseba import aseba_error, to_aseba
    from ._platform import ThymioPlatform
    from ._ports import find_ports
    from ._robot import Thymio, ThymioInfo
    from .enki._build import build_enki
    from .enki._platform import EnkiPlatform
    from .playground._playground import Playground

FAMILY = RobotFamily(
    name="thymio",
    noun="Thymio",
    package=__name__,
    platforms={
        "thymio": f"{__name__}._platform:ThymioPlatform",
        "enki": f"{__name__}.enki._platform:EnkiPlatform",
    },
    terminal=f"{__name__}._terminal",
    ports=("/dev/ttyACM0", "socket://HOST:PORT"),
    emulated="emulator://playground",
    emulators={"playground": f"{__name__}.playground._port:PlaygroundPort"},
    emulate=f"{__name__}._emulate:emulate",
    lacks=f"{__name__}.playground._playground:why_not",
    builds={"enki": f"{__name__}.enki._build:build_enki"},
    programs={"aseba": NetworkProgram(ending="aesl", write=f"{__name__}._aseba:to_aseba")},
    robot="thymio",
    range_readings={
        7: tuple(
            Reading(f"{place} infrared", "0 to 4,505", 4505.0)
            for place in ("Left", "Center left", "Center", "Center right", "Right", "Rear left", "Rear right")
        )
    },
    channel_readings={
        "line": tuple(
            Reading(f"{side} ground", "0 dark to 1023 bright", 1023.0) for side in ("Left", "Right")
        )
    },
)

__all__ = [
    "EnkiPlatform",
    "Playground",
    "Thymio",
    "ThymioInfo",
    "ThymioPlatform",
    "aseba_error",
    "build_enki",
    "find_ports",
    "to_aseba",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "EnkiPlatform": ".enki._platform",
        "Playground": ".playground._playground",
        "Thymio": "._robot",
        "ThymioInfo": "._robot",
        "ThymioPlatform": "._platform",
        "aseba_error": "._aseba",
        "build_enki": ".enki._build",
        "find_ports": "._ports",
        "to_aseba": "._aseba",
    },
)
