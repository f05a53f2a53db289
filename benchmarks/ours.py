"""realitygap: what `peers.py` times of it, in the environment that runs it.

NEAT with the settings `stanley-2002`. Runs, XOR and passes are loops in the core (`our_loops.py`), as a study has
them; population 10,000 is `Population.tell`, called from Python. Robot-steps are the trials that
`realitygap bench` measures.
"""

from __future__ import annotations

import time
from typing import Any

import work
from environments import Peer, PeerError, answer_as_worker, repeated, spread

PEER = Peer(
    name="ours",
    title="realitygap",
    requirements=(),
    packages=("realitygap", "numba", "llvmlite", "numpy"),
    figures=tuple(work.FIGURES),
)
RUNS = 2_000
TRIALS = 512
CALLS = 100
STEPS = 50_000
PASSES = 1_000_000
SECONDS = 1.0
ENGINE_REPEATS = 3
# More than any genome of these runs needs; too little is told, never passed over.
ROOM = 96
HIDDEN_ROOM = 32


def _room(population: int, rules: Any) -> Any:
    from realitygap.kernels.tasks.run import XOR, TaskRules, make_task_room

    return make_task_room(TaskRules(XOR, population, 1, 1.0), rules, ROOM, HIDDEN_ROOM)


def _settings(population: int) -> Any:
    from realitygap.evolution import NeatSettings

    return NeatSettings.named("stanley-2002", population=population)


def time_engine() -> dict[str, Any]:
    """Rates of one core and of all, and of one core when part of the work is changed: what takes the time."""
    from realitygap.study import measure_speed

    names = ("robot_steps_per_second", "paper_runs_per_second", "paper_runs_recorded_per_second")
    speeds = [measure_speed(SECONDS) for _ in range(ENGINE_REPEATS)]
    rates = {
        name: {cores: spread([speed[name][cores] for speed in speeds])["median"] for cores in speeds[0][name]}
        for name in names
    }
    variants = {
        "as it is": time_steps()["median"],
        "double precision": time_steps(precision="double")["median"],
        "2 hidden nodes": time_steps(start_hidden=2)["median"],
        "8 hidden nodes": time_steps(start_hidden=8)["median"],
    }
    return {**rates, "variants": variants, "draw_ns": time_draws()["median"]}


def time_draws() -> dict[str, Any]:
    """Nanoseconds that the random words of one robot-step take."""
    import numpy as np

    from our_loops import KEY, draws
    from realitygap.kernels.math.lanes import LANES

    counters = np.arange(3 * LANES, dtype=np.uint32).reshape(3, LANES)
    words = np.zeros((4, LANES), np.uint32)

    def work_once() -> float:
        since = time.perf_counter()
        draws(counters, KEY, words, STEPS)
        return (time.perf_counter() - since) / (STEPS * LANES) * 1e9

    return repeated(work_once)


def time_steps(threads: int = 1, precision: str = "single", start_hidden: int = 0) -> dict[str, Any]:
    """Robot-steps a second in trials of the paper with noise, on so many threads."""
    from concurrent.futures import ThreadPoolExecutor

    from realitygap.evolution import Population, random_key
    from realitygap.platforms import try_genomes
    from realitygap.study import load_study
    from realitygap.trials import NoiseKey

    condition = next(item for item in load_study("paper").conditions if item.name == "coverage-50")
    settings = condition.neat.model_copy(update={"population": TRIALS, "start_hidden": start_hidden})
    genomes = Population(3, 2, settings, seed=condition.seed, bias=False).ask()
    platform = condition.on.model_copy(update={"precision": precision})
    arena = condition.arena.arena()

    def one_thread(thread: int) -> None:
        key = NoiseKey(random_key(condition.seed), replicate=thread)
        for _ in range(CALLS):
            try_genomes(platform, arena, genomes, noise=condition.noise, noise_key=key)

    with ThreadPoolExecutor(threads) as pool:

        def work_once() -> float:
            since = time.perf_counter()
            list(pool.map(one_thread, range(threads)))
            return threads * CALLS * TRIALS * platform.steps / (time.perf_counter() - since)

        return repeated(work_once)


def _steps_on_all_cores() -> dict[str, Any]:
    from realitygap._process import usable_processors

    return time_steps(threads=usable_processors())


def time_realism(case: str) -> dict[str, Any]:
    """Robot-steps a second on one core with outline, contact, and noise of sensors and motors."""
    from realitygap.study import measure_realism

    return spread([measure_realism(SECONDS)[case] for _ in range(ENGINE_REPEATS)])


