"""Time until the first figure of a complete study is visible in Chromium, from the press on Open.

    python benchmarks/lab_page.py             # the paper's study with 450 runs, five times each; a minute
    python benchmarks/lab_page.py --rounds 3 --json

Cold: nothing is drawn yet. The list of studies was open for some seconds, which starts the process that draws.
Warm: the figures are saved in the study's folder. Needs Chromium and the extra `dev`.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import realitygap

REPLICATES = 50
SETTLE_S = 10.0
"""Time on the list of studies before the press [s]."""
VISIBLE = """() => [...document.querySelectorAll(".lab-curves polyline, .lab-figure img")].some(
  (it) => it.checkVisibility() && (it.tagName === "polyline" || it.naturalWidth > 0))"""
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


def measure(rounds: int) -> dict[str, Any]:
    """Return the times until the first figure is visible [s]."""
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as name, sync_playwright() as driver:
        root = Path(name)
        realitygap.run_study("paper", root / "paper", replicates=REPLICATES)
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        times: dict[str, list[float]] = {"cold": [], "warm": []}
        for _ in range(rounds):
            for state, found in times.items():
                if state == "cold":
                    shutil.rmtree(root / "paper" / "lab", ignore_errors=True)
                found.append(_open_once(browser, root, is_cold=state == "cold"))
        browser.close()
    median = {state: round(statistics.median(found), 2) for state, found in times.items()}
    return {
        "runs": 9 * REPLICATES,
        "rounds": rounds,
        "median_s": median,
        "all_s": times,
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "load": [round(each, 1) for each in os.getloadavg()],
    }


def _open_once(browser: Any, root: Path, *, is_cold: bool) -> float:
    """Open the study in a lab that was just started, and wait for its first figure."""
    command = [sys.executable, "-u", "-m", "realitygap", "lab", str(root), "--no-open", "--port", "0"]
    lab = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        address = next(match for line in lab.stdout or () if (match := re.search(r"http://\S+", line)))[0]
        page = browser.new_context(viewport={"width": 1440, "height": 900}).new_page()
        page.goto(address)
        page.locator('[data-study="paper"]').wait_for()
        page.wait_for_timeout(1000 * SETTLE_S)
        if is_cold:
            shutil.rmtree(root / "paper" / "lab", ignore_errors=True)
        began = time.perf_counter()
        page.locator('[data-study="paper"]').get_by_role("button", name="Open", exact=True).click()
        page.wait_for_url("**/study/paper")
        page.wait_for_function(VISIBLE)
        seconds = time.perf_counter() - began
        if is_cold:
            page.locator(".lab-figure img").nth(4).wait_for()
            page.wait_for_timeout(2000)  # until the figures are saved
        page.context.close()
        return round(seconds, 2)
    finally:
        lab.send_signal(signal.SIGINT)
        lab.wait(20)


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--json", action="store_true", help="print data")
    options = parser.parse_args()
    found = measure(options.rounds)
    if options.json:
        print(json.dumps(found, indent=1))
        return
    median = found["median_s"]
    print(
        f"First figure of {found['runs']} runs: {median['cold']} s after the press if nothing is drawn, "
        f"{median['warm']} s with saved figures. "
        f"Medians of {found['rounds']}; {found['cores']} cores, load {found['load'][0]}."
    )


if __name__ == "__main__":
    main()
