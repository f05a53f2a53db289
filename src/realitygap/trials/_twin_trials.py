"""Trials on the platform `twin`: many networks, shared out among processes that each have the twin."""

from __future__ import annotations

import hashlib
import math
import threading
import weakref
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import StudyError
from realitygap.evolution import ControllerInterface, Network, inputs_of_ranges
from realitygap.kernels._genome import NeatRules
from realitygap.kernels._network import Networks
from realitygap.robots import TwinPlatform
from realitygap.tasks import TraceArrays
from realitygap.world import Arena

from ._batch import TrialBatch, Tried
from ._twin_pool import TwinPool

_pools: weakref.WeakValueDictionary[tuple[str, str, Arena], TwinPool] = weakref.WeakValueDictionary()
_last: list[TwinPool] = []  # the one used last is kept: the next chunk or trial wants it, too
_lock = threading.Lock()


class TwinTrials:
    """The platform `twin` in an arena, ready to try networks of one kind; a `PlatformTrials`.

    A trial is a function of its random numbers' key and of the network: whichever process carries it out, and however
    many there are. All that have the same twin in the same arena share the processes.

    Args:
        platform: The twin, by its file and the hash of that.
        arena: Where.
        rules: NEAT's, of which only the network's kind counts.
        inputs: Names of what the networks see, in order.
        bias_value: Of the constant input.

    Raises:
        ControllerError: The twin does not have such inputs.
        StudyError: The file is another than that of the hash.
        DescriptionError: There is no such file, or it cannot be used.
        MissingExtraError: MuJoCo is not installed.
    """

    distance_unit = 1.0
    drawn_names: tuple[str, ...] = ()

    def __init__(
        self,
        platform: TwinPlatform,
        arena: Arena,
        rules: NeatRules,
        *,
        inputs: Sequence[str],
        bias_value: float,
    ) -> None:
        self._pool = _shared_pool(platform, arena)
        self.arena = arena
        self.step_s = self._pool.step_s
        self.n_steps = platform.steps
        self._reach = platform.sensors.max_range
        self.sensors = tuple(f"range.{k}" for k in range(self._pool.n_sensors))
        self._rules, self._bias_value = rules, bias_value
        self._interface = ControllerInterface(tuple(inputs))
        self._interface.check(inputs_of_ranges(self._pool.n_sensors), "A network", f"twin {platform.file}")

    def carry_out(
        self,
        networks: Networks,
        which: NDArray[np.int32],
        key: int,
        counters: NDArray[np.uint32],
        *,
        ends: bool = False,
        trace: bool = False,
    ) -> Tried:
        """As `PlatformTrials.carry_out`; distances are what readings tell of them, as for a robot."""
        rows = {
            int(row): Network(networks, int(row), self._rules, self._bias_value).to_dict()
            for row in np.unique(which)
        }
        asked = [
            {
                "do": "evolve",
                "network": rows[int(row)],
                "inputs": self._interface.inputs,
                "steps": self.n_steps,
                "number": twin_number(int(key), counter),
                "trace": trace,
            }
            for row, counter in zip(which, counters, strict=True)
        ]
        answers = list(self._pool.ask_all(asked))
        n, n_cells = len(which), self.arena.grid.n_cells
        cells, n_line = _listed([each["cells"] for each in answers], n_cells)
        end_cells, n_ends = _listed([each["ends"] for each in answers], n_cells)
        stalls = np.array([each["stalls"] for each in answers], np.int32)
        ended = np.array([each["pose"][:2] for each in answers]).reshape(n, 2) - self.arena.start[:2]
        traced = self._trace(answers if trace else [])
        distances = self._reach * (1.0 - traced.readings)
        batch = TrialBatch(cells, n_line, n_ends, stalls, np.empty((n, 0)))
        return Tried(batch, end_cells if ends else end_cells[:0], ended, traced, distances)

    def _trace(self, answers: list[dict[str, Any]]) -> TraceArrays:
        """Every step, as kernels keep it: positions from the start, headings in turns."""

        def stacked(name: str, width: int) -> NDArray[np.float64]:
            found = [np.array(each[name], np.float64).reshape(-1, width) for each in answers]
            return np.stack(found, axis=-1) if found else np.zeros((0, width, 1))

        poses = stacked("poses", 3)
        start = self.arena.start
        poses[:, :2] -= np.array([start.x, start.y])[:, None]
        poses[:, 2] /= math.tau
        inputs = stacked("inputs", len(self._interface.sensed))
        if self._rules.bias_input >= 0:
            constant = np.full((len(inputs), 1, inputs.shape[2]), self._bias_value)
            inputs = np.insert(inputs, [self._rules.bias_input], constant, axis=1)
        stalled = stacked("stalled", 1)[:, 0].astype(np.bool_)
        readings, commands = stacked("readings", len(self.sensors)), stacked("commands", 2)
        return TraceArrays(poses, readings, inputs, commands, stalled, stacked("wheels", 2))


def _listed(cells: list[list[int]], n_cells: int) -> tuple[NDArray[np.uint8], NDArray[np.int32]]:
    """(n, c) lists of cells as kernels keep them, and how many each has."""
    listed = np.zeros((len(cells), n_cells), np.uint8)
    for row, each in zip(listed, cells, strict=True):
        row[: len(each)] = each
    return listed, np.array([len(each) for each in cells], np.int32)


def twin_number(key: int, counter: NDArray[np.uint32]) -> int:
    """The number of a trial on a twin, a function of what other platforms draw their random numbers by."""
    text = ":".join(map(str, (key, *counter.tolist())))
    return int.from_bytes(hashlib.blake2b(text.encode(), digest_size=4).digest(), "little")


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
