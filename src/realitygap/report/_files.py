"""Results for other programs: an individual in several formats, and species, innovations, or lineage as Parquet."""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TypedDict

from realitygap._version import __version__
from realitygap.errors import did_you_mean, from_extra
from realitygap.evolution import Genome, interface_to_dict, to_c, to_networkx, to_onnx, to_text
from realitygap.records import DerivedFrame, RecordWarning, ResultsFolder, refuse_results, write_whole
from realitygap.report._tally import read_tally
from realitygap.report._trial_figure import ChosenTrial, choose_trial
from realitygap.robot_families import NetworkProgram, load, network_programs
from realitygap.runs import genome_of


class Origin(TypedDict):
    """The origin of an exported network."""

    study: str
    condition: str
    replicate: int
    generation: int
    individual: int
    label: str
    fitness: float
    coverage_line: float | None
    coverage_ends: float | None
    results_version: int
    software: str


def export_individual(
    folder: ResultsFolder | str | Path,
    out: str | Path,
    *,
    format: str | None = None,
    condition: str | None = None,
    replicate: int | None = None,
    generation: int | None = None,
    individual: int | None = None,
) -> Path:
    """Write an individual of a study to a file: the one whose network `save_view` draws for the same arguments.

    * json: the genome with a version; `Genome.load` reads it.
    * onnx: the network, as `to_onnx` makes it, in double precision.
    * graphml: the genome as a graph, as `to_networkx` makes it.
    * c: the network as a header of C99, as `to_c` makes it, in double precision; files end in .c or .h.
    * A family of robots can add formats: the network as a program that its robots run without a computer, such as
      aseba, whose files end in .aesl. A command lasts as long as on the platform of the condition.

    Each has the names of inputs and outputs, and says which individual it is.

    Args:
        folder: Results of a study, or the path to them. None of its files is ever replaced.
        out: File. An existing one is replaced once the new one is complete.
        format: Format of the file. Default: by the ending of `out`.
        condition: Condition. Default: the first one.
        replicate: Run. Default: the typical one.
        generation: Generation of the run. Default: the last one.
        individual: Individual of the generation. Default: the best one by the task.

    Returns:
        The path of the file.

    Raises:
        MissingExtraError: the extra `export` is not installed; the others need none.
        RecordError: there is no such folder, a file in it is damaged, it holds no trials yet, its settings are another
            version's, or the file is one of a study's own or cannot be written.
        TypeError: the number of a run, generation or individual is not a whole number.
        ControllerError: the robots of a program lack an input of the network.
        ValueError: the network is too large for a program; or there is no such condition, run, generation, individual
            or format, and the message says which there are.
    """
    out = Path(out)
    write = _writer(out, format)
    refuse_results(out)
    with warnings.catch_warnings():
        if not isinstance(folder, ResultsFolder):
            warnings.simplefilter("default", RecordWarning)
        tally = read_tally(folder)
    chosen = choose_trial(tally, condition, replicate, generation, individual, of_last=True)
    origin: Origin = {
        "study": str(tally.description.get("name", "")),
        "condition": chosen.row["condition"],
        "replicate": chosen.row["replicate"],
        "generation": chosen.row["generation"],
        "individual": chosen.row["individual"],
        "label": chosen.label,
        "fitness": chosen.row["fitness"],
        "coverage_line": chosen.row["coverage_line"],
        "coverage_ends": chosen.row["coverage_ends"],
        "results_version": tally.folder.results_version,
        "software": __version__,
    }
    write_whole(out, write(chosen, genome_of(chosen.condition, chosen.row), origin))
    return out


def _writer(out: Path, format: str | None) -> Callable[[ChosenTrial, Genome, Origin], bytes]:
    writers: dict[str, Callable[[ChosenTrial, Genome, Origin], bytes]] = {
        "json": _json,
        "onnx": _onnx,
        "graphml": _graphml,
        "c": _c,
        "h": _c,
    }
    programs = network_programs()
    for name, program in programs.items():
        writers |= dict.fromkeys((name, program.ending), partial(_program, program))
    word = out.suffix.lower().removeprefix(".") if format is None else format
    if word not in writers:
        what = f"{out} ends in {out.suffix or 'nothing'}" if format is None else f"Unknown format {format!r}"
        near = did_you_mean(word, writers)
        *others, last = ("json", "onnx", "graphml", "c", *programs)
        raise ValueError(
            f"{what}, expected {', '.join(others)} or {last}.{f' {near}' if near.startswith('Did') else ''}"
        )
    return writers[word]


def _names(chosen: ChosenTrial) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names of all inputs, including the constant one, and of all outputs."""
    return chosen.condition.network_inputs, chosen.condition.output_names


def _json(chosen: ChosenTrial, genome: Genome, origin: Origin) -> bytes:
    values = genome.to_dict() | interface_to_dict(genome.interface) | {"origin": origin}
    return to_text(values).encode("utf-8")


def _onnx(chosen: ChosenTrial, genome: Genome, origin: Origin) -> bytes:
    inputs, outputs = _names(chosen)
    network = genome.network()
    model = to_onnx(network, inputs[: network.n_inputs], outputs)
    for key, value in origin.items():
        model.metadata_props.add(key=key, value=str(value))
    data: bytes = model.SerializeToString()
    return data


def _c(chosen: ChosenTrial, genome: Genome, origin: Origin) -> bytes:
    inputs, outputs = _names(chosen)
    network = genome.network()
    return to_c(network, inputs[: network.n_inputs], outputs, origin=origin).encode("ascii")


def _program(program: NetworkProgram, chosen: ChosenTrial, genome: Genome, origin: Origin) -> bytes:
    platform = chosen.condition.on
    text: str = load(program.write)(
        genome.network(), genome.interface, steps=platform.steps, step_s=platform.command_s, origin=origin
    )
    return text.encode("ascii")


def _graphml(chosen: ChosenTrial, genome: Genome, origin: Origin) -> bytes:
    graph = to_networkx(genome, *_names(chosen))
    graph.graph |= origin
    buffer = io.BytesIO()
    from_extra("networkx", "export").write_graphml(graph, buffer)
    return buffer.getvalue()


def export_frame(
    folder: ResultsFolder | str | Path,
    what: DerivedFrame,
    out: str | Path,
    *,
    condition: str | None = None,
    replicate: int | None = None,
) -> Path:
    """Write species, innovations or lineage of a study's runs to a Parquet file.

    Args:
        folder: Results of a study, or the path to them. None of its files is ever replaced.
        what: species (a row is one species in one generation), innovations (one innovation number in one run) or
            lineage (one individual).
        out: File, ending in .parquet. An existing one is replaced once the new one is complete.
        condition: Condition. Default: all.
        replicate: Replicate of each condition. Default: all.

    Returns:
        The path of the file.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, or the file is one of a study's own or
            cannot be written.
        TypeError: the number of the run is not a whole number.
        ValueError: there is no such condition, run, frame or ending.
    """
    out = Path(out)
    if out.suffix.lower() != ".parquet":
        raise ValueError(f"{out} ends in {out.suffix or 'nothing'}, expected .parquet.")
    with warnings.catch_warnings():
        if not isinstance(folder, ResultsFolder):
            warnings.simplefilter("default", RecordWarning)
            folder = ResultsFolder.open(folder)
        replicates = None if replicate is None else [replicate]
        if replicates is not None and folder.read(condition, replicates, ["replicate"]).is_empty():
            raise ValueError(
                f"There is no run {replicate}{'' if condition is None else f' of {condition!r}'}."
            )
        folder.write_derived(what, out, condition, replicates)
    return out
