"""Workers as jobs of a batch system, through dask-jobqueue, with settings from the user's Dask configuration."""

from __future__ import annotations

import contextlib
import shutil
import signal
from typing import Any

from realitygap.errors import StudyError, did_you_mean

CLASSES = {
    "slurm": "SLURMCluster",
    "pbs": "PBSCluster",
    "sge": "SGECluster",
    "lsf": "LSFCluster",
    "oar": "OARCluster",
    "htcondor": "HTCondorCluster",
    "moab": "MoabCluster",
}


def load_dask_jobqueue() -> Any:
    """Return the module dask_jobqueue, whose import would have Ctrl-C end the process without a word."""
    handler = signal.getsignal(signal.SIGINT)
    import dask_jobqueue

    signal.signal(signal.SIGINT, handler)
    return dask_jobqueue


class JobQueue:
    """A Dask scheduler in this process, and workers in jobs.

    Args:
        name: Name of the batch system, with an optional number of jobs as `:JOBS`.

    Raises:
        StudyError: there is no such batch system here, or its settings are not complete.
    """

    def __init__(self, name: str) -> None:
        import dask

        dask_jobqueue = load_dask_jobqueue()
        self.name, n_jobs = self.check_name(name)
        self._n_jobs = n_jobs or int(dask.config.get("realitygap.jobs", 1))
        kind = getattr(dask_jobqueue, CLASSES[self.name])
        command = kind.job_cls.submit_command.split()[0]
        if shutil.which(command) is None:
            raise StudyError(
                f"There is no `{command}` on this machine. Run the command where you submit jobs, a login node."
            )
        # One process a job: kernels leave the interpreter to others while they compute.
        processes = dask.config.get(f"jobqueue.{self.name}.processes", None) or 1
        try:
            self._cluster = kind(processes=processes)
        except (ValueError, TypeError) as error:
            raise StudyError(
                f"The settings for jobs of {self.name} are not complete: {_one_line(error)} Set `cores` and `memory` "
                f"under `jobqueue: {self.name}:` in ~/.config/dask/jobqueue.yaml."
            ) from None

    @staticmethod
    def check_name(name: str) -> tuple[str, int | None]:
        """Return the parts of a name: the batch system, and the number of jobs if given.

        Raises:
            StudyError: it is neither an address nor a batch system.
        """
        system, colon, jobs = name.partition(":")
        if system not in CLASSES:
            raise StudyError(
                f"Unknown cluster {name!r}. Expected tcp://HOST:PORT of a Dask scheduler, or a batch system, such as "
                f"slurm or slurm:20 (jobs). {did_you_mean(system, CLASSES)}"
            )
        if colon and not (jobs.isascii() and jobs.isdigit() and int(jobs) >= 1):
            raise StudyError(f"{name!r} asks for {jobs!r} jobs, expected a number, such as {system}:20.")
        return system, int(jobs) if colon else None

    def client(self) -> Any:
        """Return a client of its scheduler."""
        from distributed import Client

        return Client(self._cluster, set_as_default=False)

    def submit(self) -> None:
        """Submit jobs until the wanted number is queued or running. Lost jobs are replaced.

        Raises:
            StudyError: the batch system refused one.
        """
        cluster = self._cluster
        while len(cluster.worker_spec) < self._n_jobs:
            cluster.worker_spec.update(cluster.new_worker_spec())
        try:
            # `scale` would do the same without an error if a job is refused
            cluster.sync(cluster._correct_state)
        except (RuntimeError, OSError) as error:
            raise StudyError(
                f"{self.name} refused the job: {_one_line(error)} Check the settings under `jobqueue: {self.name}:` in "
                "~/.config/dask/jobqueue.yaml."
            ) from error

    def close(self) -> None:
        """End the jobs."""
        with contextlib.suppress(Exception):  # jobs that ended by themselves cannot be ended
            self._cluster.close(timeout=10)


def _one_line(error: Exception) -> str:
    text = " ".join(str(error).split())
    return text if text.endswith(".") else f"{text}."
