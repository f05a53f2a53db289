"""The chunks of a study on the workers of a Dask cluster.

Workers write chunks into an inbox in the folder of results, which they must see under the same path; the process
that holds the folder's lock publishes them. So a worker that is lost, comes back late, or computes what another
has computed already can neither lose nor double anything.
"""

from __future__ import annotations

import contextlib
import logging
import queue
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from realitygap._how_to_run import install_command
from realitygap._interrupts import held_interrupts
from realitygap.errors import ClusterError, StudyError
from realitygap.records import Delivery, ResultsFolder
from realitygap.runs import Condition

from ._executors import ChunkTask, Listener
from ._job_queue import JobQueue
from ._order import CARRY_OUT, make_order

# How long a scheduler named by its address may take to answer, and be gone in the middle of the work [s].
CONNECT_S = 10.0
GONE_S = 60.0
# Chunks in progress for each thread of a worker: one is computed, and the others wait.
CHUNKS_PER_THREAD = 3
# Sent before the first worker is there, so that a job queue knows that there is work.
FIRST_CHUNKS = 4
# How often Dask may give one chunk up, which it does when several workers died with it, before we do.
TRIES = 3
# How often the workers are counted [s].
COUNT_S = 1.0


@dataclass
class _UnderWay:
    """A chunk that was sent."""

    task: ChunkTask
    n_given_up: int = 0

    @property
    def delivery(self) -> Delivery:
        """The file that its worker writes to the inbox."""
        condition = self.task.condition
        return Delivery(condition.name, self.task.first, self.task.n_runs, condition.hash())

    future: Any = None


