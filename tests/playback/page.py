"""A page that shows a widget as a notebook does: its module, its style, and a model with the kernel's values."""

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
  send: (message) => { window.sent.push(message); if (window.kernel) window.kernel(message).then(window.answer); },
};
window.answer = ([values, replies]) => {
  for (const [name, value] of Object.entries(values)) window.model.set(name, value);
  replies.forEach(window.tell);
};
window.tell = (message) => { for (const listener of listeners["msg:custom"] || []) listener(message); };
window.heard = () => Object.values(listeners).flat().length;
window.cleanup = widget.render({ model: window.model, el: document.getElementById("cell") });
</script></body></html>
"""


PLAYER = ("scene", "trials", "speed", "live", "was_live")
PANEL = ("title", "svg", "camera", "clock", "problem", "robots", "has_time")


def page_of(widget: Any, path: Path, width: int = 820, *, kind: str = "player") -> Path:
    """The page of a player or a panel, written to a file."""
    files = resources.files("realitygap.playback" if kind == "player" else "realitygap.classroom")
    module = (
        files.joinpath(f"{kind}.js")
        .read_text("utf-8")
        .replace("export default { render };", "const widget = { render };")
    )
    values = {name: getattr(widget, name) for name in (PLAYER if kind == "player" else PANEL)}
    path.write_text(PAGE % (widget._css, width, module, json.dumps(values, allow_nan=False)), "utf-8")
    return path
