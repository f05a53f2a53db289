"""A node in a DDS domain: cyclonedds with the names of ROS 2. Only gateways and `emulate` import it."""

from __future__ import annotations

import functools
import math
import os
import struct
import time
from collections.abc import Iterator, Mapping
from typing import Any, cast
from xml.sax.saxutils import quoteattr

from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import DDSException, InstanceState
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct, make_idl_struct
from cyclonedds.idl import types as idl
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from ._lines import MOST_VALUES, TICK_S
from ._messages import TWIST, TWIST_STAMPED, fields_of, message_of, name_on_wire, topic_on_wire

SENSOR_QOS = Qos(Policy.Reliability.BestEffort, Policy.History.KeepLast(10))
"""Of readers: it fits reliable publishers, too. A reader that asks for reliable gets nothing of a best-effort one."""
NEWEST_QOS = Qos(Policy.Reliability.Reliable(duration(milliseconds=100)), Policy.History.KeepLast(1))
"""Of writers: it fits readers of either kind. It is volatile, because a late reader must not get an old command."""
MALFORMED = (DDSException, struct.error, ValueError, IndexError, OverflowError, MemoryError)
"""What reading a message raises if it is of another type with the same name."""
SUBSCRIBER_S = 3.0
"""Longest wait for a robot that was there before [s]."""

_PRIMITIVES: dict[str, tuple[Any, Any]] = {
    **{name: (getattr(idl, name), 0) for name in ("int8", "int16", "int32", "int64")},
    **{name: (getattr(idl, name), 0) for name in ("uint8", "uint16", "uint32", "uint64")},
    **{name: (getattr(idl, name), 0.0) for name in ("float32", "float64")},
    "byte": (idl.byte, 0),
    "char": (idl.char, 0),
    "bool": (bool, False),
    "string": (str, ""),
}
"""The type and the default of each primitive type of ROS."""
_IDENTITIES = {"geometry_msgs/msg/Quaternion": {"w": 1.0}}


@functools.cache
def type_of(message: str) -> type[IdlStruct]:
    """Return the class of a message."""
    parts: dict[str, Any] = {}
    for field in fields_of(message):
        kind = _PRIMITIVES[field.kind][0] if field.kind in _PRIMITIVES else type_of(field.kind)
        if field.size == 0:
            kind = cast(Any, idl.sequence)[kind]
        elif field.size is not None:
            kind = cast(Any, idl.array)[kind, field.size]
        parts[field.name] = kind
    return make_idl_struct(message.rpartition("/")[2] + "_", name_on_wire(message), parts)


def filled(message: str, values: Mapping[str, Any]) -> Any:
    """Return a message with some values; the others are 0, empty, or identity. A number that is None is infinite."""
    parts: dict[str, Any] = {}
    values = _IDENTITIES.get(message, {}) | dict(values)
    for field in fields_of(message):
        given = values.get(field.name)
        if field.kind in _PRIMITIVES:
            default = _PRIMITIVES[field.kind][1]
            if field.name not in values:
                given = default if field.size is None else [default] * field.size
            parts[field.name] = _infinite(given)
        elif field.size is None:
            parts[field.name] = filled(field.kind, given or {})
        else:
            parts[field.name] = [filled(field.kind, each) for each in given or ()]
    return type_of(message)(**parts)


def plain(message: str, value: Any) -> dict[str, Any]:
    """Return a message as JSON knows it, without covariances; numbers that are infinite or NaN are None."""
    parts: dict[str, Any] = {}
    for field in fields_of(message):
        given = getattr(value, field.name)
        if field.name == "covariance":
            continue
        if field.kind not in _PRIMITIVES:
            parts[field.name] = (
                plain(field.kind, given)
                if field.size is None
                else [plain(field.kind, each) for each in given]
            )
        elif field.size is not None:
            parts[field.name] = [_finite(each) for each in given]
        else:
            parts[field.name] = _finite(given)
    return parts


def _infinite(value: Any) -> Any:
    if isinstance(value, list):
        return [_infinite(each) for each in value]
    return math.inf if value is None else value


