"""Neural posterior estimation of the robot's numbers, in an environment of its own.

    uv venv NPE && uv pip install --python NPE -e '.[twin]' sbi==0.27.0
    NPE/bin/python -m benchmarks.closing.npe results/closing-2

Source: Greenberg, Nonnenmacher & Macke (2019), NPE-C, with the defaults of sbi 0.27.0 (Tejero-Cantero et al. 2020), one
round from the prior. The summaries are those of BayesSim (Ramos, Possas & Fox, RSS 2019, section III-B): products of
state differences and commands, and means and variances of state differences, for lags of 0 to 4 commands. The simulated
trials repeat the recorded commands. It may simulate as many sets of numbers as our own fit. Training takes hundreds of
epochs: `fast_training` halves their time, and `--twins` lets two processes share the fits. It needs a C++ compiler.
"""

from __future__ import annotations

import argparse
import functools
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import sbi.inference.trainers.base as trainers
import torch
from numpy.typing import NDArray
from sbi.inference import NPE
from sbi.neural_nets.estimators.nflows_flow import NFlowsFlow
from torch.utils.data import TensorDataset
from torch.utils.data._utils.fetch import _MapDatasetFetcher
from torch.utils.tensorboard.writer import SummaryWriter

from realitygap.calibration import numbers_of, ranges_of, scribbler_prior, values_of
from realitygap.platforms import SimEnsemble, SimPlatform
from realitygap.records import write_whole

from .outside import MOST_SETS, write_outside
from .plan import Unit, read_plan, small_plan
from .twin import TwinOfStudy

Floats = NDArray[np.float64]
ARM, N_DRAWS, LAGS = "npe", 500, 5


def fast_training() -> None:
    """Make sbi train the same network in half the time: a compiled loss, one fused step, and batches read at once.

    The losses of 103 steps on random data were equal in all printed digits. sbi reads a batch row by row.
    """

    def fetch(self: Any, at: list[int]) -> list[torch.Tensor]:
        if not (self.auto_collation and isinstance(self.dataset, TensorDataset)):
            return fetch_rows(self, at)
        return [tensor[torch.as_tensor(at)] for tensor in self.dataset.tensors]

    fetch_rows = _MapDatasetFetcher.fetch
    _MapDatasetFetcher.fetch = fetch
    trainers.Adam = functools.partial(trainers.Adam, fused=True)
    NFlowsFlow.loss = torch.compile(NFlowsFlow.loss)
    torch.set_num_threads(1)


def summaries(poses: Floats, readings: Floats, stalled: Floats, commands: Floats) -> Floats:
    """Return (m, d) summaries of (m, k, t + 1, ...) poses, readings and stalls, and (k, t, 2) commands."""
    moved = np.diff(poses, axis=2)
    heading = poses[:, :, :-1, 2]
    ahead = moved[..., 0] * np.cos(heading) + moved[..., 1] * np.sin(heading)
    aside = -moved[..., 0] * np.sin(heading) + moved[..., 1] * np.cos(heading)
    turned = (moved[..., 2] + np.pi) % (2 * np.pi) - np.pi
    t = ahead.shape[2]
    states = np.stack(
        [ahead, aside, turned, stalled[:, :, :t], *np.moveaxis(readings[:, :, :t], -1, 0)], axis=-1
    )
    products = []
    for lag in range(LAGS):
        late = commands[:, : t - lag]
        for power in (late, late[..., :1] * late[..., 1:], np.sign(late)):
            products.append(
                np.einsum("mkts,kta->msa", states[:, :, lag:], power).reshape(len(states), -1)
                / late[..., 0].size
            )
    flat = states.reshape(len(states), -1, states.shape[-1])
    return np.concatenate([*products, flat.mean(axis=1), flat.var(axis=1)], axis=1)


def fit(twin: TwinOfStudy, sets: int) -> None:
    """Write the calibration of a twin."""
    plan = twin.plan
    seed = plan.seed_of(twin.twin, ARM)
    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    with twin.open() as target:
        trials, arena = twin.calibrating(target, plan.budget), target.arena
    robot = twin.condition("coverage", "x").on.robot  # type: ignore[attr-defined]
    prior = scribbler_prior(robot)
    ensemble = SimEnsemble(
        SimPlatform(robot=robot, step_s=trials[0].step_s), arena, ranges=ranges_of(prior, robot)
    )
    starts, commands = (
        np.array([trial.poses[0] for trial in trials]),
        np.array([trial.commands for trial in trials]),
    )
    t = commands.shape[1]
    places = rng.normal(
        size=(sets, len(prior))
    )  # on a scale without ends, no draw of the posterior is outside the prior
    found = []
    for at in range(0, sets, 500):
        some = places[at : at + 500]
        made = ensemble.replay(
            starts, commands, numbers_of(prior, values_of(prior, some), robot), seed + at,
            keep=("poses", "readings", "stalled"),
        )  # fmt: skip
        found.append(summaries(made.poses, made.readings, made.stalled, commands))
    simulated = np.concatenate(found)
    observed = summaries(
        np.stack([trial.poses for trial in trials])[None],
        np.stack([trial.readings for trial in trials])[None, :, :t],
        np.stack([trial.stalled for trial in trials])[None, :, :t],
        commands,
    )
    tensors = [torch.as_tensor(each, dtype=torch.float32) for each in (places, simulated, observed)]
    normal = torch.distributions.MultivariateNormal(torch.zeros(len(prior)), torch.eye(len(prior)))
    with tempfile.TemporaryDirectory() as logs:  # else they are in the working directory
        writer = SummaryWriter(logs)
        inference = NPE(prior=normal, summary_writer=writer, show_progress_bars=False)
        inference.append_simulations(tensors[0], tensors[1]).train()
        writer.close()
    drawn = inference.build_posterior().sample((N_DRAWS,), x=tensors[2][0], show_progress_bars=False)
    values = values_of(prior, np.asarray(drawn, dtype=float))
    middle = {name: np.median(each, keepdims=True) for name, each in values.items()}
    numbers = {name: float(each[0]) for name, each in numbers_of(prior, middle, robot).items()}
    write_outside(
        twin, ARM, numbers, numbers_of(prior, values, robot), {n: float(v[0]) for n, v in middle.items()}
    )


def main() -> None:
    """Fit the twins of a folder whose trials are there."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--small", action="store_true")
    parser.add_argument("--twins", help="names with commas between them, such as close-0,worn-2")
    options = parser.parse_args()
    plan = small_plan() if options.small else read_plan()
    every = [str(twin) for twin in plan.names()]
    names = options.twins.split(",") if options.twins else every
    if unknown := set(names) - set(every):
        parser.error(f"--twins has {', '.join(sorted(unknown))}, expected some of {', '.join(every)}")
    fast_training()
    for twin in plan.names():
        if str(twin) not in names:
            continue
        one = TwinOfStudy(plan, twin, options.folder)
        if Unit("coverage", ARM) not in plan.units(twin):
            continue
        if one.trials_path(plan.budget).exists() and not one.fit_path(plan.arm[ARM]).exists():
            try:
                fit(one, MOST_SETS if not options.small else 1000)
            except (ValueError, ArithmeticError, RuntimeError) as problem:
                write_whole(one.failure_path(plan.arm[ARM]), str(problem).encode(), within=one.folder)
            print(twin, flush=True)


if __name__ == "__main__":
    main()
