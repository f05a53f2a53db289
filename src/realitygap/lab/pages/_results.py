"""Results of a study while they grow: finding, curves, path, conditions, and figures."""

from __future__ import annotations

from typing import Any
from urllib.parse import quote

from nicegui import events, ui

from realitygap._wording import Basis, counted, highest, highest_median, undecided_highest
from realitygap.lab._drawing import OF_ONE
from realitygap.lab._messages import Curve, Replay, ReplayRefused, SummaryRow
from realitygap.lab._standing import Standing
from realitygap.lab._studies import ConditionState
from realitygap.lab._watcher import PackedFigure, Watcher
from realitygap.stats import runs_for_a_claim

from ._elements import Curves, Generations, Player
from ._fields import Form
from ._frame import hint, section
from ._part import Part

GROWING = ("Running", "In use")
"""States in which runs are published."""
_BASIS = Basis("the report tries the best networks again")

_TITLES = {
    "scores": "Best score by generation",
    "coverage": "Coverage of every run",
    "paths": "Best path of each generation",
    "networks": "Networks",
    "species": "Species",
    "archive": "Archive of novelty search",
}
_CONDITION = """
<q-td :props="props">
  <q-btn flat dense no-caps align="left" class="lab-choose-row" :label="props.value"
         :aria-pressed="String(props.row.chosen)" @click.stop="$parent.$emit('choose', props.value)" />
  <span v-if="props.row.best" class="lab-best">{{ props.row.best }}</span>
</q-td>
"""
"""Name of a condition in the table: a press shows this condition in all figures."""
_ROW = "(event, row) => emit(row)"


