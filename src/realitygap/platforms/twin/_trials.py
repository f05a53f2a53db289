"""Trials on the platform `twin`: many networks, shared out among processes that each have the twin."""

from __future__ import annotations

import threading
import weakref
from collections.abc import Iterable
from typing import Any

from realitygap.errors import StudyError
from realitygap.world import Arena

from .._stepwise import StepwiseTrials
from ._pool import TwinPool

_pools: weakref.WeakValueDictionary[tuple[str, str, Arena], TwinPool] = weakref.WeakValueDictionary()
_last: list[TwinPool] = []  # the one used last is kept: the next chunk or trial wants it, too
_lock = threading.Lock()


class TwinTrials(StepwiseTrials):
    """The platform `twin` in an arena, ready to try networks of one kind; a `PlatformTrials`.

    A trial is a function of its random numbers' key and of the network: whichever process carries it out, and however
    many there are. Its robot is a `TwinPool`.
    """

    def _run(self, asked: list[dict[str, Any]]) -> Iterable[dict[str, Any]]:
        names = {"inputs": self._interface.inputs, "outputs": self._interface.outputs}
        more = {"do": "evolve", **names, "steps": self.n_steps}
        answers: Iterable[dict[str, Any]] = self._robot.ask_all([{**each, **more} for each in asked])
        return answers


def release_twins() -> None:
    """Release the twins that are stored for further trials. The processes of unused ones end."""
    with _lock:
        _last.clear()


def close_twins() -> None:
    """End the processes of all twins of studies, whatever they are doing."""
    with _lock:
        pools = list(_pools.values())
        _last.clear()
    for pool in pools:
        pool.close()


def shared_pool(file: str, sha256: str, arena: Arena) -> TwinPool:
    """Return the processes of a twin in an arena, which all trials share.

    Raises:
        StudyError: The file is another than that of the hash.
        DescriptionError: There is no such file, or it cannot be used.
        MissingExtraError: MuJoCo is not installed.
    """
    with _lock:
        name = (file, sha256, arena)
        pool = _pools.get(name)
        if pool is None or pool.is_closed:
            pool = TwinPool(file, arena)
            if sha256 not in ("", pool.sha256):
                pool.close()
                raise StudyError(
                    f"The twin's file {file} has changed: its SHA-256 begins with {pool.sha256[:12]}, expected "
                    f"{sha256[:12]}. Restore the old file, or restart with the new one."
                )
            _pools[name] = pool
        _last[:] = [pool]
    return pool
