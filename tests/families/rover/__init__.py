"""A family of robots for tests, as a package of its own would add it: driver, emulator, and robot file."""

from realitygap.robot_families import Reading, RobotFamily

FAMILY = RobotFamily(
    name="rover",
    noun="Rover",
    package=__name__,
    platforms={"rover": f"{__name__}.robot:RoverPlatform"},
    terminal=f"{__name__}.robot",
    ports=("/dev/ttyUSB7",),
    emulated="emulator://rover",
    emulators={"rover": f"{__name__}.emulator:RoverPort"},
    emulate=f"{__name__}.emulator:emulate",
    robot="rover",
    range_readings={
        2: (Reading("Left distance", "0 to 255", 255.0), Reading("Right distance", "0 to 255", 255.0))
    },
)
