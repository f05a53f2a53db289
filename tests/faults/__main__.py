"""Run campaigns: `python -m tests.faults [KIND ...]`."""

from __future__ import annotations

import argparse
from pathlib import Path

from .campaign import KINDS, run_campaign


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.faults", description=__doc__)
    parser.add_argument("kinds", nargs="*", choices=[*KINDS, []], help="Kinds of faults. Default: all.")
    parser.add_argument("--n", type=int, help="Faults of each kind. Default: as many as a release needs.")
    parser.add_argument(
        "--out", type=Path, help="File that gets one line per batch; a campaign resumes by it."
    )
    parser.add_argument("--batch", type=int, help="Faults in a batch. Default: by their kind.")
    options = parser.parse_args()
    for kind in options.kinds or KINDS:
        run_campaign(kind, options.n, options.out, options.batch)


if __name__ == "__main__":
    main()
