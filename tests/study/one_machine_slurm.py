"""SLURM on this machine alone: munged, slurmctld and slurmd from a folder of their own, on the loopback interface."""

from __future__ import annotations

import contextlib
import getpass
import os
import secrets
import shutil
import socket
import subprocess
from pathlib import Path

import psutil

from .dask_processes import free_port, kill, wait_until

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "squeue", "scancel", "sinfo")

CONF = """\
ClusterName=one
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller_port}
SlurmdPort={node_port}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
CredType=cred/munge
AuthInfo=socket={folder}/munge.socket
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SwitchType=switch/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmdParameters=config_overrides
SchedulerParameters=sched_interval=1
MinJobAge=2
KillWait=2
ReturnToService=2
NodeName=one NodeHostname={host} NodeAddr=127.0.0.1 CPUs=4 RealMemory=8000 State=UNKNOWN
PartitionName=all Nodes=one Default=YES MaxTime=INFINITE State=UP
"""


def program(name: str) -> str | None:
    """Its path; daemons lie where an account's PATH may not lead."""
    return shutil.which(name, path=os.environ["PATH"] + ":/usr/sbin:/sbin")


class OneMachineSlurm:
    """The three daemons; use it as a context manager.

    Attributes:
        environment: With it, sbatch and its kin find this SLURM and no other.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._started: list[subprocess.Popen] = []
        self.environment = {**os.environ, "SLURM_CONF": str(folder / "slurm.conf")}

    def __enter__(self) -> OneMachineSlurm:
        folder = self._folder
        for name in ("state", "spool"):
            (folder / name).mkdir()
        key = folder / "munge.key"
        key.write_bytes(secrets.token_bytes(128))
        key.chmod(0o600)
        (folder / "slurm.conf").write_text(
            CONF.format(
                host=socket.gethostname().split(".")[0],
                user=getpass.getuser(),
                folder=folder,
                controller_port=free_port(),
                node_port=free_port(),
            )
        )
        files = [f"--{name}-file={folder}/munge.{name}" for name in ("key", "pid", "seed", "log")]
        files = [each.replace("munge.seed", "munge.seeds") for each in files]
        self._start("munged", "--foreground", "--force", f"--socket={folder}/munge.socket", *files)
        wait_until(lambda: (folder / "munge.socket").exists())
        self._start("slurmctld", "-D", "-i", "-f", str(folder / "slurm.conf"))
        self._start("slurmd", "-D", "-N", "one", "-f", str(folder / "slurm.conf"))
        wait_until(lambda: "idle" in self.run("sinfo", "-h", "-o", "%t"))
        return self

    def __exit__(self, *_: object) -> None:
        for number in self.jobs():
            self.run("scancel", number)
        with contextlib.suppress(AssertionError):
            wait_until(lambda: not self.jobs(), 15)
        for step in self._steps():  # a daemon of its own for each job
            with contextlib.suppress(psutil.NoSuchProcess):
                step.kill()
        for process in reversed(self._started):
            kill(process)

    def run(self, name: str, *arguments: str) -> str:
        """What a command of SLURM prints."""
        done = subprocess.run(
            [program(name), *arguments],
            env=self.environment,
            capture_output=True,
            text=True,
            check=False,
            timeout=60,
        )
        return done.stdout

    def jobs(self, state: str | None = None) -> list[str]:
        """Numbers of the jobs that are queued or running."""
        chosen = [] if state is None else ["-t", state]
        return self.run("squeue", "-h", "-o", "%i", *chosen).split()

    def _steps(self) -> list[psutil.Process]:
        ours = str(self._folder)
        found = []
        for process in psutil.process_iter(["name"]):
            if process.info["name"] == "slurmstepd":
                with contextlib.suppress(psutil.Error):
                    if process.environ().get("SLURM_CONF", "").startswith(ours):
                        found.append(process)
        return found

    def _start(self, name: str, *arguments: str) -> None:
        with (self._folder / f"{name}.output").open("wb") as log:
            process = subprocess.Popen(
                [program(name), *arguments], env=self.environment, stdout=log, stderr=subprocess.STDOUT
            )
        self._started.append(process)
