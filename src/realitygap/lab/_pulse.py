"""Answers of a robot in its trials, as its process reports them."""

from __future__ import annotations

import time

from ._channel import Channel

TOLD_S = 0.2
"""Time between two messages that a robot has answered [s]: it answers after every command."""


class Pulse:
    """Reports whether a trial is driven, and that its robot answers, at a limited rate.

    Args:
        channel: To the server.
    """

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self._is_driving = False
        self._told_s = 0.0

    def tell(self, is_driving: bool) -> None:
        """Report that the robot has answered in a trial, or that the trial has ended."""
        now = time.monotonic()
        if is_driving and self._is_driving and now - self._told_s < TOLD_S:
            return
        self._is_driving, self._told_s = is_driving, now
        self._channel.say("pulse", is_driving=is_driving)
