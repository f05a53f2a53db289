"""A robot with two wheels that speaks ROS 2's protocol through Fast DDS and moves in Enki, in real time.

It is the independent peer of the driver: Fast DDS is the default middleware of ROS 2, and shares no code with Cyclone
DDS. Its label is EMULATED (Enki over Fast DDS). The C++ program `robot.cpp` needs g++, libenki-dev, and
libfastrtps-dev. `build` compiles it once, in about 10 s, and stores it in the cache by the hash of its sources.

Run it for a driver:

    python -m tests.families.ros2.fast_dds --arena paper --witness 7002 namespace=/robot1 gains=1,0.95

Everything stays on 127.0.0.1, without multicast. A Cyclone DDS peer needs the settings in `LOOPBACK`.

Topics, each below `rt` and the namespace:

    cmd_vel                  geometry_msgs/Twist, received; also or only TwistStamped with `stamped_topic`
    odom                     nav_msgs/Odometry, frames odom and base_link; twist is the mean since the last message
    scan                     sensor_msgs/LaserScan, from the center of the robot
    range_0, range_1, ...    sensor_msgs/Range: the nearest wall in a cone of five rays; Range of ROS 2 Humble, or of
                             Iron and later if `variance` is above 0
    bumper                   std_msgs/Bool: the robot has touched a wall since the last message
    pose                     geometry_msgs/PoseStamped, frame map: the true pose

Options, as keywords of `FastRobot`, or as words NAME=VALUE of the command, with their defaults:

    namespace=               prefix of all topics, as in /robot1
    twist_topic=cmd_vel, stamped_topic=        topics of commands; empty: none
    reliable=cmd_vel,odom,bumper,pose          reliable topics (scan, range, ...); all others are best effort
    byte_order=little        or big
    renamed=                 topics that announce another type
    rate_odom=50, rate_scan=10, rate_range=20, rate_bumper=20, rate_pose=0    [Hz], up to 1/step; 0: no such topic
    step=0.001               step of the physics [s]
    seed=0                   of all noise, until the robot is placed
    start=0,0,0              pose at the start [m], [rad]; here that of the arena
    axle=0.1, radius=0.05    distance between the wheels, and radius of the body [m]
    max_wheel=0.3            speed limit of each wheel [m/s]
    timeout=0.5              time after which a command ends [s]; 0: never
    max_age=0                largest age of a stamped command [s]; 0: any
    delay=0, lag=0           dead time of commands, time constant of the wheels [s]
    gains=1,1                speed of each wheel per commanded speed; odometry includes it
    wheel_noise=0            standard deviation of a wheel's distance after 1 m [m]; odometry includes it
    odometry_scale=1,1       distance of each wheel in the odometry per true distance
    odometry_noise=0         standard deviation of a wheel's distance in the odometry after 1 m [m]
    odometry_restarts=0      1: odometry restarts when the robot is placed
    clock_shift=0            seconds that stamps are ahead of this computer's clock
    range=X,Y,ANGLE          mount of a range sensor in the robot's frame; repeated
    range_limits=0.005,1, cone=0.1, range_noise=0, variance=0    limits [m], angle [rad], standard deviation [m]
    scan_rays=360, scan_angles=-pi,pi-1°, scan_limits=0.05,3.5, scan_noise=0
    nothing=inf              reading if no wall is in the limits: inf, nan, 0, or a number
    wall=X1,Y1,X2,Y2         repeated; here those of the arena

Control lines of `FastRobot.ask`, each answered by a line of JSON, null if there is nothing to report:

    place X Y HEADING SEED   at rest; the path and the noise restart
    now, pose, path, motors  time [s]; [x, y, heading]; [[t, x, y, heading], ...] since placed; wheel speeds [m/s]
    commands                 {"twist": n, "stamped": n, "refused": n, "linear": v, "angular": w}, as received
    endpoints                {topic: [matched peers, peers refused for their quality of service]}
    shift S                  stamps are S seconds ahead of the clock
    mute TOPIC, unmute TOPIC stop and resume a topic
    scan_rays N              a scan of another length; 2621440 rays are a message of 10 MiB
    readings VALUE           nan, inf, or a number for all ranges; `true` for true ones again
    leave, return            leave the network, and join it again

A `FastRobot` is also a witness. `serve` answers the requests of `realitygap ... --witness HOST:PORT`.

The robot steps in real time. A command counts from the time at which Fast DDS received it, so a late step does not
change the path by more than one step. Not simulated: acceleration limits, slip without contact, and TF.
"""

