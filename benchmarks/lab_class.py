"""How long the phones of a class wait for their robots, and what the lab takes for it.

    python benchmarks/lab_class.py                      # 30 phones drive a round of one minute
    python benchmarks/lab_class.py --clients 10 --json

Each phone is a client with a websocket, as the page of a student has it. It sends the position of its pad ten times a
second. A wait lasts from such a message to the news that the robot follows it. The robots move ten times a second: 50
ms of a median wait are the time until the next step. The clients run in one process on the same machine as the lab, and
share its cores with it.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import random
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from websockets.asyncio.client import connect

from lab_client import PageClient

PULL_S = 0.1
"""Time between two messages of a pad that is held [s]."""
CORES = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
TICKS = os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 100


async def phone(address: str, number: int, waits_s: list[float], joined: asyncio.Semaphore) -> dict[str, Any]:
    """Join, drive until the round is over, and return what the lab said last."""
    sent: dict[int, float] = {}
    state: dict[str, Any] = {}
    async with connect(
        address, additional_headers={"Cookie": f"realitygap_visitor=phone-{number}"}
    ) as socket:
        await socket.send(json.dumps({"kind": "join", "name": f"Student {number}"}))

        async def pull() -> None:
            move, turn, n = 1.0, 0.0, 0
            while True:
                n += 1
                if n % 10 == 0:
                    turn = random.uniform(-0.7, 0.7)
                sent[n] = time.perf_counter()
                await socket.send(json.dumps({"kind": "drive", "move": move, "turn": turn, "n": n}))
                await asyncio.sleep(PULL_S)

        pulling = None
        async for text in socket:
            news = json.loads(text)
            if news["kind"] == "class":
                if news["name"] and not state.get("name"):
                    joined.release()
                state = news
                if news["phase"] == "round" and pulling is None:
                    await asyncio.sleep(random.uniform(0.0, PULL_S))
                    pulling = asyncio.create_task(pull())
                elif news["phase"] == "over":
                    break
            elif pulling is not None:
                now, followed = time.perf_counter(), [n for n in sent if n <= news["heard"]]
                waits_s += [now - sent.pop(n) for n in followed]
        if pulling is not None:
            pulling.cancel()
    return state


async def drive(board: str, n_clients: int, lab: int) -> dict[str, Any]:
    """Have so many phones drive a round; return what was measured."""
    waits_s: list[float] = []
    joined = asyncio.Semaphore(0)
    address = f"ws://{urlsplit(board).netloc}/class/ws"
    async with PageClient(board) as lecturer:
        phones = [asyncio.create_task(phone(address, k, waits_s, joined)) for k in range(n_clients)]
        for _ in range(n_clients):
            await joined.acquire()
        await asyncio.sleep(15.0)  # until evolution is complete
        before, began = cpu_s(lab), time.perf_counter()
        buttons = [
            number
            for number, it in lecturer.elements.items()
            if it.get("props", {}).get("label") == "Start round"
        ]
        await lecturer.happen(buttons[-1], "click", {})  # the others have been drawn again since
        states = await asyncio.gather(*phones)
        share = (cpu_s(lab) - before) / (time.perf_counter() - began)
    waits_s.sort()
    return {
        "clients": n_clients,
        "cores": CORES,
        "n": len(waits_s),
        "median_ms": round(1e3 * statistics.median(waits_s)),
        "most_of_95_percent_ms": round(1e3 * waits_s[int(0.95 * len(waits_s))]),
        "longest_ms": round(1e3 * waits_s[-1]),
        "lab_share_of_a_core": round(share, 2),
        "results": max(state["n"] for state in states),
    }


def cpu_s(process: int) -> float:
    """Return the processor time of a process [s]; 0 where the system does not say."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / TICKS


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--clients", type=int, default=30, help="number of phones")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        command = [
            "-m",
            "realitygap",
            "lab",
            folder,
            "--class",
            "--host",
            "127.0.0.1",
            "--port",
            "0",
            "--no-open",
        ]
        with subprocess.Popen([sys.executable, *command], stdout=subprocess.PIPE, text=True) as lab:
            board = next(line.split()[1] for line in lab.stdout or () if line.startswith("Open "))
            try:
                found = asyncio.run(drive(board, options.clients, lab.pid))
            finally:
                lab.terminate()
    if options.json:
        print(json.dumps(found))
        return
    print(
        f"{found['clients']} phones, {found['cores']} cores: a robot follows a command after {found['median_ms']} ms "
        f"(median), 95 % within {found['most_of_95_percent_ms']} ms, all within {found['longest_ms']} ms "
        f"(n = {found['n']:,}).\n"
        f"The lab takes {found['lab_share_of_a_core']:.0%} of a core. The board has {found['results']} results."
    )


if __name__ == "__main__":
    main()
