"""All sensors of a robot at once: every reading from its own words, other numbers in each lane."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from realitygap.kernels.jyro.trial import largest_noisy_readings
from realitygap.kernels.math.elementary import normal
from realitygap.kernels.math.lanes import LANES
from realitygap.kernels.sim import senses
from realitygap.kernels.sim.lanes import SimRules, make_sim_room
from realitygap.kernels.sim.shape import INPUT_KINDS, SENSOR_NUMBERS, make_sim_shape, sim_rows, sim_table
from realitygap.kernels.sim.trial import observe
from tests.kernels.genome_arrays import rules_of, settings
from tests.kernels.sim_rows import poses
from tests.reference import senses as reference
from tests.reference.effort import cases
from tests.reference.neat import Neat
from tests.reference.philox import Stream

KEY = 41
RESPONSES = ("linear", "ir", "table", "pulses", "lorentz", "lorentz_edges")
FIRST_RAYS = {
    "linear": (0, 1),
    "ir": (1, 3),
    "table": (4, 1),
    "pulses": (5, 3),
    "lorentz": (8, 3),
    "lorentz_edges": (11, 3),
}
N_RAYS = 14
TABLE = 3
TAPE = (0.2, -1.0, 0.2, 1.0, 0.1, 0.1)
SHAPE = make_sim_shape(
    parts=[1],
    range_response=RESPONSES,
    range_rays=[rays for _, rays in FIRST_RAYS.values()],
    range_table=[0, 0, TABLE, 0, 0, 0],
    range_pulses=[0, 0, 0, 10, 0, 0],
    sensors={"light": 2, "line": 2},
    line_levels=[False, True],
    n_lamps=2,
    tapes=[TAPE],
    floor=np.array([[0.9, 0.6], [0.7, 0.8]], np.float32),
    floor_grid=(-0.5, -0.5, 2.0),
)
Numbers = dict[str, np.ndarray]


def numbers_of(rng: np.random.Generator) -> Numbers:
    """Other numbers in each lane, all sources of noise on."""
    limits: dict[str, tuple[float, float]] = {
        "reach": (0.4, 0.8), "amplitude": (0.5, 2.0), "decay": (0.05, 0.3), "noise_uniform": (0.0, 0.1),
        "noise_gain": (0.0, 0.2), "drop_most": (0.0, 0.6), "drop_at": (0.1, 0.4), "drop_width": (0.02, 0.1),
        "outlier_most": (0.0, 0.4), "outlier_at": (0.1, 0.4), "outlier_width": (0.02, 0.1), "burst": (0.0, 1.0),
        "incidence": (0.0, 0.0), "cone": (0.1, 0.6), "half_width": (0.06, 0.3), "peak": (-0.05, 0.05),
        "compression": (0.0, 0.0),
    }  # fmt: skip
    numbers = {
        f"range.{s}.{name}": rng.uniform(*span, LANES)
        for s in range(len(RESPONSES))
        for name, span in limits.items()
    }
    for j in range(TABLE):
        numbers[f"range.2.table.{j}.distance"] = rng.uniform(0.2 * j, 0.2 * j + 0.15, LANES)
        numbers[f"range.2.table.{j}.reading"] = rng.uniform(0, 1, LANES)
    for k in range(2):
        numbers |= {f"light.{k}.{axis}": rng.uniform(-0.1, 0.1, LANES) for axis in "xy"}
        numbers[f"light.{k}.direction"] = rng.uniform(-3, 3, LANES)
        numbers[f"light.{k}.width"] = rng.uniform(0.5, 3, LANES)
        numbers[f"light.{k}.gain"] = rng.uniform(0.1, 1, LANES)
        numbers[f"light.{k}.noise"] = rng.uniform(0, 0.2, LANES)
        numbers |= {f"arena.light.{k}.{axis}": rng.uniform(-1, 1, LANES) for axis in "xy"}
        numbers[f"arena.light.{k}.strength"] = rng.uniform(0, 1, LANES)
        numbers |= {f"line.{k}.{axis}": rng.uniform(-0.1, 0.1, LANES) for axis in "xy"}
        numbers[f"line.{k}.threshold"] = rng.uniform(0.3, 0.9, LANES)
        numbers[f"line.{k}.noise"] = rng.uniform(0, 0.2, LANES)
    return numbers


class Block:
    """A block of robots that stand where they are told to."""

    def __init__(
        self, numbers: Mapping[str, Any], *, clip: bool = True, shape: Any = SHAPE, real: Any = np.float64
    ):
        self.shape, self.numbers = shape, numbers
        self.rules = SimRules(10, 0.1, clip, 1.0, np.zeros(4, real))
        room = make_sim_room(shape, rules_of(Neat(settings(), shape.inputs.shape[0], 2)), 0, real)
        self.lanes = room.lanes
        table = sim_table(shape, numbers, real)
        self.lanes.p[: len(table)] = table
        self.lanes.counters[0] = np.arange(LANES) * 256 + 1
        self.lanes.counters[2] = 3
        senses.start_senses(shape, self.rules, self.lanes)

    def readings(self, pose: Any, distances: np.ndarray, step: int, cosines: Any = 1.0) -> np.ndarray:
        self.lanes.rates[:] = cosines
        for ours, given in zip(self.lanes.pose, poses(*pose, self.lanes.low.dtype.type), strict=True):
            ours[:] = given
        self.lanes.distances[:] = distances
        senses.answer(self.shape, self.rules, np.uint64(KEY), self.lanes, np.int64(step))
        return self.lanes.readings.copy()


class Plain:
    """The same robot in one lane, by the reference, with words from the streams of each purpose."""

    def __init__(self, numbers: Numbers, lane: int, step: int) -> None:
        self.numbers, self.lane, self.step = numbers, lane, step

    def number(self, name: str) -> float:
        return float(self.numbers[name][self.lane])

    def word(self, purpose: int, block: int, n: int) -> int:
        return Stream(KEY, replicate=3, generation=0, individual=self.lane, purpose=purpose).words(
            block + n // 4
        )[n % 4]

    def normal(self, purpose: int, block: int, n: int) -> float:
        return float(normal(np.uint32(self.word(purpose, block, n)), 0.0))

    def mixture_words(self, s: int) -> tuple[int, int]:
        """Three sensors share four words: 21 bits to choose by, and 21 more."""
        blocks, place = -(-len(RESPONSES) // 3), s % 3
        first, spare = (self.word(7, self.step * blocks + s // 3, n) for n in (place, 3))
        left, more = first & 0x7FF, spare >> 10 * place & 0x3FF
        return first, left << 21 | more << 11 | left

    def range(self, s: int, rays: Any, cosines: Any) -> float:
        kind = RESPONSES[s]
        k, reach, decay = (self.number(f"range.{s}.{name}") for name in ("incidence", "reach", "decay"))
        far = min(rays)
        if kind in ("ir", "pulses"):
            far = reference.dim_distance(rays, cosines, reach, decay, k)
        of = {name: self.number(f"range.{s}.{name}") for name in (
            "reach", "amplitude", "decay", "noise_gain", "burst", "noise_uniform"
        )}  # fmt: skip
        nothing, anything = (
            reference.logistic(
                far, *(self.number(f"range.{s}.{kind}_{name}") for name in ("most", "at", "width"))
            )
            for kind in ("drop", "outlier")
        )
        if kind == "linear":
            reading = reference.linear(rays, of["reach"])
        elif kind == "table":
            entries = [
                (self.number(f"range.2.table.{j}.distance"), self.number(f"range.2.table.{j}.reading"))
                for j in range(TABLE)
            ]
            reading = reference.table(min(rays), entries)
        elif kind in ("lorentz", "lorentz_edges"):
            of_lorentz = [self.number(f"range.{s}.{name}") for name in ("half_width", "peak")]
            cone = self.number(f"range.{s}.cone")
            reading = reference.enki(rays, cone, reach, of["amplitude"], *of_lorentz)
            if kind == "lorentz_edges":
                reading += reference.of_lost_rays(rays, reach, of["amplitude"], *of_lorentz)
        else:
            factors = reference.at_a_slant(cosines, k)
            reading = of["amplitude"] * reference.returned(rays, reach, decay, factors)
        if kind == "pulses":
            block = (self.step * len(RESPONSES) + s) * 2
            shared = (self.word(8, block, 0) >> 9) / 2**23 < of["burst"]
            fates = [
                ((self.word(8, block, 1 + k // 2) >> 16 * (k % 2) & 0xFFFF) + 0.5) / 2**16 for k in range(10)
            ]
            reading = reference.pulses(reading, 10, nothing, shared, fates)
        else:
            choice, value = self.mixture_words(s)
            reading *= 1 + of["noise_gain"] * float(normal(np.uint32(value), 0.0))
            if kind == "ir":
                reading = reference.compressed(reading, self.number(f"range.{s}.compression"))
            choices = ((choice >> 11) + 0.5) / 2**21, ((value >> 9) + 0.5) / 2**23
            reading = reference.mixed(reading, *choices, nothing, anything)
        uniform = ((self.word(1, self.step * -(-len(RESPONSES) // 4), s) >> 8) * 2 + 1 - 2**24) / 2**24
        return reference.limited(reading + of["noise_uniform"] * uniform)

    def light(self, k: int, pose: tuple[float, float, float]) -> float:
        mount = self.number(f"light.{k}.x"), self.number(f"light.{k}.y")
        lamps = [
            reference.Lamp(*(self.number(f"arena.light.{j}.{name}") for name in ("x", "y", "strength")))
            for j in range(2)
        ]
        direction, width = self.number(f"light.{k}.direction"), self.number(f"light.{k}.width")
        received = reference.light(pose, mount, direction, width, lamps)
        noise = 1 + self.number(f"light.{k}.noise") * self.normal(9, self.step, k)
        return reference.limited(self.number(f"light.{k}.gain") * received * noise)

    def line(self, k: int, pose: tuple[float, float, float]) -> float:
        ahead, left = self.number(f"line.{k}.x"), self.number(f"line.{k}.y")
        x = pose[0] + ahead * math.cos(pose[2]) - left * math.sin(pose[2])
        y = pose[1] + ahead * math.sin(pose[2]) + left * math.cos(pose[2])
        bright = TAPE[5]
        if not reference.on_tape(TAPE, x, y):
            bright = reference.image_at(SHAPE.floor.tolist(), (-0.5, -0.5), 2.0, x, y)
        bright += self.number(f"line.{k}.noise") * self.normal(10, self.step, k)
        return reference.limited(1 - bright) if k == 1 else float(bright < self.number(f"line.{k}.threshold"))


@pytest.mark.parametrize(("most_incidence", "most_compression"), [(0.0, 0.0), (3.0, 0.0), (3.0, 20.0)])
def test_every_sensor_answers_what_its_own_words_say(most_incidence: float, most_compression: float) -> None:
    rng = np.random.default_rng(1)
    numbers = numbers_of(rng)
    for s in range(len(RESPONSES)):
        numbers[f"range.{s}.incidence"] = most_incidence * np.arange(LANES) / LANES
        numbers[f"range.{s}.compression"] = most_compression * np.arange(LANES) / LANES
    block = Block(numbers)
    for step in [0, 1, 7, *range(100, 100 + cases(8, 1))]:
        x, y, heading = rng.uniform(-0.5, 0.5, (3, LANES)) * [[1], [1], [6]]
        distances = np.empty((N_RAYS, LANES))
        for s, (first, n) in enumerate(FIRST_RAYS.values()):
            reach = numbers[f"range.{s}.reach"]
            distances[first : first + n] = np.minimum(rng.uniform(0, 1.2, (n, LANES)) * reach, reach)
        cosines = rng.uniform(0.01, 1.0, (N_RAYS, LANES))
        answer = block.readings((x, y, heading), distances, step, cosines)
        for lane in range(0, LANES, 5):
            plain, pose = Plain(numbers, lane, step), (float(x[lane]), float(y[lane]), float(heading[lane]))
            rays, slants = distances[:, lane].tolist(), cosines[:, lane].tolist()
            parts = [slice(first, first + n) for first, n in FIRST_RAYS.values()]
            wanted = [
                *(plain.range(s, rays[part], slants[part]) for s, part in enumerate(parts)),
                *(plain.light(k, pose) for k in range(2)),
                *(plain.line(k, pose) for k in range(2)),
            ]
            assert answer[:, lane] == pytest.approx(wanted, abs=1e-9)
        assert ((answer >= 0) & (answer <= 1)).all()


def test_compression_keeps_small_readings_and_presses_large_ones() -> None:
    """Without noise, too; a lane with a compression of 0 reads as before to the bit."""
    shape = make_sim_shape(parts=[1], range_response=["ir"])
    numbers = {"range.0.reach": 1.0, "range.0.amplitude": 50.0, "range.0.decay": 0.01}
    distances = np.linspace(0.0, 0.2, LANES)[None]
    plain = Block(numbers, shape=shape).readings((0.0, 0.0, 0.0), distances, 0)[0]
    some = {**numbers, "range.0.compression": np.where(np.arange(LANES) % 2, 3.0, 0.0)}
    pressed = Block(some, shape=shape).readings((0.0, 0.0, 0.0), distances, 0)[0]
    assert (pressed[::2] == plain[::2]).all()
    light = 50 * np.exp(-distances[0, 1::2] / 0.01)
    assert pressed[1::2] == pytest.approx(np.minimum(np.log1p(3 * light) / 3, 1), abs=1e-12)


def test_a_trial_reads_the_same_in_any_lane() -> None:
    rng = np.random.default_rng(2)
    numbers = numbers_of(rng)
    order = rng.permutation(LANES)
    pose, distances = rng.uniform(-0.5, 0.5, (3, LANES)), rng.uniform(0, 0.6, (N_RAYS, LANES))
    answer = Block(numbers).readings(tuple(pose), distances, 5)
    moved = Block({name: values[order] for name, values in numbers.items()})
    moved.lanes.counters[:] = moved.lanes.counters[:, order]
    assert (moved.readings(tuple(pose[:, order]), distances[:, order], 5) == answer[:, order]).all()


def test_noise_of_one_kind_stays_where_noise_of_another_is_switched_off() -> None:
    """Gain, mixture and the paper's noise draw words of their own, and a level of 0 draws nothing away."""
    rng = np.random.default_rng(3)
    numbers = numbers_of(rng)
    distances = rng.uniform(0, 0.3, (N_RAYS, LANES))

    def read(**zero: float) -> np.ndarray:
        given = {
            name: np.zeros(LANES) if any(name.endswith(end) for end in zero) else value
            for name, value in numbers.items()
        }
        return Block(given, clip=False).readings((0.0, 0.0, 0.0), distances, 4)[0]

    everything = read()
    without = read(noise_uniform=0)
    only = read(noise_gain=0, drop_most=0, outlier_most=0)
    nothing = read(noise_gain=0, drop_most=0, outlier_most=0, noise_uniform=0)
    assert everything - without == pytest.approx(only - nothing, abs=1e-12)
    assert nothing == pytest.approx(1 - distances[0] / numbers["range.0.reach"])