def _finite(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def n_values(message: str, value: Any) -> int:
    """Return the number of values in the sequences of a message."""
    return sum(len(getattr(value, field.name)) for field in fields_of(message) if field.size == 0)


def configuration(interface: str) -> str:
    """Return the configuration that keeps traffic on an interface: `lo`, without multicast, or `auto`, DDS's choice."""
    named = 'autodetermine="true"' if interface == "auto" else f"name={quoteattr(interface)}"
    multicast = "false" if interface == "lo" else "true"
    peers = '<Peers><Peer address="127.0.0.1"/></Peers>' if interface == "lo" else ""
    return (
        "<CycloneDDS><Domain><General>"
        f"<Interfaces><NetworkInterface {named}/></Interfaces>"
        f"<AllowMulticast>{multicast}</AllowMulticast></General><Discovery>{peers}"
        "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>119</MaxAutoParticipantIndex></Discovery>"
        "</Domain></CycloneDDS>"
    )


class Node:
    """A participant in a domain.

    Args:
        domain: Number of the domain, `ROS_DOMAIN_ID`.
        interface: Network interface, such as `eth0`; empty for the configuration in `CYCLONEDDS_URI`.

    Raises:
        ValueError: The interface or the domain cannot be used.
    """

    def __init__(self, domain: int, interface: str) -> None:
        try:
            if interface:
                self._domain = Domain(domain, configuration(interface))
            elif not os.environ.get("CYCLONEDDS_URI"):
                raise ValueError("no interface is named")
            self._participant = DomainParticipant(domain)
        except DDSException as error:
            raise ValueError(
                f"DDS cannot use interface {interface or 'of CYCLONEDDS_URI'} in domain {domain}. Name one of this "
                "machine, such as lo or wlan0, or auto."
            ) from error
        self._readers: dict[str, tuple[str, DataReader[Any]]] = {}
        self._writers: dict[tuple[str, str], DataWriter[Any]] = {}
        self._newest: dict[str, dict[str, Any]] = {}
        self._ends = (
            ("publisher", BuiltinDataReader(self._participant, BuiltinTopicDcpsPublication)),
            ("subscriber", BuiltinDataReader(self._participant, BuiltinTopicDcpsSubscription)),
        )
        self._known: dict[str, dict[str, Any]] = {}

    def _topic(self, topic: str, message: str) -> Topic[Any]:
        return Topic(self._participant, topic_on_wire(topic), type_of(message))

    def subscribe(self, topic: str, message: str) -> None:
        """Listen to a topic."""
        self._readers[topic] = (
            message,
            DataReader(self._participant, self._topic(topic, message), qos=SENSOR_QOS),
        )

    def kind_of(self, topic: str) -> str:
        """Return the type of a topic that the node listens to."""
        return self._readers[topic][0]

    def take(self) -> Iterator[tuple[str, Any]]:
        """Yield what has come since the last call, with its topic."""
        for topic, (message, reader) in self._readers.items():
            try:
                samples = reader.take(100)
            except MALFORMED:
                continue
            for sample in samples:
                if not isinstance(sample, type_of(message)):  # its publisher has left
                    continue
                known = self._newest.setdefault(topic, {"n": 0})
                known |= {"n": known["n"] + 1, "at": time.monotonic(), "message": sample}
                yield topic, sample

    def newest(self) -> dict[str, dict[str, Any]]:
        """Return the newest message of each topic, its age [s], how many came, and how many programs publish it."""
        now = time.monotonic()
        found = {}
        for topic, known in self._newest.items():
            kind, reader = self._readers[topic]
            seen = found[topic] = {
                "n": known["n"],
                "age": now - known["at"],
                "publishers": len(reader.get_matched_publications()),
            }
            if (n := n_values(kind, known["message"])) > MOST_VALUES:
                seen["too_long"] = n
                continue
            if "plain" not in known or known["plain"][0] != known["n"]:
                known["plain"] = known["n"], plain(kind, known["message"])
            seen["message"] = known["plain"][1]
        return found

    def _writer(self, topic: str, message: str) -> DataWriter[Any]:
        """Return the writer of a topic; the first call makes it."""
        if (topic, message) not in self._writers:
            made = DataWriter(self._participant, self._topic(topic, message), qos=NEWEST_QOS)
            self._writers[topic, message] = made
        return self._writers[topic, message]

    def publish(self, topic: str, message: str, values: Mapping[str, Any]) -> None:
        """Publish a message; values that are left out are 0."""
        try:
            self._writer(topic, message).write(filled(message, values))
        except DDSException as error:  # a slow reader; the next message replaces this one
            if error.code != DDSException.DDS_RETCODE_TIMEOUT:
                raise

    def graph(self) -> list[dict[str, Any]]:
        """Return who publishes and subscribes in the domain, this process left out."""
        self._look()
        return list(self._known.values())

    def _look(self) -> None:
        own = str(self._participant.guid)[:-8]
        for role, reader in self._ends:
            for sample in reader.take(1000):
                key = str(sample.key)
                state = sample.sample_info.instance_state
                if not getattr(sample, "topic_name", None) or state != InstanceState.Alive:
                    self._known.pop(key, None)
                    continue
                if not sample.topic_name.startswith("rt/") or key.startswith(own):
                    continue
                qos = sample.qos
                self._known[key] = {
                    "role": role,
                    "topic": sample.topic_name[2:],
                    "kind": message_of(sample.type_name),
                    "who": str(sample.participant_key),
                    "reliable": not isinstance(qos[Policy.Reliability], type(Policy.Reliability.BestEffort)),
                    "durable": qos[Policy.Durability] != Policy.Durability.Volatile,
                }

    def command_kinds(self, topic: str) -> list[str]:
        """Return the types of commands that a subscriber of a topic takes, and that this node can publish to it now."""
        self._look()
        taken = {
            end["kind"]
            for end in self._known.values()
            if end["role"] == "subscriber" and end["topic"] == topic
        }
        kinds = [kind for kind in (TWIST, TWIST_STAMPED) if kind in taken]
        return [kind for kind in kinds if self._writer(topic, kind).get_matched_subscriptions()]

    def wait_for_subscriber(self, topic: str) -> None:
        """Return when a subscriber takes commands on a topic, or after `SUBSCRIBER_S`."""
        end = time.monotonic() + SUBSCRIBER_S
        while time.monotonic() < end and not self.command_kinds(topic):
            time.sleep(TICK_S)

    def close(self) -> None:
        """Leave the domain."""
        self._readers.clear()
        self._writers.clear()
