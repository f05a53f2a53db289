"""The class: the page of a student, which needs no token, and the board with which the lecturer leads the class."""

from __future__ import annotations

import asyncio
import contextlib
import html
import io
import math
import time
from importlib import resources
from typing import Any, NamedTuple

import numpy as np
import segno
from nicegui import app, ui
from starlette.responses import Response
from starlette.websockets import WebSocket, WebSocketDisconnect

from realitygap._limits import parse_json
from realitygap._wording import counted
from realitygap.errors import StudyError
from realitygap.lab._access import CLASS_SOCKET, VISITOR
from realitygap.lab._class import PERIOD_S, Classroom, Student, Word
from realitygap.lab._class_evolution import NAME, Evolved, begin_evolution, evolved_controller
from realitygap.lab._class_results import Drive
from realitygap.lab._class_turns import Turns
from realitygap.lab._lab import Lab
from realitygap.platforms import platform_class
from realitygap.playback import MovingTrial, RobotShape, pack_scene, pack_trials
from realitygap.robot_families import default_family

from ._frame import framed, hint, section
from ._notices import try_now
from ._part import Part

_VIOLATION = 1008
_LONGEST = 500
"""Largest length of a message of a student's page [letters]."""
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; connect-src 'self' ws: wss:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_OWN_ROBOT = "You get an emulated robot of your own."
_FILES = resources.files(__package__)


def add_class(lab: Lab) -> None:
    """Add the pages of the class, if the lab has one."""
    room = lab.classroom
    if room is None:
        return
    page = _Class(lab, room)
    app.on_startup(page.connect)
    app.on_startup(page.keep)
    app.on_startup(page.evolve)
    page_html = (_FILES / "classroom" / "class.html").read_text("utf-8")
    if isinstance(room, Turns):
        page_html = page_html.replace(_OWN_ROBOT, "You drive a robot in turns.")
    for name in ("class.js", "class.css"):
        app.add_static_file(local_file=str(_FILES / "classroom" / name), url_path=f"/class/{name}")
    app.add_static_file(local_file=str(_FILES / "drive_pad.js"), url_path="/class/drive_pad.js")

    @app.get("/class")
    def student() -> Response:
        return Response(page_html, headers={"content-security-policy": _POLICY}, media_type="text/html")

    app.add_api_websocket_route(CLASS_SOCKET, page.serve)

    @ui.page("/class/board")
    def board() -> None:
        ui.add_head_html('<link rel="stylesheet" href="/class/class.css">')
        with framed(lab, "Class", "/class/board", is_wide=True):
            _Board(page).show()


