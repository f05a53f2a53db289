"""Who publishes and subscribes in a DDS domain, and what a driver misses there, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

from realitygap.errors import RobotError

from . import _messages as m
from ._address import Address

COMMANDS = (m.TWIST, m.TWIST_STAMPED)
SENSORS = (m.ODOMETRY, m.SCAN, m.RANGE)
"""Types that one program of a robot publishes."""
_MOST_NAMED = 12


@dataclass(frozen=True)
class Ends:
    """The ends of all topics.

    Attributes:
        all: `role`, `topic`, `kind`, `who`, `reliable`, and `durable` of each.
    """

    all: tuple[Mapping[str, Any], ...]

    def of(self, role: str, topic: str) -> list[Mapping[str, Any]]:
        """Return those with a role on a topic."""
        return [end for end in self.all if end["role"] == role and end["topic"] == topic]

    def n_programs(self, topic: str) -> int:
        """Return how many programs publish a topic of a robot's sensor; 0 for other topics."""
        return len({end["who"] for end in self.of("publisher", topic) if end["kind"] in SENSORS})

    def robots(self) -> dict[str, list[str]]:
        """Return the topics of what takes commands, by namespace."""
        found: dict[str, list[str]] = {}
        for end in self.all:
            if end["role"] == "subscriber" and end["kind"] in COMMANDS:
                namespace = end["topic"].rpartition("/")[0] or "/"
                below = namespace.rstrip("/") + "/"
                topics = {other["topic"] for other in self.all if other["topic"].startswith(below)}
                found[namespace] = sorted(topics)
        return found


def refuse_graph(
    ends: Ends,
    address: Address,
    command: str,
    topics: Mapping[str, str],
    missing: Sequence[str],
    frames: Sequence[str] = (),
    *,
    is_complete: bool,
) -> None:
    """Raise an error if a robot cannot be driven.

    Args:
        ends: All ends in the domain.
        address: Address of the robot.
        command: Topic of its commands.
        topics: Types of the topics that the driver reads.
        missing: Topics of which no message came.
        frames: Transforms that came.
        is_complete: True if nothing is missing, so that only two robots are refused.

    Raises:
        RobotError: Something is missing, or two robots share the topics.
    """
    interface = address.interface or "of CYCLONEDDS_URI"
    where = address.port or f"{address.namespace} (domain {address.domain}, interface {interface})"
    for topic, kind in topics.items():
        publishers = ends.of("publisher", topic)
        wrong = sorted({end["kind"] for end in publishers if end["kind"] != kind})
        if wrong:
            raise RobotError(
                f"{topic} has type {wrong[0]}, expected {kind}. Change [driver] in the robot file."
            )
        if kind in SENSORS:
            refuse_two(topic, len({end["who"] for end in publishers}))
    if is_complete:
        return
    takers = ends.of("subscriber", command)
    if not takers:
        _refuse_namespace(ends, command, where)
    if not any(end["kind"] in COMMANDS for end in takers):
        raise RobotError(
            f"{command} takes {takers[0]['kind']}, expected Twist or TwistStamped of geometry_msgs. Name the topic of "
            "commands in [driver] of the robot file."
        )
    if all(end["durable"] for end in takers):
        raise RobotError(
            f"The robot's subscriber of {command} asks for durability TRANSIENT_LOCAL, and commands are VOLATILE: "
            "the last one must not move a robot that appears later. Change the quality of service there."
        )
    for topic in missing:
        if not ends.of("publisher", topic):
            raise RobotError(
                f"Nobody publishes {topic} at {where}. Topics there: {_listed(ends)}. Start the robot's driver of this "
                "sensor, or name another topic in [driver] of the robot file."
            )
        if topics[topic] == m.TF:
            raise RobotError(
                f"{topic} tells no pose between the frames of pose_frames in [driver] of the robot file. Transforms "
                f"there: {', '.join(frames) or 'none'}. Static transforms are not read."
            )
        raise RobotError(
            f"{topic} is silent: it has a publisher, and no message came. Check the sensor, and the quality of "
            "service of its publisher: this reader asks for BEST_EFFORT and VOLATILE."
        )
    raise RobotError(f"The robot at {where} was not found in time. Try again.")


def refuse_two(topic: str, n: int) -> None:
    """Raise an error if several programs publish a topic of a robot's sensor.

    Raises:
        RobotError: They do.
    """
    if n > 1:
        raise RobotError(
            f"{n} programs publish {topic}: two robots in one namespace? Start each in a separate one, and name it: "
            "ros2:/robot1."
        )


def _refuse_namespace(ends: Ends, command: str, where: str) -> NoReturn:
    others = [f"ros2:{name}" for name in sorted(ends.robots())]
    if others:
        raise RobotError(f"Nobody takes commands on {command}. Robots there: {', '.join(others)}.")
    raise RobotError(
        f"Nobody takes commands on {command} at {where}. Topics there: {_listed(ends)}. Is the robot on, and are "
        "domain and interface right, as in ros2:/?domain=0&interface=wlan0?"
    )


def _listed(ends: Ends) -> str:
    names = sorted({end["topic"] for end in ends.all})
    more = f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else ""
    return ", ".join(names[:_MOST_NAMED]) + more if names else "none"
