"""Kheperax, a maze robot in JAX: what `peers.py` times of it.

Its own robot in its own standard maze, compiled and over batches, headless: a round body, three rays against nine
walls and two bumpers, no noise, a tanh network without hidden nodes; a trial is 250 steps, as in its example, and
gives a fitness and the place at the end. It marks no cells. The best of several batch sizes counts.
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


def _scoring() -> tuple[Callable[[Any, Any], Any], Callable[[int], Any], Any]:
    """The compiled trial of a batch of controllers, what makes a batch, and a key of random numbers."""
    import jax

    jax.config.update("jax_platforms", "cpu")
    # Kheperax 0.2.0 calls it by the name that JAX has given up since.
    jax.tree_leaves = jax.tree_util.tree_leaves
    from kheperax.tasks.config import KheperaxConfig
    from kheperax.tasks.main import KheperaxTask

    config = KheperaxConfig.get_default()
    config.episode_length = STEPS
    config.mlp_policy_hidden_layer_sizes = ()
    key = jax.random.PRNGKey(1)
    world, policy, score = KheperaxTask.create_default_task(config, random_key=key)

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
    """The same with the process held to one core, before JAX counts them."""
    if not hasattr(os, "sched_setaffinity"):
        raise PeerError("only Linux can hold JAX to one core")
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    return time_steps()


if __name__ == "__main__":
    answer_as_worker(PEER, {"steps_core": time_steps_on_one_core, "steps_all": time_steps})