class Results:
    """The results of a study, of which nothing moves when more appear.

    Args:
        standing: State of the study at first.
        watcher: Its figures.
        conditions: Names of its conditions.
    """

    def __init__(self, standing: Standing, watcher: Watcher, conditions: list[str]) -> None:
        self._standing, self._watcher, self._conditions = standing, watcher, conditions
        self._chosen = ""
        self._offered: dict[str, str] = {}
        self._shown_curves: list[Curve] | None = None
        self._shown_run: Replay | None = None

    def show(self) -> None:
        """Show them."""
        self._finding = Part(self._found, self._show_finding)
        self._finding.show()
        self._waiting = Part(self._waiting_for, self._show_waiting)
        self._waiting.show()
        with ui.row().classes("lab-row") as self._picking:
            self._picker = Form().choice("condition", "Condition", {}, None)
            self._picker.on_value_change(self._pick)
            self._all = ui.button("Compare all", on_click=lambda: self._choose("")).props("flat no-caps")
        with ui.element("div").classes("lab-panels-two") as self._panels:
            with ui.column().classes("lab-panel"):
                section("Best path")
                self._path = Part(self._typical, self._show_path)
                self._path.show()
            with ui.column().classes("lab-panel") as self._curves_box:
                section("Best coverage by generation")
                self._curves = Curves([], "Median best coverage by generation, one line per condition")
            with ui.column().classes("lab-panel") as self._evolution_box:
                section("Evolution")
                self._evolution = Generations()
                self._evolved = hint("")
            self._table_box = ui.column().classes("lab-panel")
        self._table: ui.table | None = None
        self._gallery = ui.column().classes("lab-cards")
        self._images: dict[str, _Image] = {}
        self._renew()

    def put(self, standing: Standing) -> None:
        """Show what has changed since."""
        self._standing = standing
        self._renew()

    def _rows(self) -> list[_Row]:
        """Conditions with known coverage, the highest median first."""
        known = [
            _Row(row, median) for row in self._watcher.rows if (median := row["line_median"]) is not None
        ]
        return sorted(known, key=lambda row: -row.median)

    def _found(self) -> str:
        """The finding; empty as long as there is none."""
        rows, state = {row.condition: row for row in self._rows()}, self._standing.state
        leaders = highest({name: row.median for name, row in rows.items()})
        if not leaders:
            return ""
        score = "best coverage" + (" so far" if state.n_runs > state.n_done else "")
        needed = runs_for_a_claim(len(rows) - 1, paired=True)
        if len(rows) > 1 and min(row.n for row in rows.values()) < needed:
            medians = [row.median for row in rows.values()]
            return _BASIS.claim(
                undecided_highest(f"median {score}", medians, _about(list(rows.values())), needed)
            )
        of_leaders = [rows[name] for name in leaders]
        estimates = [row.estimate for row in of_leaders[:2]]
        claim = highest_median(leaders, estimates, score, n_conditions=len(rows))
        return _BASIS.claim(f"{claim} ({_about(of_leaders)})")

    def _show_finding(self, finding: str) -> None:
        if finding:
            ui.label(finding).classes("lab-finding")

    def _waiting_for(self) -> str | None:
        """Why there are no figures; None once there are some."""
        if self._watcher.curves or self._drawn():
            return None
        n = self._standing.state.n_all_done
        return f"Drawing figures for {counted(n, 'run')}…" if n else ""

    def _drawn(self) -> list[str]:
        """Names of the figures that can be shown."""
        return [name for name, figure in list(self._watcher.figures.items()) if "text" not in figure]

    def _show_waiting(self, reason: str | None) -> None:
        if reason:
            ui.label(reason).props('role="status"')
            ui.skeleton().classes("lab-skeleton")
        elif reason is not None:
            ui.label("No runs yet. Figures appear when the first run finishes.")

    def _renew(self) -> None:
        """Update the figures, and add new ones below those on the page; nothing else moves."""
        watcher = self._watcher
        for part in (self._waiting, self._finding):
            part.look()
        self._renew_picker()
        self._renew_panels()
        condition, rows = self._condition(), self._rows()
        if rows and condition != rows[0].condition and self._standing.word not in GROWING:
            watcher.want_figures_of(condition)
        shown = {}
        for name in self._drawn():
            kind, _, of = name.partition("-")
            if kind not in OF_ONE or of == condition:
                shown[kind if kind in OF_ONE else name] = name
        for key, name in shown.items():
            if key not in self._images:
                with self._gallery:
                    self._images[key] = _Image(_TITLES[key.partition("-")[0]])
            self._images[key].load(self._standing.state.name, name, watcher.figures[name])
        for key, image in self._images.items():
            image.box.set_visibility(key in shown)

    def _renew_picker(self) -> None:
        """Offer the conditions, the best one first."""
        known = [row.condition for row in self._rows()]
        offered = {name: name for name in (*known, *(each for each in self._conditions if each not in known))}
        if len(known) > 1:
            offered[known[0]] += f" ({self._best})"
        if offered != self._offered or self._picker.value != self._condition():
            self._offered = offered
            self._picker.set_options(offered, value=self._condition())
        self._picking.set_visibility(len(offered) > 1 and bool(known))
        self._all.set_visibility(bool(self._chosen))

    @property
    def _best(self) -> str:
        """The mark of the condition with the highest median."""
        return "best so far" if self._standing.state.share < 1 else "best"

    def _condition(self) -> str:
        """The condition of all figures that show one: the best one unless the visitor has chosen another."""
        rows = self._rows()
        return self._chosen or next(iter([row.condition for row in rows] or self._conditions), "")

    def _renew_panels(self) -> None:
        """Update the two panels and the table of conditions."""
        curves = self._watcher.curves
        self._panels.set_visibility(bool(curves) or bool(self._drawn()))
        self._curves_box.set_visibility(bool(curves))
        if curves and curves is not self._shown_curves:
            self._shown_curves = curves
            self._curves.put(curves)
        self._path.look()
        self._renew_evolution()
        if self._rows():
            self._renew_table()

    def _renew_evolution(self) -> None:
        """Show the paths of a run by generation: of the last published run while the study runs."""
        condition, is_known, _ = self._typical()
        is_last = self._standing.word in GROWING
        replay = self._watcher.generations(condition, is_last=is_last) if is_known else None
        if isinstance(replay, Replay) and replay is not self._shown_run:
            self._shown_run = replay
            self._evolution.put(replay)
            which = "the last published run" if is_last else "the typical run"
            self._evolved.text = f"{replay.scene['title']}, {which}. The thick line is the best path."
        self._evolution_box.set_visibility(self._shown_run is not None)

    def _renew_table(self) -> None:
        known, state = {row.condition: row for row in self._rows()}, self._standing.state
        names = [*known, *(each.name for each in state.conditions if each.name not in known)]
        conditions = sorted(state.conditions, key=lambda each: names.index(each.name))
        rows = [
            {
                "condition": each.name,
                "state": _word(each, is_growing=self._standing.word in GROWING),
                "n": f"{each.n_done:,}/{each.n_runs:,}" if each.n_done < each.n_runs else f"{each.n_runs:,}",
                "median": known[each.name].estimate if each.name in known else "",
                "label": known[each.name].label if each.name in known else each.label,
                "chosen": each.name == self._chosen,
                "best": self._best if each.name == names[0] and len(known) > 1 else "",
            }
            for each in conditions
        ]
        if self._table is None:
            with self._table_box:
                section("Conditions")
                self._table = self._make_table()
                hint(
                    "Choose a condition to show it in all figures. Best coverage of a run, along the robot's path. "
                    "Brackets: 95 % interval of the median."
                )
                self._drawn_of = hint("")
        if self._table.rows != rows:
            self._table.rows = rows
        n_drawn, n_done = sum(row.n for row in known.values()), state.n_all_done
        self._drawn_of.text = (
            f"Medians and figures use the first {n_drawn:,} of {counted(n_done, 'run')}. They are drawn again "
            "as runs finish."
            if n_drawn < n_done and state.share < 1
            else ""
        )

    def _make_table(self) -> ui.table:
        columns = [
            {"name": key, "label": label, "field": key, "align": align, "sortable": True}
            for key, label, align in (
                ("condition", "Condition", "left"),
                ("state", "State", "left"),
                ("n", "Runs", "right"),
                ("median", "Median best coverage", "left"),
                ("label", "Label", "left"),
            )
        ]
        table = ui.table(rows=[], columns=columns, row_key="condition").classes("lab-table lab-choosable")
        table.props("flat bordered dense wrap-cells")
        table.props[":table-row-class-fn"] = "(row) => row.chosen ? 'lab-chosen' : ''"
        table.add_slot("body-cell-condition", _CONDITION)
        table.on("choose", lambda event: self._toggle(event.args))
        table.on("rowClick", lambda event: self._toggle(event.args["condition"]), js_handler=_ROW)
        return table

    def _choose(self, condition: object) -> None:
        """Show one condition in all figures; an empty one compares all, and shows the best where one is shown."""
        self._chosen = str(condition) if condition in self._conditions else ""
        self._curves.choose(self._chosen)
        self._renew()

    def _toggle(self, condition: object) -> None:
        self._choose("" if condition == self._chosen else condition)

    def _pick(self, event: events.ValueChangeEventArguments[Any]) -> None:
        if event.value != self._condition():  # otherwise the picker has followed
            self._choose(event.value)

    def _typical(self) -> tuple[str, bool, Replay | ReplayRefused | None]:
        """Condition of the path that is shown, whether there is one, and its replay; None while it is computed."""
        condition, standing = self._condition(), self._standing
        if not self._rows() and not self._drawn():
            return "", False, None
        done = 0 if standing.word in GROWING else standing.state.n_all_done
        return condition, True, self._watcher.typical(condition, done)

    def _show_path(self, typical: tuple[str, bool, Replay | ReplayRefused | None]) -> None:
        condition, is_known, replay = typical
        if not is_known:
            return
        if replay is None:
            ui.label("Computing the path…").props('role="status"')
            ui.skeleton().classes("lab-skeleton")
        elif isinstance(replay, ReplayRefused):
            ui.label(replay.text).classes("lab-problem")
        else:
            Player(replay.scene, replay.trials)
            hint(f"Best trial of the typical run of {condition}: the run with the median best coverage.")


