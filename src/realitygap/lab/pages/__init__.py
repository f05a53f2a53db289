"""The pages of the lab, in NiceGUI."""

from __future__ import annotations

from importlib import resources

from nicegui import app

from realitygap.lab._lab import Lab

from ._calibrate import add_calibrate
from ._class import add_class
from ._control import add_stop
from ._error_pages import add_error_pages
from ._gap import add_gap
from ._home import add_home
from ._new import add_new
from ._photos import add_photos
from ._robot import add_robot
from ._saved import add_saved
from ._study import add_study
from ._trials import add_trials


def add_pages(lab: Lab) -> None:
    """Add all pages."""
    app.add_static_files("/lab-files", str(resources.files(__package__) / "static"))
    tokens = resources.files("realitygap.drawing") / "tokens.css"
    app.add_static_file(local_file=str(tokens), url_path="/lab-tokens/tokens.css")
    playback = resources.files("realitygap.playback")
    app.add_static_file(local_file=str(playback / "player.js"), url_path="/lab-player/player.js")
    app.add_static_file(local_file=str(playback / "player.css"), url_path="/lab-player/player.css")
    pages = (
        add_home,
        add_new,
        add_trials,
        add_photos,
        add_robot,
        add_study,
        add_gap,
        add_calibrate,
        add_saved,
        add_class,
    )
    for add in (*pages, add_stop, add_error_pages):
        add(lab)
