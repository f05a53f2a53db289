"""Commands that start realitygap and add packages to it, by pip or by uv in a clone, for messages."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path


def launcher() -> str:
    """Return what starts realitygap in this terminal: its name, or `uv run realitygap` if only uv finds it.

    Without a terminal it is the name, so that saved output is the same everywhere.
    """
    if "UV" not in os.environ or not (sys.stdout is not None and sys.stdout.isatty()):
        return "realitygap"
    path = _path_of_the_shell()
    return "realitygap" if shutil.which("realitygap", path=path) else f"{_uv(path)} run realitygap"


def install_command(extra: str) -> str:
    """Return the command that adds an extra to the environment of this Python."""
    folder = _source_folder()
    if folder is None:
        return f"pip install 'realitygap[{extra}]'"
    if _is_made_by_uv():
        return f"{_uv(_path_of_the_shell())} sync --inexact --extra {extra}"
    where = "." if folder == Path.cwd() else folder
    return f"pip install '{where}[{extra}]'"


def _path_of_the_shell() -> str:
    """Return the PATH of the shell, without the folder that `uv run` adds for its child."""
    folders = os.environ.get("PATH", "").split(os.pathsep)
    own = str(Path(sys.executable).parent)
    if "UV" in os.environ and own in folders:
        folders.remove(own)
    return os.pathsep.join(folders)


def _uv(path: str) -> str:
    return "uv" if shutil.which("uv", path=path) else "python3 -m uv"


def _source_folder() -> Path | None:
    """Return the clone that realitygap was installed from; None if it came from elsewhere."""
    from importlib import metadata

    from realitygap._limits import parse_json

    try:
        origin = parse_json(metadata.distribution("realitygap").read_text("direct_url.json") or "{}")
    except (metadata.PackageNotFoundError, ValueError):
        return None
    url = str(origin.get("url", ""))
    folder = Path(url.removeprefix("file://"))
    return folder if url.startswith("file://") and folder.joinpath("pyproject.toml").is_file() else None


def _is_made_by_uv() -> bool:
    try:
        return "\nuv = " in "\n" + Path(sys.prefix, "pyvenv.cfg").read_text("utf-8")
    except (OSError, ValueError):
        return False