def test_the_papers_noise_is_jyros_to_the_bit() -> None:
    """The largest of three noisy readings is what the kernel of `jyro` makes of the same distances and words."""
    for real in (np.float64, np.float32):
        shape = make_sim_shape(parts=[1], range_response=["linear"] * 3)
        numbers = {
            f"range.{s}.{name}": 0.2 if name == "reach" else 0.5
            for s in range(3)
            for name in ("reach", "noise_uniform")
        }
        block = Block(numbers, clip=False, shape=shape, real=real)
        distances = np.random.default_rng(4).uniform(0, 0.2, (3, LANES)).astype(real)
        for step in range(3):
            readings = block.readings((0.0, 0.0, 0.0), distances, step)
            value, words = np.empty(LANES, real), np.empty((4, LANES), np.uint32)
            largest_noisy_readings(
                distances / real(0.2), np.full(LANES, 0.5, real), False, np.int64(step), block.lanes.counters,
                np.uint64(KEY), words, value,
            )  # fmt: skip
            assert readings.max(axis=0) == pytest.approx(value, abs=float(3 * np.finfo(real).eps))


def test_every_number_has_a_row_of_its_own() -> None:
    rows = sim_rows(SHAPE)
    assert sorted(rows.values()) == list(range(SHAPE.n_rows))
    assert rows["range.3.burst"] == rows["range.3.x"] + senses.BURST


def test_each_kind_of_sensor_has_a_reading_and_each_kind_of_input_a_value() -> None:
    """Two of each kind: a stage that `answer` or `observe` does not call leaves what was there before."""
    shape = make_sim_shape(
        parts=[1],
        range_response=["linear", "linear"],
        sensors=dict.fromkeys(SENSOR_NUMBERS, 2),
        n_lamps=1,
        goal=True,
        n_walls=1,
        inputs=[(kind, k) for kind in (*SENSOR_NUMBERS, *INPUT_KINDS) for k in range(2)],
    )
    block = Block({"range.0.reach": 1.0, "range.1.reach": 0.5, "arena.goal.x": 1.0}, shape=shape)
    block.lanes.readings[:] = np.nan
    block.lanes.values[:] = np.nan
    readings = block.readings((0.1, 0.2, 0.3), np.full((2, LANES), 0.2), 1)
    assert np.isfinite(readings).all()
    observe(shape, block.rules, block.lanes, np.int64(1))
    values = block.lanes.values[: len(shape.inputs)]
    assert np.isfinite(values).all()
    assert (values[: shape.n_readings] == readings).all()
    assert shape.n_readings == 2 * len(SENSOR_NUMBERS)