from __future__ import annotations

import argparse
import contextlib
import fcntl
import hashlib
import json
import os
import selectors
import shutil
import subprocess
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap._closed_on_exit import ClosedOnExit
from realitygap.emulator import WitnessDoor, cells_at_times, open_arena
from realitygap.errors import RobotError
from realitygap.kernels.compile.cache import cache_root
from realitygap.world import Arena, Pose, cells_along, paper_arena

SOURCES = [Path(__file__).with_name(name) for name in ("robot.cpp", "messages.h")]
HEADERS = {
    "enki/PhysicalEngine.h": "libenki-dev",
    "fastdds/dds/topic/TopicDataType.hpp": "libfastrtps-dev",
}
LOOPBACK = (
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo"/></Interfaces><AllowMulticast>false'
    '</AllowMulticast></General><Discovery><Peers><Peer address="127.0.0.1"/></Peers><ParticipantIndex>auto'
    "</ParticipantIndex></Discovery></Domain></CycloneDDS>"
)
"""CYCLONEDDS_URI of a peer."""
REPEATED = ("range", "wall")
PATIENCE_S = 60.0


def why_not() -> str:
    """Return why the robot cannot be built here; empty if it can."""
    missing = [] if shutil.which("g++") else ["g++"]
    missing += [package for header, package in HEADERS.items() if not Path("/usr/include", header).exists()]
    return f"needs Debian packages: apt-get install {' '.join(missing)}" if missing else ""


