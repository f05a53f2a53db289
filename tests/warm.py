"""Compile the kernels that most tests use: `python -m tests.warm jyro` or `sim`."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from realitygap.study import load_study, run_study

STUDY = """
[study]
name = "warm"
replicates = 2
[neat]
settings = "rosenzweig-remy"
population = 4
generations = 2
[[condition]]
name = "coverage"
platform = "{platform}"
[[condition]]
name = "novelty"
platform = "{platform}"
selection = "novelty"
"""


def main(platform: str) -> None:
    """Run a small study on a platform."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "study.toml"
        path.write_text(STUDY.format(platform=platform))
        run_study(load_study(path), Path(folder) / "results")


if __name__ == "__main__":
    main(sys.argv[1])