class _Class:
    """Serves the pages of a class."""

    def __init__(self, lab: Lab, room: Classroom) -> None:
        self.lab, self.room = lab, room
        self.evolved: Evolved | None = None
        self.problem = ""
        self._shape = RobotShape.of(platform_class(default_family().name)())

    async def connect(self) -> None:
        """Connect the robot that the students drive in turns, if there is one."""
        if isinstance(self.room, Turns):
            with contextlib.suppress(StudyError):  # the board shows why
                await asyncio.to_thread(self.room.shared.connect)

    async def keep(self) -> None:
        """Move the robots."""
        while True:
            began = time.monotonic()
            await self.room.step()
            await asyncio.sleep(max(0.005, PERIOD_S - (time.monotonic() - began)))

    async def evolve(self) -> None:
        """Evolve the controller that the class tries to beat."""
        try:
            await asyncio.to_thread(begin_evolution, self.lab)
            while await asyncio.to_thread(lambda: self.lab.standing(NAME).word) != "Complete":
                await asyncio.sleep(1.0)
            self.evolved = await asyncio.to_thread(evolved_controller, self.lab.studies.path(NAME))
        except Exception as error:  # the class goes on without it
            self.problem = f"Evolution failed: {error}"

    async def serve(self, socket: WebSocket) -> None:
        """Serve the websocket of a student's page."""
        await socket.accept()
        try:
            if not (key := socket.cookies.get(VISITOR, "")):
                raise StudyError("This page needs cookies. Allow them, and load the page again.")
            student, news = self.room.enter(key)
        except StudyError as error:
            await socket.send_json({"kind": "full", "text": str(error)})
            await socket.close(_VIOLATION)
            return
        telling = asyncio.create_task(self._tell(socket, student, news))
        with contextlib.suppress(
            WebSocketDisconnect, ValueError, KeyError
        ):  # the page leaves or sends something else
            while self.room.hear(
                student, Word.model_validate(parse_json(await socket.receive_text(), most=_LONGEST))
            ):
                pass
        telling.cancel()
        self.room.leave(student, news)
        await asyncio.gather(telling, return_exceptions=True)
        with contextlib.suppress(RuntimeError, WebSocketDisconnect):  # the page has left
            await socket.close(_VIOLATION)

    async def _tell(self, socket: WebSocket, student: Student, news: asyncio.Event) -> None:
        """Send a page what is new, as fast as it takes it."""
        room = self.room
        told: dict[str, Any] = {}
        sent: dict[str, Any] = {}
        n_starts = n_points = n_cells = 0
        while True:
            await news.wait()
            news.clear()
            if (state := self._state(student)) != told:
                is_same, told = state["compares"] == told.get("compares"), state
                await socket.send_json(
                    state if is_same else state | self._stage(student, compares=state["compares"])
                )
                n_starts = n_starts if is_same else 0
            if (robot := student.robot) is None:
                continue
            if begins := robot.n_starts != n_starts:
                n_starts, n_points, n_cells = robot.n_starts, 0, 0
            path, cells = robot.path, robot.cells
            now = {
                "pose": [round(part, 4) for part in path[-1]],
                "stalled": robot.is_blocked,
                "left": math.ceil(room.seconds_left(student)),
                "n_cells": room.n_cells(student) if room.is_observed else None,
                "heard": student.n_heard,
                "stops": student.n_stops,
            }
            if now != sent or begins:
                sent = now
                trail = [[round(pose.x, 4), round(pose.y, 4)] for pose in path[n_points:-1]]
                more = {
                    "kind": "now",
                    "begins": begins,
                    "trail": trail,
                    "cells": cells[n_cells:],
                    "lasts": PERIOD_S,
                }
                n_points, n_cells = len(path) - 1, len(cells)
                await socket.send_json(now | more)

    def _state(self, student: Student) -> dict[str, Any]:
        room, drive, board = self.room, self.room.drive_of(student), self.room.drives()
        evolved = self.evolved if room.shows_evolution else None
        phase: str = "practice" if drive is None else room.phase
        if drive is not None and drive.is_over:  # others may be driving
            phase = "over" if drive.seconds >= room.round_s else "cut"
        return {
            "kind": "class",
            "phase": phase,
            "name": student.name,
            "place": 0 if drive is None else 1 + sum(each.n_cells > drive.n_cells for each in board),
            "n": len(board),
            "may_drive": room.may_drive(student),
            "words": room.words_for(student),
            "watches": isinstance(room, Turns) and not room.may_drive(student),
            "is_observed": room.is_observed,
            "evolution": "" if evolved is None else counted(int(np.median(evolved.cells)), "cell"),
            "compares": evolved is not None and drive is not None and drive.is_over,
        }

    def _stage(self, student: Student, *, compares: bool) -> dict[str, Any]:
        """Return what the player of a page shows: the robot, or the student's drive next to that of evolution."""
        drive = self.room.drive_of(student)
        path = drive.path if compares and drive and drive.path else [list(self.room.arena.start)]
        poses, rays = np.array(path), np.full((len(path), len(self._shape.mounts)), np.nan)
        stalled = np.zeros(len(path), np.bool_)
        title = f"You, {counted(drive.n_cells, 'cell')}" if drive else ""
        own = MovingTrial.of_rows(
            title, self.room.label, self.room.arena, self._shape, PERIOD_S, poses, rays, stalled
        )
        if compares and self.evolved:
            trials = [own, self.evolved.trial] if drive and drive.path else [self.evolved.trial]
        else:
            trials = [own]
        return {"scene": pack_scene(self.room.arena, ""), "trials": pack_trials(trials), "live": not compares}


class _Row(NamedTuple):
    name: str
    cells: int
    label: str = "EMULATED"
    note: str = ""


