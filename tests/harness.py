"""Whether the harness around Enki can be built here."""

import shutil
from pathlib import Path

import pytest

HAS_ENKI = shutil.which("g++") is not None and Path("/usr/include/enki/PhysicalEngine.h").exists()
needs_enki = pytest.mark.skipif(not HAS_ENKI, reason="needs the system packages g++ and libenki-dev")
