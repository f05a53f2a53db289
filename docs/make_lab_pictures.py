"""The pictures of the lab in the documents, taken by the tests that walk through its pages.

    uv run python docs/make_lab_pictures.py

They are written into docs/images/lab; look at each.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

DOCS = Path(__file__).parent
IMAGES = DOCS / "images" / "lab"
SCENES = ("tests/lab/test_screenshots_in_browser.py", "tests/lab/test_class_in_browser.py")


def main() -> int:
    """Take all pictures."""
    IMAGES.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", "pytest", "-q", "-m", "long", *SCENES]
    environment = os.environ | {"REALITYGAP_SCREENSHOTS": str(IMAGES)}
    return subprocess.run(command, cwd=DOCS.parent, env=environment, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