def time_runs() -> dict[str, Any]:
    """Microseconds a run, one thread."""
    from our_loops import KEY, trivial_runs

    rules = _settings(work.RUN_POPULATION).rules(work.N_INPUTS, work.N_OUTPUTS)
    room = _room(work.RUN_POPULATION, rules)
    firsts = iter(range(0, 10**9, RUNS))

    def work_once() -> float:
        first = next(firsts)
        since = time.perf_counter()
        enough = trivial_runs(room, rules, KEY, first, RUNS, work.RUN_GENERATIONS)
        taken = time.perf_counter() - since
        if not enough:
            raise PeerError(f"a genome outgrew {ROOM} genes")
        return taken / RUNS * 1e6

    return repeated(work_once)


def time_xor() -> dict[str, Any]:
    """Milliseconds a generation, one thread."""
    from our_loops import KEY, xor_run

    rules = _settings(work.XOR_POPULATION).rules(3, 1, bias_input=2)
    room = _room(work.XOR_POPULATION, rules)
    replicates = iter(range(1, 10**6))

    def work_once() -> float:
        replicate = next(replicates)
        since = time.perf_counter()
        enough = xor_run(room, rules, KEY, replicate, work.XOR_GENERATIONS)
        taken = time.perf_counter() - since
        if not enough:
            raise PeerError(f"a genome outgrew {ROOM} genes")
        return taken / work.XOR_GENERATIONS * 1e3

    return repeated(work_once)


def time_large() -> dict[str, Any]:
    """Milliseconds of one `tell`, one thread."""
    import numpy as np

    from realitygap.evolution import Population

    draw = np.random.default_rng(1)
    settings = _settings(work.LARGE_POPULATION)
    Population(work.N_INPUTS, work.N_OUTPUTS, _settings(2), bias=False).tell([1.0, 1.0])  # compiles
    population = Population(work.N_INPUTS, work.N_OUTPUTS, settings, seed=1, bias=False)
    taken = []
    for _ in range(work.LARGE_GENERATIONS):
        fitness = draw.random(work.LARGE_POPULATION)
        since = time.perf_counter()
        population.tell(fitness)
        taken.append((time.perf_counter() - since) * 1e3)
    return {**spread(taken), "species": len(set(population.species.tolist()))}


def _one_network(population: int) -> tuple[Any, Any]:
    """NEAT's rules, and room whose networks are those of a first generation."""
    from our_loops import KEY, begin_run
    from realitygap.kernels.neat.network import decode

    rules = _settings(population).rules(work.N_INPUTS, work.N_OUTPUTS)
    room = _room(population, rules)
    begin_run(room, rules, KEY, 0)
    decode(room.genomes, 0, rules, room.networks, 0)
    return rules, room


def time_passes() -> dict[str, Any]:
    """Microseconds of one activation in the core: of one network alone, and of one among many side by side."""
    import numpy as np

    from our_loops import passes, passes_side_by_side
    from realitygap.kernels.math.lanes import LANES
    from realitygap.kernels.neat.wiring import make_wiring, wire

    rules, room = _one_network(work.RUN_POPULATION)
    inputs = (0.1, 0.2, 1.0)
    room.values[: work.N_INPUTS] = inputs

    def alone() -> float:
        since = time.perf_counter()
        passes(room.networks, rules, room.values, room.before, PASSES)
        return (time.perf_counter() - since) / PASSES * 1e6

    like = np.zeros(1, np.float32)
    wiring = make_wiring(like, rules, HIDDEN_ROOM)
    wire(room.networks, np.zeros(LANES, np.int32), 0, LANES, rules, wiring)
    values = np.zeros((work.N_INPUTS + work.N_OUTPUTS + HIDDEN_ROOM, LANES), np.float32)
    values[: work.N_INPUTS] = np.reshape(inputs, (-1, 1))
    before, total = np.zeros_like(values), np.zeros(LANES, np.float32)

    def side_by_side() -> float:
        n = PASSES // LANES
        since = time.perf_counter()
        passes_side_by_side(wiring, rules, values, before, total, n)
        return (time.perf_counter() - since) / (n * LANES) * 1e6

    return {**repeated(alone), "side_by_side": repeated(side_by_side)["median"]}


if __name__ == "__main__":
    answer_as_worker(
        PEER,
        {
            "steps_core": time_steps,
            "steps_all": _steps_on_all_cores,
            "realism_avoiding": lambda: time_realism("avoiding"),
            "realism_pressed": lambda: time_realism("pressed"),
            "realism_boxes": lambda: time_realism("boxes"),
            "run_us": time_runs,
            "xor_ms": time_xor,
            "large_ms": time_large,
            "pass_us": time_passes,
            "engine": time_engine,
        },
    )
