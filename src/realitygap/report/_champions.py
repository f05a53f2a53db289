"""The best network of each run, tried again on fresh noise: how much of its score was luck."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import polars as pl

from realitygap.errors import RecordError, RecordVersionError
from realitygap.platforms import retry_genomes
from realitygap.report._tally import DescribedCondition, Results, Tally, label_of, read_tally
from realitygap.runs import Condition, genome_of, partners_of
from realitygap.stats import Estimate, bca_interval, bca_mean, difference_of_means
from realitygap.trials import NoiseKey

FRESH_TRIALS = 20
"""Number of fresh trials of each champion: repeats 1 to 20 of its trial, of which the study ran number 0."""

MOST_RUNS = 100
"""Runs of a condition whose champions are tried again, and whose behaviors are compared: the first ones."""


@dataclass(frozen=True)
class Champions:
    """The best networks of the runs of a condition, as recorded and on fresh noise.

    Attributes:
        condition: Name of the condition.
        label: SIM, TWIN, EMULATED or REAL.
        reported: (n,) coverage of each champion in its run, the best of all its trials [0..1].
        fresh: (n, 20) coverage of the same networks on fresh noise.
        replicates: (n,) replicate of each run.
        problem: Reason why there are none; empty if there are some.
    """

    condition: str
    label: str
    reported: npt.NDArray[np.float64]
    fresh: npt.NDArray[np.float64]
    replicates: npt.NDArray[np.uint32]
    problem: str = ""

    @property
    def n(self) -> int:
        """Number of champions that were tried again."""
        return len(self.reported)

    @property
    def expected(self) -> npt.NDArray[np.float64]:
        """Return the mean coverage of each champion on fresh noise, (n,)."""
        return np.asarray(self.fresh.mean(axis=1))

    @property
    def luck(self) -> Estimate:
        """Mean of what champions lose when they are tried again, with its BCa interval; without one below 10."""
        luck = bca_interval(difference_of_means, self.reported, self.expected, paired=True)
        return replace(luck, value=float((self.reported - self.expected).mean()))

    @property
    def expected_mean(self) -> Estimate:
        """Mean coverage on fresh noise, with its BCa interval; without one below 10 champions."""
        return bca_mean(self.expected)


def retry_champions(folder: Results) -> list[Champions]:
    """Try the best network of each run 20 times on fresh noise, for up to 100 runs a condition.

    The best of 40 noisy trials is above what its network does on average. Only the mean on fresh noise says
    what was evolved.

    Args:
        folder: Results of a study, or the path to them.

    Returns:
        One for each condition with runs. If trials cannot be recomputed, `problem` gives the reason.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, or it holds no trials yet.
    """
    tally = read_tally(folder)
    return [_retry(tally, each) for each in tally.with_runs]


def _retry(tally: Tally, described: DescribedCondition) -> Champions:
    name, label = described["name"], label_of(described)
    try:
        condition = tally.resolved(name)
        if condition.is_physical:
            raise RecordError("a robot drove it, and no program drives its champions again")
        rows = _champion_rows(tally, condition)
        reported, fresh = _try_again(condition, rows, tally.coverage_column)
    except (RecordError, ValueError) as error:
        problem = (
            "its settings are another version’s" if isinstance(error, RecordVersionError) else str(error)
        )
        none = np.empty(0)
        return Champions(name, label, none, none.reshape(0, FRESH_TRIALS), none.astype(np.uint32), problem)
    return Champions(name, label, reported, fresh, rows["replicate"].to_numpy())


def _champion_rows(tally: Tally, condition: Condition) -> pl.DataFrame:
    """The best individual of each of the first runs, the first of several alike."""
    column = tally.coverage_column
    replicates = [int(run) for run in tally.replicates(condition.name)[:MOST_RUNS]]
    columns = ["replicate", "generation", "individual", column, "key", *condition.genome_columns]
    rows = tally.folder.read(condition.name, replicates, columns)
    best = rows.filter(pl.col(column) == pl.col(column).max().over("replicate"))
    return best.unique("replicate", keep="first", maintain_order=True)


def _try_again(
    condition: Condition, rows: pl.DataFrame, column: str
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    if (rows["key"] != condition.key).any():
        raise RecordError("its rows were not drawn with the key of its settings")
    keys = [
        NoiseKey(key, replicate, generation, individual)
        for key, replicate, generation, individual in rows.select(
            "key", "replicate", "generation", "individual"
        ).iter_rows()
    ]
    genomes = [genome_of(condition, row) for row in rows.iter_rows(named=True)]
    batch = retry_genomes(
        condition.on,
        condition.arena.arena(),
        genomes,
        noise=condition.noise,
        noise_keys=keys,
        repeats=range(FRESH_TRIALS + 1),
        inputs=condition.network_inputs,
        partners=[partners_of(condition, row) for row in rows.iter_rows(named=True)],
    )
    coverage: npt.NDArray[np.float64] = getattr(batch, column).reshape(len(genomes), -1)
    reported = rows[column].to_numpy()
    if not np.array_equal(coverage[:, 0], reported):
        raise RecordError("its trials come out otherwise when run again; another version computed them")
    return reported, coverage[:, 1:]
