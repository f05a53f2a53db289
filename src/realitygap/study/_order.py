"""The order for one chunk, as it travels to a worker of a cluster, and what the worker does with it.

Plain values travel, so that a worker with another version can still say that it is another.
"""

from __future__ import annotations

import functools
import hashlib
import socket
from pathlib import Path
from typing import Any

from realitygap._version import __version__
from realitygap.errors import ClusterError, RecordError
from realitygap.records import RESULTS_VERSION, MissingInboxError, deliver
from realitygap.runs import Condition, run_replicates

from ._executors import ChunkTask


@functools.cache
def software() -> dict[str, str | int]:
    """Return the software that decides the numbers: version, results version, and a hash of our sources."""
    digest = hashlib.sha256()
    root = Path(__file__).parents[1]
    for path in sorted(root.rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode())
        digest.update(path.read_bytes())
    return {
        "realitygap": __version__,
        "results version": RESULTS_VERSION,
        "sources": digest.hexdigest()[:16],
    }


# What a worker evaluates. A function of ours would be loaded where a message arrives: by the scheduler, which has no
# use for it, and by a worker that lacks it, which ends without a word.
CARRY_OUT = f"__import__({__name__!r}, fromlist=['carry_out_order']).carry_out_order(order)"


def make_order(task: ChunkTask, inbox: Path) -> dict[str, Any]:
    """Return the order for a chunk that is to be delivered to `inbox`."""
    condition = task.condition
    return {
        "software": software(),
        "inbox": str(inbox),
        "condition": condition.name,
        "settings": condition.settings(),
        "hash": condition.hash(),
        "first": task.first,
        "n_runs": task.n_runs,
        # A worker cannot ask: the process that sent the order has the permission.
        "may_run_code": all(function.may_run for function in condition.functions),
    }


def carry_out_order(order: dict[str, Any]) -> None:
    """Compute a chunk and deliver it; called by a worker. Return the error, or nothing.

    Raises:
        ClusterError: This is another version, or the folder does not exist here or cannot be written.
    """
    if order["software"] != software():
        raise _refusal(_other_software(order["software"], software()))
    inbox = Path(order["inbox"])
    if not inbox.is_dir():
        raise _refusal(_no_shared_folder(inbox))
    condition = Condition.from_settings(order["condition"], order["settings"])
    if order["may_run_code"]:
        condition = condition.allowed()
    frame = run_replicates(condition, order["first"], order["n_runs"])
    try:
        deliver(inbox, condition.name, order["first"], frame, order["hash"])
    except MissingInboxError:
        raise _refusal(_no_shared_folder(inbox)) from None
    except RecordError as error:
        raise _refusal(str(error)) from None


def _refusal(why: str) -> ClusterError:
    return ClusterError(f"The worker on {socket.gethostname()} refused: {why}")


def _other_software(wanted: dict[str, str | int], found: dict[str, str | int]) -> str:
    differences = [
        f"{name} is {found.get(name)!r} there, {wanted[name]!r} here"
        for name in wanted
        if found.get(name) != wanted[name]
    ]
    return (
        f"{', '.join(differences)}. Its numbers may differ, so none were computed. Install the same realitygap "
        "for the workers (simplest: one environment in a shared folder), restart them, and run the same "
        "command again."
    )


def _no_shared_folder(inbox: Path) -> str:
    return (
        f"it cannot access {inbox.parent}. Workers write their chunks there. Name a folder that all machines "
        "share under one path (--out DIR), such as one in your home on a university cluster."
    )
