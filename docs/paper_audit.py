"""The paper's own numbers, checked against each other."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import numpy.typing as npt

from realitygap.report._audit import compare_samples, doubt
from realitygap.report._tally import Tally, settings_of
from realitygap.stats import SEED, smallest_p

INCH_M = 0.0254

# Section 2.1
WORLD_IN = (24, 42)
WORLD_M_PRINTED = ("0.609", "1.07")
CELLS = 6 * 12
RANGE_M = Fraction(2, 10)
RANGE_IN_PRINTED = 9
N_SENSORS = 3

# Section 2.2
CALIBRATION_MOVES = 5
ROBOT_PATH_IN = Fraction("13.75")
SIM_PATH_IN = Fraction("19.7")
ROBOT_STEPS = 100
SIM_STEPS_PRINTED = 87

# Jyro's move at full output: 1 m/s for 0.1 s
SIM_MOVE_M = Fraction(1, 10)

# Section 2.3
NOISE_LEVELS = (Fraction(1, 10), Fraction(5, 10), Fraction(8, 10))

# Section 3.2, as printed
TABLE_2 = {
    "Physical robot": (".431", ".583", ".333"),
    "10% Noise (Sim)": (".154", ".222", ".166"),
    "50% Noise (Sim)": (".208", ".432", ".389"),
    "80% Noise (Sim)": (".180", ".333", ".333"),
}

_DRAWS = 20_000


@dataclass(frozen=True)
class Inconsistency:
    """Something printed in the paper that does not follow from the rest of it.

    Attributes:
        section: Place in the paper.
        printed: Statement of the paper.
        found: Computed result.
        bearing: Reason why it matters.
    """

    section: str
    printed: str
    found: str
    bearing: str


def audit_paper() -> list[Inconsistency]:
    """Return the inconsistencies in Rosenzweig & Remy, computed from the values that they print."""
    return [
        *_path_length(),
        _sensor_range(),
        _world(),
        _noise_offset(),
        *_table_2(),
        _three_runs(),
        *_words(),
    ]


def steps_for(robot_path_in: Fraction, sim_path_in: Fraction) -> Fraction:
    """Simulated steps whose path is as long as that of 100 steps of the robot."""
    return ROBOT_STEPS * robot_path_in / sim_path_in


def largest_of_uniform(n: int) -> Fraction:
    """Expectation of the largest of n independent numbers from U(-1, 1).

    The largest is below x with probability ((1 + x) / 2)^n, whose mean is (n - 1) / (n + 1).
    """
    return Fraction(n - 1, n + 1)


def inches(meters: Fraction | float) -> float:
    """Meters in inches."""
    return float(meters) / INCH_M


def _path_length() -> list[Inconsistency]:
    moves = CALIBRATION_MOVES
    steps = float(steps_for(ROBOT_PATH_IN, SIM_PATH_IN))
    one_less = inches((moves - 1) * SIM_MOVE_M)
    off_by_one = float(ROBOT_STEPS * ROBOT_PATH_IN) / one_less
    lengths = f"{float(ROBOT_PATH_IN):.2f} in (robot) and {float(SIM_PATH_IN):.1f} in (simulation)"
    return [
        Inconsistency(
            "2.2",
            f"From {lengths}, “{SIM_STEPS_PRINTED} steps with the simulation are equivalent to {ROBOT_STEPS} "
            "steps” of the robot.",
            f"{ROBOT_STEPS} × {float(ROBOT_PATH_IN)} / {float(SIM_PATH_IN)} = {steps:.1f}: {round(steps)} steps. "
            f"{SIM_STEPS_PRINTED} follows if the simulated path was {moves - 1} moves long: "
            f"{ROBOT_STEPS} × {float(ROBOT_PATH_IN)} / {one_less:.2f} = {off_by_one:.1f}.",
            f"Simulated paths were probably a quarter longer than the robot’s "
            f"({SIM_STEPS_PRINTED / steps - 1:+.0%}), in favor of the simulation.",
        ),
        Inconsistency(
            "2.2",
            f"The simulated robot drives {float(SIM_PATH_IN)} in in {moves} steps.",
            f"{moves} × {float(SIM_MOVE_M)} m = {float(moves * SIM_MOVE_M)} m = "
            f"{inches(moves * SIM_MOVE_M):.2f} in: exactly {moves} of Jyro’s moves at full speed.",
            "The length printed is right; the number of steps made of it is not.",
        ),
    ]


def _sensor_range() -> Inconsistency:
    found = inches(RANGE_M)
    return Inconsistency(
        "2.1",
        f"Sensors reach “just under {RANGE_IN_PRINTED} inches (.{RANGE_M * 10} meters)”.",
        f"{float(RANGE_M)} m = {found:.2f} in.",
        f"{RANGE_IN_PRINTED} in would be {RANGE_IN_PRINTED * INCH_M:.3f} m, "
        f"{RANGE_IN_PRINTED / found - 1:.0%} more than the simulation has.",
    )


def _world() -> Inconsistency:
    found = [side * INCH_M for side in WORLD_IN]
    return Inconsistency(
        "2.1",
        f"The world is {WORLD_IN[0]} × {WORLD_IN[1]} in, ({' × '.join(WORLD_M_PRINTED)} m).",
        f"{found[0]:.4f} × {found[1]:.4f} m: {WORLD_M_PRINTED[0]} is cut and not rounded, as in Table 2.",
        "None for the results; it shows how numbers were printed.",
    )


def _noise_offset() -> Inconsistency:
    largest = largest_of_uniform(N_SENSORS)
    offsets = ", ".join(f"{float(level * largest):+.2f}" for level in NOISE_LEVELS)
    levels = ", ".join(f"{float(level):.0%}" for level in NOISE_LEVELS)
    return Inconsistency(
        "2.3",
        f"a · U(−1, 1) is added to each of {N_SENSORS} sensors, then the largest is taken.",
        f"The largest of {N_SENSORS} numbers from U(−1, 1) is {largest} on average, so that with equal readings "
        f"the input moves by a · {largest}: {offsets} at {levels} noise.",
        "Levels of noise differ in their mean, too: an effect of noise may be one of the offset.",
    )


def _table_2() -> list[Inconsistency]:
    found: dict[str, list[str]] = {"impossible": [], "cut": [], "raised": []}
    for texts in TABLE_2.values():
        for text in texts:
            doubtful = doubt(text, CELLS)
            if doubtful is not None:
                problem, k = doubtful
                found[problem].append(f"{text} ({k}/{CELLS} = {k / CELLS:.4f})".replace("= 0", "= "))
    return [
        Inconsistency(
            "3.2, Table 2",
            f"Coverages, each a share of {CELLS} cells.",
            f"No share of {CELLS}: {', '.join(found['impossible'])}. Cut, not rounded: {', '.join(found['cut'])}.",
            "Probably slips of the hand. One order of runs depends on them: .432 stands above the robot’s .431, "
            "and both are probably 31/72.",
        )
    ]


def table_2() -> dict[str, npt.NDArray[np.float64]]:
    """The values of Table 2 by row."""
    return {name: np.array([float(text) for text in texts]) for name, texts in TABLE_2.items()}


def _three_runs() -> Inconsistency:
    pairs = compare_samples(table_2())
    least = min(pairs, key=lambda pair: pair.p)
    n = len(next(iter(TABLE_2.values())))
    return Inconsistency(
        "3.1, 3.2, 4",
        f"{n} runs of each method; “it seems like 50% noise may perform better”, the robot “performed better”.",
        f"{n} runs against {n} cannot give a two-sided p below {smallest_p(n, n):.2f}. The smallest of the "
        f"{len(pairs)} pairs of Table 2 is {least.p:.2f} ({least.one} against {least.other}), corrected "
        f"{least.p_holm:.2f}; {least.runs_for_a_claim} runs each would be the least for a claim.",
        "No difference of the paper could have been significant, whatever the runs had been. The paper says "
        "itself that its runs are too few.",
    )


def _words() -> list[Inconsistency]:
    return [
        Inconsistency(
            "2.1, Table 1",
            "Input nodes: 3. With novelty a bias input is added: 4.",
            "Objective and novelty search have different networks.",
            "What is credited to novelty may be the work of the constant input.",
        ),
        Inconsistency(
            "2.1, 3.2",
            "The text refers to “Table 2.1” and “Table 3.2”; there are a Table 1 and a Table 2.",
            "They are the tables of sections 2.1 and 3.2. So Table 2 is that of section 3.2, novelty search, and "
            "section 3.1 points to Figure 4 alone. Its caption names no search.",
            "Table 2 should be read as novelty search; this cannot be settled from the text.",
        ),
        Inconsistency(
            "3.1",
            "50 % noise “is the level of noise used in Leyden et al.’s successful bridging of the reality gap [4]”.",
            "[4] is Jakobi, Husbands & Harvey (1995). Leyden et al. are introduced in section 1 as those whose "
            "control did not transfer.",
            "The support for 50 % comes from another paper than the one named.",
        ),
        Inconsistency(
            "1, 4",
            "The gap is the difference between evolving in simulation and evolving on the robot.",
            "Jakobi et al. move one controller from one to the other. Two evolutions, each the best of 40 noisy "
            "trials, differ in luck and in what they find as well.",
            "Two gaps under one name: the transfer of a controller, and evolution done twice.",
        ),
    ]


def spread_of_three(tally: Tally) -> list[tuple[str, str, str]]:
    """Return how often three runs of a condition spread as far as the robot's, and how often two threes differ as much.

    Args:
        tally: A study with the conditions of the paper.

    Returns:
        The name of each condition with novelty search, and both shares of 20,000 draws.
    """
    robot, *simulated = (float(values.std(ddof=1)) for values in table_2().values())
    ratio = robot / min(simulated)
    rng = np.random.default_rng(SEED)
    rows = []
    for condition in tally.conditions:
        values = tally.run_bests(condition["name"], tally.measure)
        if settings_of(condition).get("selection") != "novelty" or len(values) < 3:
            continue
        first, second = rng.choice(values, (2, _DRAWS, 3)).std(axis=2, ddof=1)
        shares = ((first >= robot - 1e-9).mean(), (first >= ratio * second - 1e-9).mean())
        rows.append((condition["name"], *(f"{share:.0%}" for share in shares)))
    return rows
