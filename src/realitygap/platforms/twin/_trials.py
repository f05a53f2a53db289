"""Trials on the platform `twin`: many networks, shared out among processes that each have the twin."""

from __future__ import annotations

import threading
import weakref
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, cast

from realitygap.errors import StudyError
from realitygap.evolution import inputs_of_robot
from realitygap.world import Arena

from .._stepwise import StepwiseTrials
from ._pool import TwinPool

if TYPE_CHECKING:
    from .._platform import Platform
    from ._platform import TwinPlatform

_pools: weakref.WeakValueDictionary[tuple[str, str, Arena], TwinPool] = weakref.WeakValueDictionary()
_last: list[TwinPool] = []  # the one used last is kept: the next chunk or trial wants it, too
_lock = threading.Lock()


class TwinTrials(StepwiseTrials):
    """The platform `twin` in an arena, ready to try networks of one kind; a `PlatformTrials`.

    A trial is a function of its random numbers' key and of the network: whichever process carries it out, and however
    many there are. All that have the same twin in the same arena share the processes.

    Raises:
        ControllerError: The twin does not have such inputs.
        StudyError: The file is another than that of the hash.
        DescriptionError: There is no such file, or it cannot be used.
        MissingExtraError: MuJoCo is not installed.
    """

    def _open(self, platform: Platform, noise: float) -> tuple[float, int]:
        twin = cast("TwinPlatform", platform)
        self._pool = _shared_pool(twin, self.arena)
        n_sensors = self._pool.n_sensors
        inputs = inputs_of_robot(n_sensors, self._pool.channels)
        self._interface.check(inputs, "A network", f"twin {twin.file}")
        return self._pool.step_s, n_sensors

    def _run(self, asked: list[dict[str, Any]]) -> Iterable[dict[str, Any]]:
        names = {"inputs": self._interface.inputs, "outputs": self._interface.outputs}
        more = {"do": "evolve", **names, "steps": self.n_steps}
        return self._pool.ask_all([{**each, **more} for each in asked])


def release_twins() -> None:
    """Keep no twin for the next trials: the processes of those that nobody else uses end."""
    with _lock:
        _last.clear()


def close_twins() -> None:
    """End the processes of all twins on which studies are carried out, whatever they are at."""
    with _lock:
        pools = list(_pools.values())
        _last.clear()
    for pool in pools:
        pool.close()


def _shared_pool(platform: TwinPlatform, arena: Arena) -> TwinPool:
    with _lock:
        name = (platform.file, platform.sha256, arena)
        pool = _pools.get(name)
        if pool is None or pool.is_closed:
            pool = TwinPool(platform.file, arena)
            if platform.sha256 not in ("", pool.sha256):
                pool.close()
                raise StudyError(
                    f"The twin's file {platform.file} has changed: its SHA-256 begins with {pool.sha256[:12]}, "
                    f"expected {platform.sha256[:12]}. Put the old file back, or begin anew with the new one."
                )
            _pools[name] = pool
        _last[:] = [pool]
    return pool
