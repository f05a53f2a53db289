"""The Thymio II in figures, for each platform that drives or simulates it."""

from __future__ import annotations

from functools import cached_property
from typing import ClassVar

from realitygap.platforms import Platform
from realitygap.world import Body, RangeSensors, RobotModel, load_robot


class ThymioBody(Platform):
    """A platform whose robot is a Thymio II."""

    base_robot: ClassVar[str] = "thymio"

    @cached_property
    def _model(self) -> RobotModel:
        return load_robot(self.base_robot)

    @property
    def body(self) -> Body:
        """The outline of the Thymio in figures."""
        return Body(tuple(self._model.body[0].corners))

    @property
    def sensors(self) -> RangeSensors:
        """The mounts of its infrared sensors in figures."""
        return RangeSensors(self._model.mounts, self._model.reach)

    @property
    def outline_words(self) -> str:
        """The origin of the outline in figures, for their captions."""
        return "Enki’s"
