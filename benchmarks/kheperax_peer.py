"""Kheperax, a maze robot in JAX: what `peers.py` times of it.

Its own robot in its own standard maze, compiled and over batches, headless: a round body, three rays against nine
walls and two bumpers, no noise, a tanh network without hidden nodes; a trial is 250 steps, as in its example, and
gives a fitness and the place at the end. It marks no cells. The best of several batch sizes counts.

`map_elites.py` times the MAP-Elites of its example as well, by QDax, and takes its archive: batches of 2,048 networks
of 8 hidden nodes, 50 x 50 cells for the place at the end, and isotropic mutation.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import Any

from environments import Peer, PeerError, answer_as_worker, repeated

PEER = Peer(
    name="kheperax",
    title="Kheperax",
    requirements=("kheperax==0.2.0", "jax==0.10.2", "qdax==0.5.0"),
    packages=("kheperax", "jax", "jaxlib", "qdax", "numpy"),
    figures=("steps_core", "steps_all"),
)
BATCHES = (64, 256, 1024, 4096)
STEPS = 250
REPEATS = 3
ELITES_BATCH, ELITES_BATCHES, CELLS = 2048, 5, (50, 50)
EVALUATIONS, QD_OFFSET = 1_000_000, 0.5


def _one_core() -> None:
    """Hold the process to one core, before JAX counts them."""
    if not hasattr(os, "sched_setaffinity"):
        raise PeerError("only Linux can hold JAX to one core")
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def _task(hidden: tuple[int, ...], **robot: Any) -> tuple[Any, Any, Any, Any]:
    """Its standard maze: world, networks and scores, and a key of random numbers."""
    import jax

    jax.config.update("jax_platforms", "cpu")
    # Kheperax 0.2.0 calls it by the name that JAX has given up since.
    jax.tree_leaves = jax.tree_util.tree_leaves
    from kheperax.tasks.config import KheperaxConfig
    from kheperax.tasks.main import KheperaxTask

    config = KheperaxConfig.get_default()
    config.episode_length = STEPS
    config.mlp_policy_hidden_layer_sizes = hidden
    config.robot = config.robot.replace(**robot)
    key = jax.random.PRNGKey(1)
    return *KheperaxTask.create_default_task(config, random_key=key), key


def _scoring() -> tuple[Callable[[Any, Any], Any], Callable[[int], Any], Any]:
    """The compiled trial of a batch of controllers, what makes a batch, and a key of random numbers."""
    import jax

    world, policy, score, key = _task(())

    def controllers(n: int) -> Any:
        nothing = jax.numpy.zeros((n, world.observation_size))
        return jax.vmap(policy.init)(jax.random.split(key, n), nothing)

    # Without the whole transitions, which nobody reads here, the compiler need not keep them.
    return jax.jit(lambda batch, key: score(batch, key)[:2]), controllers, key


def time_steps() -> dict[str, Any]:
    """Robot-steps per second with the best batch size."""
    import jax

    score, controllers, key = _scoring()

    def rate_of(batch: Any, n: int) -> float:
        since = time.perf_counter()
        jax.block_until_ready(score(batch, key))
        return n * STEPS / (time.perf_counter() - since)

    found = []
    for n in BATCHES:
        batch = jax.block_until_ready(controllers(n))
        found.append({**repeated(lambda batch=batch, n=n: rate_of(batch, n), REPEATS), "batch": n})
    return max(found, key=lambda each: each["median"])


def time_steps_on_one_core() -> dict[str, Any]:
    """The same with the process held to one core."""
    _one_core()
    return time_steps()


class Example:
    """MAP-Elites as in its example, on one core."""

    def __init__(self, seed: int) -> None:
        """Make and try the first batch, without the whole transitions, which the compiler need not keep then."""
        _one_core()
        import functools

        import jax

        world, policy, score, _ = _task((8,), lasers_return_minus_one_if_out_of_range=True)
        from qdax.core.containers.mapelites_repertoire import compute_euclidean_centroids
        from qdax.core.emitters.mutation_operators import isoline_variation
        from qdax.core.emitters.standard_emitters import MixingEmitter
        from qdax.core.map_elites import MAPElites
        from qdax.utils.metrics import default_qd_metrics

        emitter = MixingEmitter(
            mutation_fn=lambda x, y: (x, y),
            variation_fn=functools.partial(isoline_variation, iso_sigma=0.2, line_sigma=0.0),
            variation_percentage=1.0,
            batch_size=ELITES_BATCH,
        )
        metrics = functools.partial(default_qd_metrics, qd_offset=QD_OFFSET)
        # QDax 0.5.0 expects three results
        loop = MAPElites(lambda batch, key: (*score(batch, key)[:2], {}), emitter, metrics)
        low, high = world.behavior_descriptor_limits
        key, one, two = jax.random.split(jax.random.PRNGKey(seed), 3)
        nothing = jax.numpy.zeros((ELITES_BATCH, world.observation_size))
        first = jax.vmap(policy.init)(jax.random.split(one, ELITES_BATCH), nothing)
        centroids = compute_euclidean_centroids(CELLS, low, high)
        self._update, self._key = jax.jit(loop.update), key
        self._repertoire, self._state, self._metrics = loop.init(first, centroids, two)

    def go_on(self, batches: int) -> dict[str, Any]:
        """Try so many more batches, and return the metrics of the archive."""
        import jax

        for _ in range(batches):
            self._key, one = jax.random.split(self._key)
            self._repertoire, self._state, self._metrics = self._update(self._repertoire, self._state, one)
        return {name: float(value) for name, value in jax.block_until_ready(self._metrics).items()}


def time_elites() -> dict[str, Any]:
    """Evaluations a second, without the first call, which compiles."""
    example = Example(1)

    def work_once() -> float:
        since = time.perf_counter()
        example.go_on(ELITES_BATCHES)
        return ELITES_BATCHES * ELITES_BATCH / (time.perf_counter() - since)

    return {**repeated(work_once, REPEATS), "batch": ELITES_BATCH}


def fill_archive() -> dict[str, Any]:
    """The archive after as many evaluations as in the example: share of filled cells, QD score, best fitness."""
    found = Example(1).go_on(EVALUATIONS // ELITES_BATCH - 1)
    return {
        "evaluations": EVALUATIONS // ELITES_BATCH * ELITES_BATCH,
        "filled": found["coverage"] / 100,
        "qd_score": found["qd_score"],
        "best": found["max_fitness"],
    }


if __name__ == "__main__":
    answer_as_worker(
        PEER,
        {
            "steps_core": time_steps_on_one_core,
            "steps_all": time_steps,
            "elites": time_elites,
            "archive": fill_archive,
        },
    )