@cache
def build() -> Path:
    """Return the path of the compiled program, which is in the folder `fast_dds` of the cache."""
    digest = hashlib.sha256(b"".join(source.read_bytes() for source in SOURCES)).hexdigest()[:16]
    path = cache_root() / "fast_dds" / f"robot-{digest}"
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    with (path.parent / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # several processes of tests need it
        if not path.exists():
            with tempfile.TemporaryDirectory(dir=path.parent) as folder:
                made = Path(folder, path.name)
                libraries = ["-lfastrtps", "-lfastcdr", "-lenki"]
                subprocess.run(
                    ["g++", "-O1", "-std=c++17", str(SOURCES[0]), "-o", str(made), *libraries], check=True
                )
                made.replace(path)
    return path


class FastRobot(ClosedOnExit):
    """A running robot, and its witness.

    Args:
        arena: Straight walls and obstacles, and the start; the paper's if not given.
        domain: Number of the DDS domain.
        options: Options of the program; a sequence of numbers, or of sequences for a repeated option.

    Raises:
        ValueError: The program does not accept the options, or an obstacle is round.
    """

    waits = False

    def __init__(self, arena: Arena | None = None, *, domain: int, **options: object) -> None:
        self._arena = arena or paper_arena()
        settings = {"start": tuple(self._arena.start), "wall": self._arena.straight_walls(), **options}
        words = [word for name, value in settings.items() for word in _words(name, value)]
        same = [build().name, *(word for word in words if not word.startswith("namespace="))]
        self._identity = hashlib.sha256(" ".join(same).encode()).hexdigest()[:12]
        self._lock = threading.Lock()
        self._is_over = threading.Event()
        self._threads: list[threading.Thread] = []
        self._process = subprocess.Popen(
            [str(build()), f"domain={domain}", *words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            self._read()
        except BaseException:
            self.close()
            raise

    def _read(self) -> Any:
        assert self._process.stdout is not None
        answer = json.loads(self._process.stdout.readline() or '{"error": "The robot has ended."}')
        if isinstance(answer, dict) and "error" in answer:
            raise ValueError(answer["error"])
        return answer

    def ask(self, line: str) -> Any:
        """Return the answer to a control line."""
        assert self._process.stdin is not None
        with self._lock:
            self._process.stdin.write(f"{line}\n")
            self._process.stdin.flush()
            return self._read()

    @property
    def process_id(self) -> int:
        """The number of the robot's process, for tests that stop or kill it."""
        return self._process.pid

    def wait_matched(self, *topics: str, peers: int = 1) -> None:
        """Wait until each of these topics has this number of peers."""
        wait_until(lambda: all(self.ask("endpoints")[topic][0] == peers for topic in topics))

    # the witness

    def release(self) -> None:
        """Do nothing: the time was not held."""

    def now(self) -> float:
        """Return the robot's time [s]."""
        return float(self.ask("now"))

    def place(self, pose: Pose, seed: int = 0) -> None:
        """Put the robot at a pose, at rest."""
        self.ask(f"place {' '.join(repr(float(value)) for value in pose)} {seed}")

    def arena(self) -> Arena:
        """Return the arena in which it drives."""
        return self._arena

    def identity(self) -> str:
        """Return a text that is equal for equal robots."""
        return f"Enki over Fast DDS, arena {self._arena.name}, {self._identity}"

    def pose(self) -> Pose:
        """Return the true pose."""
        return Pose(*self.ask("pose"))

    def motors(self) -> tuple[float, float]:
        """Return the speeds of the left and the right wheel [m/s]."""
        left, right = self.ask("motors")
        return left, right

    def path(self) -> NDArray[np.float64]:
        """Return time [s], x [m], y [m] and heading [rad] since the robot was placed, (t, 4)."""
        return np.array(self.ask("path"), np.float64).reshape(-1, 4)

    def cells(self) -> tuple[int, ...]:
        """Return cells of the arena's grid along the driven line, in order of first visits."""
        return cells_along(self.path()[:, 1:3], self._arena.grid)

    def cells_at(self, times: Sequence[float]) -> tuple[int, ...]:
        """Return cells of the grid in which the robot was at given times [s], in order of first visits."""
        return cells_at_times(self.path(), self._arena.grid, times)

    def serve(self, port: int = 0) -> str:
        """Answer witnesses until the robot is closed; return the address, such as 127.0.0.1:7002."""
        door, selector = WitnessDoor(self, port), selectors.DefaultSelector()
        door.watch(selector)

        def answer() -> None:
            while not self._is_over.is_set():
                for key, _ in selector.select(0.1):
                    door.serve(key.fileobj)
            door.close()
            selector.close()

        self._threads.append(threading.Thread(target=answer, daemon=True))
        self._threads[-1].start()
        return door.address

    def close(self) -> None:
        """End the robot; safe to call twice."""
        self._is_over.set()
        for thread in self._threads:
            thread.join()
        with contextlib.suppress(BrokenPipeError):
            self._process.communicate(timeout=PATIENCE_S)


def wait_until(is_so: Callable[[], bool]) -> None:
    """Wait for an event."""
    until = time.monotonic() + PATIENCE_S
    while not is_so():
        assert time.monotonic() < until, f"not within {PATIENCE_S:g} s"
        time.sleep(0.01)


def _words(name: str, value: Any) -> list[str]:
    values = value if name in REPEATED else [value]
    return [
        f"{name}={','.join(map(str, each)) if isinstance(each, list | tuple) else each}" for each in values
    ]


def main() -> None:
    """Run a robot until it is interrupted."""
    parser = argparse.ArgumentParser(
        description="Run a robot that speaks ROS 2's protocol and moves in Enki."
    )
    parser.add_argument("--arena", default="paper", help="Name or file of the arena.")
    parser.add_argument("--domain", type=int, default=int(os.environ.get("ROS_DOMAIN_ID", "0")))
    parser.add_argument("--witness", type=int, default=0, help="Port of the witness; 0 for a free one.")
    parser.add_argument("options", nargs="*", help="NAME=VALUE, as in gains=1,0.95")
    words = parser.parse_args()
    options: dict[str, Any] = {}
    for name, _, value in (word.partition("=") for word in words.options):
        options[name] = [*options.get(name, []), value] if name in REPEATED else value
    try:
        robot = FastRobot(open_arena(words.arena), domain=words.domain, **options)
    except (RobotError, ValueError) as error:
        parser.error(str(error))
    with robot:
        print(f"domain {words.domain}, witness {robot.serve(words.witness)}", flush=True)
        print(f"A Cyclone DDS peer needs CYCLONEDDS_URI='{LOOPBACK}'", flush=True)
        with contextlib.suppress(KeyboardInterrupt):
            threading.Event().wait()


if __name__ == "__main__":
    main()