class _Image:
    """The place of a figure in its two widths, with its caption."""

    def __init__(self, title: str) -> None:
        self._version = 0
        with ui.column().classes("lab-cards") as self.box:
            section(title)
            with ui.element("picture").classes("lab-figure"):
                self._narrow = ui.element("source").props('media="(max-width: 700px)"')
                self._wide = ui.element("img")
            self._caption = hint("")

    def load(self, study: str, name: str, figure: PackedFigure) -> None:
        """Load this drawing, unless it is shown already."""
        if figure["version"] == self._version:
            return
        self._version = version = figure["version"]
        address = f"/figures/{study}/{quote(name)}"
        self._narrow.props["srcset"] = f"{address}-narrow.svg?v={version}"
        self._wide.props["src"] = f"{address}-wide.svg?v={version}"
        self._wide.props["alt"], self._caption.text = figure["alt"], figure["caption"]


def _word(condition: ConditionState, *, is_growing: bool) -> str:
    """Return the state of a condition in a word, as studies have them."""
    if condition.n_done == condition.n_runs:
        return "Complete"
    if not condition.n_done:
        return "Waiting" if is_growing else "Not started"
    return "Running" if is_growing else "Paused"


class _Row:
    """A condition with known coverage."""

    def __init__(self, row: SummaryRow, median: float) -> None:
        self.condition, self.label, self.n, self.median = row["condition"], row["label"], row["n"], median
        self.estimate = f"{median:.3f}"
        """The median with its interval, if there are enough runs for one."""
        if (low := row["line_low"]) is not None and (high := row["line_high"]) is not None:
            self.estimate += f" [{low:.3f}, {high:.3f}]"


def _about(rows: list[_Row]) -> str:
    """Return the labels of conditions, and the number of their runs."""
    labels = " and ".join(dict.fromkeys(row.label for row in rows))
    return f"{labels}, {counted(max(row.n for row in rows), 'run')}{' each' if len(rows) > 1 else ''}"
