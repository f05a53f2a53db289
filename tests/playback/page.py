"""A page that shows a player as a notebook does: its module, its style, and a model with the kernel's values."""

from __future__ import annotations

import json
from importlib import resources
from pathlib import Path
from typing import Any

PAGE = """<!doctype html><html lang="en"><head><meta charset="utf-8"><title>player</title>
<link rel="icon" href="data:,"><style>%s</style></head><body><div id="cell" style="padding: 20px; width: %dpx"></div>
<script type="module">
%s
const values = %s;
const listeners = {};
window.sent = [];
window.model = {
  get: (name) => values[name],
  set: (name, value) => { values[name] = value; for (const listener of listeners[`change:${name}`] || []) listener(); },
  save_changes: () => {},
  on: (name, listener) => { (listeners[name] = listeners[name] || []).push(listener); },
  off: (name, listener) => { listeners[name] = (listeners[name] || []).filter((one) => one !== listener); },
  send: (message) => { window.sent.push(message); },
};
window.tell = (message) => { for (const listener of listeners["msg:custom"] || []) listener(message); };
window.heard = () => Object.values(listeners).flat().length;
window.cleanup = widget.render({ model: window.model, el: document.getElementById("cell") });
</script></body></html>
"""


def page_of(widget: Any, path: Path, width: int = 820) -> Path:
    """The page of a player, written to a file."""
    files = resources.files("realitygap.playback")
    module = (
        files.joinpath("player.js")
        .read_text("utf-8")
        .replace("export default { render };", "const widget = { render };")
    )
    values = {name: getattr(widget, name) for name in ("scene", "trials", "speed", "live", "was_live")}
    style = files.joinpath("player.css").read_text("utf-8")
    path.write_text(PAGE % (style, width, module, json.dumps(values, allow_nan=False)), "utf-8")
    return path
