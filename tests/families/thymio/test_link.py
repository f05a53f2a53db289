"""What goes wrong on a port of a Thymio: one message each, without a robot."""

import pytest

from realitygap.errors import RobotError, RobotTimeout
from realitygap.families.thymio import Thymio
from realitygap.families.thymio import _messages as messages
from realitygap.families.thymio._messages import Decoder, Kind, Message
from realitygap.robots import StallRule


class Answering:
    """A port that answers the messages of a kind with others."""

    name = "a port"

    def __init__(self, answers):
        self._answers, self._decoder, self._waiting, self.is_pulled = answers, Decoder(), b"", False

    @property
    def in_waiting(self):
        return len(self._waiting)

    def write(self, data):
        if self.is_pulled:
            raise OSError(5, "Input/output error")
        self._decoder.feed(data)
        while (message := self._decoder.next()) is not None:
            self._waiting += b"".join(each.encoded() for each in self._answers.get(message.kind, ()))

    def read(self, size):
        data, self._waiting = self._waiting[:size], self._waiting[size:]
        return data

    def close(self):
        pass


def present(node):
    return Message(node, Kind.NODE_PRESENT, messages.words([messages.VERSION]))


def head(name):
    return Message(
        1, Kind.DESCRIPTION, bytes([len(name)]) + name.encode() + messages.words([5, 1534, 32, 620, 0, 0, 0])
    )


def test_silence_is_no_thymio():
    with pytest.raises(RobotTimeout, match=r"No Thymio answers on a port\. Is the robot on"):
        Thymio(Answering({}))


def test_two_robots_on_one_dongle_are_named():
    port = Answering({Kind.LIST_NODES: [present(1), present(7)]})
    with pytest.raises(RobotError, match=r"2 robots answer on a port: nodes 1, 7\. Switch off all but one"):
        Thymio(port)


def test_another_device_is_named():
    port = Answering({Kind.LIST_NODES: [present(1)], Kind.GET_NODE_DESCRIPTION: [head("e-puck")]})
    with pytest.raises(RobotError, match="'e-puck', expected a Thymio II"):
        Thymio(port)


def test_a_dongle_that_is_pulled_is_a_lost_link():
    port = Answering({})
    port.is_pulled = True
    with pytest.raises(RobotError, match=r"lost: .*Was the dongle or the cable pulled"):
        Thymio(port)


def test_settings_that_cannot_be_are_refused():
    with pytest.raises(ValueError, match="expected 0 or more"):
        Thymio(Answering({}), full_speed=0)


def test_a_wheel_that_is_held_counts_as_stalled_after_a_while():
    rule, targets = StallRule(50), (300, -300)
    assert not rule.is_stalled(0.0, targets, (20, -290))
    assert not rule.is_stalled(0.2, targets, (20, -290))
    assert rule.is_stalled(0.3, targets, (20, -290))
    assert not rule.is_stalled(0.4, targets, (280, -290))
    assert not rule.is_stalled(0.5, (20, 20), (0, 0))