class _Board:
    """The page of the lecturer, for the projector."""

    def __init__(self, page: _Class) -> None:
        self._page, self._room = page, page.room

    def show(self) -> None:
        """Show the code, the buttons, and the board."""
        room = self._room
        with ui.element("div").classes("class-board"):
            with ui.column().classes("lab-cards"):
                ui.html(_code(room.address), sanitize=False).classes("class-code")
                ui.label(room.address.partition("://")[2]).classes("class-address")
                self._controls = Part(self._state, self._show_controls)
                self._controls.show()
                self._counting = Part(self._uncounted, self._show_count)
                self._counting.show()
                self._removing = Part(self._names, self._show_names)
                self._removing.show()
            with ui.column().classes("lab-cards"):
                self._title = section("").classes("class-heading")
                self._results = ui.html("", sanitize=False)
                join = "Scan the code and enter a name."
                if not isinstance(room, Turns):
                    join = "Scan the code, enter a name, and practice."
                self._empty = hint(f"{join} Results appear when a round starts.")
        self._look()
        ui.timer(0.25, self._look)

    def _look(self) -> None:
        self._controls.look()
        self._counting.look()
        self._removing.look()
        self._title.text, self._results.content = self._heading(), self._list()
        self._empty.set_visibility(not self._room.drives())

    def _state(self) -> tuple[Any, ...]:
        room = self._room
        n_joined = sum(bool(student.name) for student in room.students.values())
        return (
            room.phase,
            room.round,
            n_joined,
            room.shows_evolution,
            self._page.evolved is not None,
            self._problem,
            self._turns(),
        )

    def _turns(self) -> tuple[Any, ...]:
        """Return a value that changes with what the buttons of the turns show."""
        room = self._room
        if not isinstance(room, Turns):
            return ()
        names = tuple(student.name for student in room.queue)
        return (
            room.driver and room.driver.name,
            names,
            room.shared.problem,
        )

    def _uncounted(self) -> Drive | None:
        return self._room.uncounted if isinstance(self._room, Turns) else None

    @property
    def _problem(self) -> str:
        return self._room.problem or self._page.problem

    def _show_controls(self, _state: tuple[Any, ...]) -> None:
        room = self._room
        n_joined = sum(bool(student.name) for student in room.students.values())
        ui.label(f"{counted(n_joined, 'student')} joined").props('role="status"')
        with ui.row().classes("lab-row"):
            start = ui.button("Start round", on_click=lambda: try_now(room.start_round))
            start.props("unelevated no-caps").set_enabled(room.phase != "round")
            ui.button("Reset", on_click=room.reset).props("outline no-caps").set_enabled(
                room.phase != "practice"
            )
            words = "Hide evolution" if room.shows_evolution else "Show evolution"
            evolution = ui.button(words, on_click=self._toggle)
            evolution.props("outline no-caps").set_enabled(
                self._page.evolved is not None and room.phase == "over"
            )
        if why := _why_off(room):
            hint(why)
        if isinstance(room, Turns):
            self._show_turns(room)
        if self._problem:
            ui.label(self._problem).classes("lab-problem").props('role="alert"')
        elif self._page.evolved is None:
            hint("Evolution is running. Its result is ready in about ten seconds.")
        elif room.phase != "over":
            hint("The result of evolution is ready. You can show it after a round.")

    def _show_turns(self, room: Turns) -> None:
        """Show whose turn it is, and the buttons that start and end a turn."""
        if problem := room.shared.problem:
            ui.label(problem).classes("lab-problem lab-lines").props('role="status"')
            if not room.shared.has_process:
                ui.button("Connect robot", on_click=self._page.connect).props("outline no-caps")
        else:
            with ui.row().classes("lab-row"):
                ui.label(room.label).classes(f"lab-badge lab-label-{room.label.lower()}")
                ui.label("All students drive this robot, in turns.")
        if room.driver is not None:
            ui.label(f"{room.driver.name} is driving.").props('role="status"')
        elif room.queue:
            ui.label(f"Next: {room.queue[0].name}. Put the robot at its start.").props('role="status"')
        if room.driver is not None or room.queue:
            with ui.row().classes("lab-row"):
                if room.driver is None:
                    turn = ui.button("Start turn", on_click=lambda: try_now(room.start_turn))
                    turn.props("unelevated no-caps")
                words = "End turn" if room.driver is not None else f"Skip {room.queue[0].name}"
                ui.button(words, on_click=room.skip).props("outline no-caps")
        waiting = room.queue[room.driver is None :]
        if waiting:
            hint(f"Then: {', '.join(student.name for student in waiting)}")

    def _show_count(self, drive: Drive | None) -> None:
        """Ask for the cells of a drive that nobody observed."""
        room = self._room
        if drive is None or not isinstance(room, Turns):
            return
        with ui.row().classes("lab-row"):
            cells = ui.number(f"Cells of {drive.name}", min=0, max=room.arena.grid.n_cells, step=1)
            ui.button("Save cells", on_click=lambda: try_now(lambda: room.count(drive, cells.value))).props(
                "unelevated no-caps"
            )

    def _toggle(self) -> None:
        self._room.shows_evolution = not self._room.shows_evolution

    def _names(self) -> list[tuple[str, str]]:
        students = {key: student.name for key, student in self._room.students.items() if student.name}
        return [*({drive.student: drive.name for drive in self._room.drives()} | students).items()]

    def _show_names(self, names: list[tuple[str, str]]) -> None:
        with ui.expansion("Remove a name").classes("lab-expansion"), ui.row().classes("lab-row"):
            for key, name in names:
                ui.button(name, on_click=lambda key=key: self._room.remove(key)).props("outline no-caps")

    def _rows(self) -> list[_Row]:
        rows = [_Row(drive.name, drive.n_cells, drive.label) for drive in self._room.drives()]
        evolved = self._page.evolved
        if evolved is not None and self._room.shows_evolution:
            low, middle, high = np.percentile(evolved.cells, [0, 50, 100]).astype(int).tolist()
            note = f"median of {len(evolved.cells)} trials with fresh noise ({low} to {high})"
            rows.append(_Row("Evolution", middle, "SIM", note))
            rows.append(
                _Row("Evolution, your robot", evolved.emulated, "EMULATED", "the same network, one trial")
            )
        return sorted(rows, key=lambda row: -row.cells)

    def _heading(self) -> str:
        room = self._room
        drives = room.drives()
        rests = [room.rest_of(drive) for drive in drives if not drive.is_over]
        if isinstance(room, Turns) and room.phase == "round":
            driver = room.driver
            turn = "no student is driving" if driver is None else f"{driver.name} is driving, "
            left = "" if driver is None else f"{math.ceil(room.seconds_left(driver))} s left"
            return f"Round {room.round}: {turn}{left}"
        left = f"{math.ceil(min(rests, default=0.0))} s left"  # of those who began first
        if 0 < len(rests) < len(drives):
            left = f"{counted(len(rests), 'student')} still driving, {left}"
        number = f"Round {room.round}"
        words = {
            "practice": "Practice",
            "round": f"{number}: {left}",
            "over": f"{number}: results",
        }
        return words[room.phase]

    def _list(self) -> str:
        """Return the rows as one piece of HTML, because an element for each part would keep the server busy."""
        n_cells = self._room.arena.grid.n_cells
        rows = self._rows()
        counts = [row.cells for row in rows]  # best first; equal results have the same place
        items = [
            f'<li class="{"class-evolved" if row.note else ""}"><span>{1 + counts.index(row.cells)}.</span>'
            f"<span>{html.escape(row.name)}</span>"
            f'<span><i class="class-bar" style="width:{100 * row.cells / n_cells:.1f}%"></i>{row.note}</span>'
            f'<b>{row.cells}</b><span class="lab-badge lab-label-{row.label.lower()}">{row.label}</span></li>'
            for row in rows
        ]
        return f'<ol class="class-rows">{"".join(items)}</ol>'


def _why_off(room: Classroom) -> str:
    """Return why one of the buttons of the round is off."""
    return {
        "practice": "Reset is off: no round has started.",
        "round": "Start round is off: a round is running. Wait for its end, or press Reset.",
        "over": "",
    }[room.phase]


def _code(address: str) -> str:
    """Return the QR code of an address as SVG."""
    drawn = io.BytesIO()
    segno.make(address, error="m").save(
        drawn, kind="svg", border=2, scale=8, xmldecl=False, svgns=True, omitsize=True
    )
    return drawn.getvalue().decode()