class Cluster:
    """The workers of a Dask scheduler, or of jobs in the queue of a batch system; entering it connects.

    Args:
        name: `tcp://HOST:PORT` or `tls://HOST:PORT` of a scheduler that is running; or `slurm`, `pbs`, `sge`,
            `lsf`, `oar`, `htcondor` or `moab`, with `:JOBS` to say how many jobs.

    Raises:
        StudyError: the name is neither; on entering, the batch system is not set up here.
        ClusterError: the extra `cluster` is not installed; on entering, no scheduler answers.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.workers: dict[str, int] = {}
        self.jobs: JobQueue | None = None
        self.client: Any = None
        self._is_address = name.startswith(("tcp://", "tls://"))
        if not self._is_address:
            JobQueue.check_name(name)
        _require_dask()

    def __enter__(self) -> Cluster:
        with contextlib.ExitStack() as stack:
            stack.enter_context(_quiet())
            stack.callback(self._disconnect)
            if self._is_address:
                self.client = _connect(self.name, CONNECT_S)
            else:
                self.jobs = JobQueue(self.name)
                stack.callback(self.jobs.close)
                self.client = self.jobs.client()
            self._open = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._open.close()

    def facts(self) -> dict[str, Any]:
        """Return its name, and the threads of each worker since the start, by address."""
        return {"cluster": self.name, "workers": dict(self.workers)}

    def prepare(self, conditions: Sequence[Condition]) -> None:
        """Ask for jobs; each worker compiles or loads its kernels with its first chunk."""
        if self.jobs is not None:
            self.jobs.submit()

    def carry_out(self, folder: ResultsFolder, tasks: Iterator[ChunkTask], listener: Listener) -> None:
        """See `Executor`.

        Raises:
            ClusterError: the scheduler went away and did not come back, or one chunk ended many workers.
            ClusterError: a worker has another version, does not see the folder, or cannot write to it.
        """
        with folder.inbox() as inbox:
            sitting = _Sitting(self, folder, inbox.absolute(), tasks, listener)
            try:
                sitting.work()
            finally:
                sitting.recall()

    def _disconnect(self) -> None:
        if self.client is not None:
            with contextlib.suppress(Exception):  # a client whose scheduler is gone may complain of anything
                self.client.close(timeout=1)

    def connect_again(self, listener: Listener) -> None:
        """Wait for a scheduler at the same address, until one answers or `GONE_S` are over.

        Raises:
            ClusterError: none came back.
        """
        self._disconnect()
        if self.jobs is not None:
            raise ClusterError(f"The scheduler of the {self.name} jobs ended. {_GO_ON}")
        listener.wait_for(f"the scheduler at {self.name}, which does not respond")
        until = time.monotonic() + GONE_S
        while True:
            try:
                self.client = _connect(self.name, min(CONNECT_S, GONE_S))
                return
            except ClusterError as error:
                if time.monotonic() > until:
                    raise ClusterError(
                        f"The scheduler at {self.name} has not responded for {GONE_S:.0f} s. {_GO_ON}"
                    ) from error
                time.sleep(0.2)


_GO_ON = "Published runs are saved. Run the same command to resume."


class _Sitting:
    """One run of the chunks of a study: chunks in progress, and finished chunks."""

    def __init__(
        self,
        cluster: Cluster,
        folder: ResultsFolder,
        inbox: Path,
        tasks: Iterator[ChunkTask],
        listener: Listener,
    ) -> None:
        self._cluster = cluster
        self._folder = folder
        self._inbox = inbox
        self._tasks = tasks
        self._listener = listener
        self._again: list[_UnderWay] = []
        self._under_way: dict[str, _UnderWay] = {}
        self._ended: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._n_sent = 0
        self._threads = 0
        self._counted = -COUNT_S

    def work(self) -> None:
        while True:
            if self._cluster.client.status != "running":
                self._lost()
            with held_interrupts():
                self._count_workers()
                self._send()
                if not self._under_way:
                    return
                self._accept(self._some_ended())

    def recall(self) -> None:
        """Ask for nothing more; what workers still compute finds no inbox."""
        with contextlib.suppress(Exception):
            self._cluster.client.cancel([each.future for each in self._under_way.values()])

    def _count_workers(self) -> None:
        if time.monotonic() - self._counted < COUNT_S:
            return
        self._counted = time.monotonic()
        if self._cluster.jobs is not None:
            self._cluster.jobs.submit()
        try:
            workers: dict[str, int] = self._cluster.client.nthreads()
        except (OSError, TimeoutError):
            return  # the connection is lost, which the client's status soon says
        self._cluster.workers |= workers
        self._threads = sum(workers.values())
        self._listener.wait_for("" if self._threads else f"a worker of {self._cluster.name}")

    def _send(self) -> None:
        room = max(FIRST_CHUNKS, CHUNKS_PER_THREAD * self._threads) - len(self._under_way)
        for _ in range(room):
            if self._again:
                each = self._again.pop()
            elif (task := next(self._tasks, None)) is not None:
                each = _UnderWay(task)
            else:
                return
            self._send_one(each)

    def _send_one(self, each: _UnderWay) -> None:
        self._n_sent += 1
        key = f"{each.task.condition.name}-{each.task.first}-{self._inbox.name}-{self._n_sent}"
        self._under_way[key] = each
        each.future = self._cluster.client.submit(
            eval, CARRY_OUT, {"order": make_order(each.task, self._inbox)}, key=key, pure=False
        )
        each.future.add_done_callback(lambda _: self._ended.put(key))

    def _some_ended(self) -> list[_UnderWay]:
        """Return the tasks that ended, with or without a result, after a short wait."""
        ended: list[_UnderWay] = []
        with contextlib.suppress(queue.Empty):
            key = self._ended.get(timeout=0.2)
            while True:
                if (each := self._under_way.pop(key, None)) is not None:
                    ended.append(each)
                key = self._ended.get_nowait()
        return ended

    def _accept(self, ended: list[_UnderWay]) -> None:
        """Publish finished chunks, even if another one has failed, and resubmit lost ones."""
        # Once only: what is finished may be lost, and computed again, with the worker that told of it.
        status = [each.future.status for each in ended]
        finished = [each.delivery for each, what in zip(ended, status, strict=True) if what == "finished"]
        if finished:
            self._folder.accept(self._inbox, finished)
            self._listener.add(sum(delivery.n_runs for delivery in finished))
        for each, what in zip(ended, status, strict=True):
            if what == "error":
                self._failed(each)
            elif what != "finished":  # cancelled or lost, with the connection to the scheduler
                self._again.append(each)

    def _failed(self, each: _UnderWay) -> None:
        from distributed import KilledWorker

        error = each.future.exception()
        if isinstance(error, KilledWorker):
            each.n_given_up += 1
            if each.n_given_up < TRIES:
                self._again.append(each)
                return
            raise ClusterError(
                f"Replicates from {each.task.first} of {each.task.condition.name!r} ended every worker "
                f"that computed them, {each.n_given_up} times. The memory of the workers may be too small. Try a "
                f"smaller --chunk. {_GO_ON}"
            )
        if isinstance(error, (ImportError, AttributeError)):
            raise ClusterError(
                f"A worker of {self._cluster.name} cannot load this realitygap ({error}). Install the same one "
                "for all workers (simplest: one environment in a shared folder), restart them, and run the "
                "same command again."
            )
        raise error

    def _lost(self) -> None:
        self._cluster.connect_again(self._listener)
        self._again += self._under_way.values()
        self._under_way.clear()
        self._counted = -COUNT_S


def _quiet() -> contextlib.AbstractContextManager[None]:
    """Keep Dask from telling of lost workers and connections by tracebacks; we say in one line what matters."""
    from distributed.utils import silence_logging_cmgr

    silent: contextlib.AbstractContextManager[None] = silence_logging_cmgr(logging.CRITICAL)
    return silent


def _require_dask() -> None:
    try:
        import distributed  # noqa: F401
    except ImportError:
        raise ClusterError(
            f"--cluster needs packages that are not installed. Install them: {install_command('cluster')}"
        ) from None


def _connect(address: str, seconds: float) -> Any:
    from distributed import Client
    from distributed.comm.addressing import get_address_host_port

    try:
        # Before there is a client: one that fails at its address takes 20 s to go, and says so by a traceback.
        get_address_host_port(address, strict=True)
    except ValueError as error:
        raise StudyError(
            f"{address!r} is not the address of a scheduler ({error}). Expected, for example, tcp://HOST:8786."
        ) from None
    try:
        return Client(address, timeout=seconds, set_as_default=False)
    except (OSError, TimeoutError) as error:
        raise ClusterError(
            f"No Dask scheduler answers at {address}. Is it running (`dask scheduler`), and does this machine reach it?"
        ) from error
