"""What watching costs: the measured figures of the page “The lab”.

    uv run python docs/make_lab.py            # on an idle machine; takes some minutes

Carries out `benchmarks/lab.py` and writes docs/data/lab.json. The page's table is worked out from that file when the
documents are built.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
DATA = HERE / "data" / "lab.json"
BENCHMARK = HERE.parent / "benchmarks" / "lab.py"


def page_parts() -> dict[str, str]:
    """The generated parts of the page, by file."""
    return {"parts/lab-watched.md": table(json.loads(DATA.read_text("utf-8")))}


def table(found: Mapping[str, Any]) -> str:
    """What the benchmark says, as the page has it."""
    both = [found["computing"], found["driving"]]
    answer, (computing, driving) = both[0]["answer_ms"], both
    rows = [
        (
            "processor time of the lab for them",
            *(f"{one['machine_share']:.1%} of {found['cores']} cores" for one in both),
        ),
        ("of it the server", *(f"{one['core_share']['server']:.1%} of a core" for one in both)),
        ("of it the drawing of figures", *(f"{one['core_share']['drawing']:.1%} of a core" for one in both)),
        ("messages to pages", *(f"{one['messages_per_s']:,.0f} a second" for one in both)),
        (
            "the study alone, and watched with the pages on the same machine",
            f"{computing['rate']['alone']:,.0f} and {computing['rate']['watched']:,.0f} runs a second",
            f"{driving['rate']['alone']:.2f} and {driving['rate']['watched']:.2f} steps a second",
        ),
        ("an update of a page, median", f"{answer['50']:.0f} ms", ""),
        ("an update of a page, 95th percentile", f"{answer['95']:.0f} ms", ""),
    ]
    said = (
        f"{found['pages']} pages, {found['rounds']} times {found['seconds']:.0f} s with and without them; "
        f"{computing['answers']:,} updates; load of the machine at the end {found['load'][0]:.1f}."
    )
    head = ["| | a study computes on all cores | an emulated robot drives |", "|---|---|---|"]
    return "\n".join([*head, *(f"| {' | '.join(row)} |" for row in rows), "", said, ""])


def main() -> None:
    """Measure, and write the figures down."""
    done = subprocess.run(
        [sys.executable, str(BENCHMARK), "--json"], check=True, stdout=subprocess.PIPE, text=True
    )
    DATA.write_text(json.dumps(json.loads(done.stdout), indent=1) + "\n", "utf-8")
    print(table(json.loads(done.stdout)))


if __name__ == "__main__":
    main()
