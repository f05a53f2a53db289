"""How fast we are beside our peers: the measured figures, and the tables, of the page "Speed".

    uv run python docs/make_speed.py            # on an idle machine; takes some minutes

Carries out `benchmarks/peers.py` and writes docs/data/speed.json. The page's tables are worked out from that file
when the documents are built.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from realitygap._wording import significant

HERE = Path(__file__).parent
DATA = HERE / "data" / "speed.json"
BENCHMARK = HERE.parent / "benchmarks" / "peers.py"
TITLES = {
    "ours": "realitygap",
    "jyro": "Jyro",
    "enki": "Enki",
    "irsim": "IR-SIM",
    "kheperax": "Kheperax",
    "neat_python": "neat-python",
    "multineat": "MultiNEAT",
}
# Title and unit of each figure, in the order of the table.
FIGURES = {
    "steps_core": ("robot-steps a second, one core", "/s"),
    "steps_all": ("robot-steps a second, all cores", "/s"),
    "realism_avoiding": (
        "robot-steps a second with outline, contact and noise: avoiding walls, one core",
        "/s",
    ),
    "realism_pressed": (
        "robot-steps a second with outline, contact and noise: pressed into walls, one core",
        "/s",
    ),
    "realism_boxes": (
        "robot-steps a second with outline, contact and noise: avoiding walls and two boxes, one core",
        "/s",
    ),
    "run_us": ("a NEAT run: 8 individuals, 5 generations, trivial fitness", "µs"),
    "xor_ms": ("XOR: a generation of 150, with evaluation", "ms"),
    "large_ms": ("reproduction and speciation of 10,000", "ms"),
    "pass_us": ("a pass of one network, 3 inputs and 2 outputs", "µs"),
}
TRIALS_PER_RUN = 8 * 5
STEPS_PER_TRIAL = 87


def page_parts() -> dict[str, str]:
    """The generated parts of the page, by file."""
    measured = json.loads(DATA.read_text("utf-8"))
    return {
        "parts/speed-ahead.md": ahead_text(measured["figures"]),
        "parts/speed-peers.md": peers_table(measured),
        "parts/speed-machine.md": machine_text(measured),
        "parts/speed-realism.md": realism_table(measured["figures"]),
        "parts/speed-run.md": run_table(measured["engine"]),
        "parts/speed-step.md": step_table(measured),
        "parts/speed-variants.md": variants_table(measured["engine"]["variants"]),
    }


def ahead_text(figures: Mapping[str, Any]) -> str:
    """The figures in which a peer is faster, as a list, or one sentence if there is none."""
    lines = [
        f"* {TITLES[peer]} is {digits(1 / answer['ratio'])} times as fast as realitygap: {title}."
        for name, (title, _) in FIGURES.items()
        for peer, answer in figures[name].items()
        if answer.get("ratio", 1.0) < 1.0
    ]
    if not lines:
        return "No peer is faster than realitygap in any figure that both were measured in.\n"
    return "Some peers are faster than realitygap:\n\n" + "\n".join(lines) + "\n"


def realism_table(figures: Mapping[str, Any]) -> str:
    """Our robot-steps with contact and noise, one core."""
    rows = [
        (title, _measured(figures[name]["ours"], unit))
        for name, (title, unit) in FIGURES.items()
        if name.startswith("realism_")
    ]
    return _table(["figure", "realitygap"], rows)


def peers_table(measured: Mapping[str, Any]) -> str:
    """One row for each figure and peer, the ratio first."""
    return _table(["times faster", "figure", "than", "theirs", "ours"], list(_peer_rows(measured["figures"])))


def _peer_rows(figures: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    for name, (title, unit) in FIGURES.items():
        answers = figures[name]
        own = _measured(answers["ours"], unit)
        for peer, answer in answers.items():
            if peer == "ours":
                continue
            ratio = f"**{digits(answer['ratio'])}**" if "ratio" in answer else "–"
            yield ratio, title, TITLES[peer], _measured(answer, unit), own
        if "side_by_side" in answers["ours"]:
            side = answers["ours"]["side_by_side"]
            for peer, answer in answers.items():
                if peer != "ours" and "median" in answer:
                    ratio = f"**{digits(answer['median'] / side)}**"
                    yield (
                        ratio,
                        "the same, one of many networks side by side",
                        TITLES[peer],
                        _measured(answer, unit),
                        f"{digits(side)} {unit}",
                    )


def _measured(answer: Mapping[str, Any], unit: str) -> str:
    if "not_measured" in answer:
        return "not measured: " + answer["not_measured"].splitlines()[0].replace("|", "\\|")
    unit = unit if unit.startswith("/") else f" {unit}"
    return f"{digits(answer['median'])}{unit} ({digits(answer['low'])} to {digits(answer['high'])})"


def machine_text(measured: Mapping[str, Any]) -> str:
    """Machine, load and versions, in one paragraph each."""
    about = measured["machine"]
    loads = [f"{each:.1f}" for each in measured["load"] if each is not None]
    load = f" Processes that wanted a core, before and at the end: {' and '.join(loads)}." if loads else ""
    lines = [f"{about['cpu']}, {about['cores']} cores, {about['system']}.{load}"]
    for name, versions in measured["versions"].items():
        told = ", ".join(f"{package} {number}" for package, number in versions.items())
        lines.append(f"* {TITLES[name]}: {told}")
    return lines[0] + "\n\n" + "\n".join(lines[1:]) + "\n"


def run_table(engine: Mapping[str, Any]) -> str:
    """Where the time of one run of the paper goes, one core, from the rates of `realitygap bench`."""
    trials = TRIALS_PER_RUN * STEPS_PER_TRIAL / engine["robot_steps_per_second"]["per_core"]
    whole = 1 / engine["paper_runs_per_second"]["per_core"]
    recorded = 1 / engine["paper_runs_recorded_per_second"]["per_core"]
    parts = {
        "40 trials of 87 steps": trials,
        "NEAT, decoding, scoring, copying": whole - trials,
        "making and writing the rows": recorded - whole,
    }
    rows = [
        (what, f"{1e6 * part:,.0f} µs", f"{100 * part / recorded:.0f} %")
        if part > 0
        else (what, "lost in the noise of a busy machine", "–")
        for what, part in parts.items()
    ]
    return _table(["part of a run of the paper", "time", "share"], rows)


def step_table(measured: Mapping[str, Any]) -> str:
    """Where the time of one robot-step goes, as far as its parts can be timed alone."""
    step = 1e9 / measured["engine"]["variants"]["as it is"]
    draw = measured["engine"]["draw_ns"]
    network = 1e3 * measured["figures"]["pass_us"]["ours"]["side_by_side"]
    parts = {
        "random numbers": draw,
        "the network": network,
        "rays, motion, collisions and the line": step - draw - network,
    }
    rows = [(what, f"{part:.1f} ns", f"{100 * part / step:.0f} %") for what, part in parts.items()]
    return _table(["part of a robot-step", "time", "share"], rows)


def variants_table(variants: Mapping[str, float]) -> str:
    """Time of a robot-step, as it is and with one thing changed."""
    usual = variants["as it is"]
    rows = [(name, f"{1e9 / rate:.1f} ns", f"{usual / rate:.2f}") for name, rate in variants.items()]
    return _table(["trial", "a robot-step", "times as long"], rows)


def digits(value: float) -> str:
    """A number with three digits that count."""
    rounded = float(f"{value:.3g}")
    return f"{rounded / 1e6:.3g} million" if rounded >= 1e6 else significant(value, 3)


def _table(head: list[str], rows: list[tuple[str, ...]]) -> str:
    lines = [tuple(head), ("---",) * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def main() -> None:
    """Measure and write."""
    done = subprocess.run(
        [sys.executable, str(BENCHMARK), "--json"], stdout=subprocess.PIPE, text=True, check=True
    )
    measured = json.loads(done.stdout)
    page = DATA.with_suffix(".new")
    page.write_text(json.dumps(measured, indent=2) + "\n", "utf-8")
    page.replace(DATA)
    print(f"Written: {DATA}")


if __name__ == "__main__":
    main()
