"""`realitygap track`, `realitygap print-tags` and `realitygap lens`: a robot under a camera."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import realitygap
from realitygap._terminal import echo
from realitygap._wording import fixed
from realitygap.errors import StudyError

from ._options import Json, print_json, second_option

if TYPE_CHECKING:
    from realitygap.records import ScoreRole
    from realitygap.study import TrackedTrial, TrialToTrack
    from realitygap.vision import Marks, RobotTag, Source, Tracked

_TRIAL = "Only for a trial of a study or file"
_Tag = Annotated[
    str,
    typer.Option(
        metavar="ID",
        help="Tag on the robot: a number, or FAMILY:ID such as aruco4x4:7. Families: 36h11 (AprilTag), 25h9, 16h5, "
        "aruco4x4 to aruco7x7, aruco. [default family: detected]",
    ),
]
_TagSize = Annotated[float, typer.Option(metavar="M", help="Side of the tag's black square [m].")]


def track(
    camera: Annotated[
        str, typer.Option(metavar="CAMERA", help="Number of a camera, such as 0, or video file.")
    ],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="FILE", help="Track to write, as a table (.csv).")
    ] = None,
    arena: Annotated[
        str | None,
        typer.Option(metavar="ARENA", help="Arena by name or file. [default: that of the trial, or paper]"),
    ] = None,
    sheet: Annotated[
        bool,
        typer.Option(
            "--sheet",
            help="Use the corner tags of print-sheet and print-tags. This is the default.",
        ),
    ] = False,
    tag: _Tag = "10",
    tag_size: _TagSize = 0.07,
    tag_height: Annotated[
        float, typer.Option(metavar="M", help="Height of the tag above the floor [m].")
    ] = 0.1,
    tag_at: Annotated[
        str,
        typer.Option(
            metavar="AHEAD,LEFT,DEG",
            help="Position of the tag from the robot's middle [m], and its counter-clockwise rotation [degrees].",
        ),
    ] = "0,0,0",
    corner_size: Annotated[
        float | None,
        typer.Option(metavar="M", help="Side of the corner tags' black squares [m]. [default: 0.06]"),
    ] = None,
    corner_inset: Annotated[
        float | None,
        typer.Option(
            metavar="M",
            help="Distance from the walls to the corner tags [m], below 0 outside. [default: 0.01 if there is room]",
        ),
    ] = None,
    lens: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Lens file from `realitygap lens`. [default: fitted to the tags]"),
    ] = None,
    save_lens: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Lens file to write, with the lens fitted to the tags (.toml)."),
    ] = None,
    overlay: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Video to write, with the track drawn into it (.mp4).")
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(
            min=0.1, metavar="S", help="Duration of the recording from a camera [s]. [default: until Ctrl-C]"
        ),
    ] = None,
    study: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Folder of the study. Its ledger gets the cells and the path.",
            rich_help_panel=_TRIAL,
        ),
    ] = None,
    trials: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="File of trials, instead of --study.", rich_help_panel=_TRIAL),
    ] = None,
    trial: Annotated[
        int | None,
        typer.Option(
            metavar="NUMBER", help="Number of the trial that the video shows.", rich_help_panel=_TRIAL
        ),
    ] = None,
    into: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="File that gets the trial with its poses, for calibrate and gap (.sqlite).",
            rich_help_panel=_TRIAL,
        ),
    ] = None,
    begins: Annotated[
        float | None,
        typer.Option(
            metavar="S",
            help="Time in the video at which the trial begins [s]. [default: matched by its commands]",
            rich_help_panel=_TRIAL,
        ),
    ] = None,
    second: Annotated[bool, second_option(_TRIAL)] = False,
    who: Annotated[
        str, typer.Option(metavar="NAME", help="Name to record with the score.", rich_help_panel=_TRIAL)
    ] = "camera",
    as_json: Json = False,
) -> None:
    """Track a tagged robot in a video or camera stream.

    A tag at each corner locates the arena. The track is interpolated, and marked, while the robot's tag is not visible.
    With --trial, the commands of the trial locate it in the video. Its cells and path go to the ledger of --study.
    With --into, the trial and its poses go to a file for `realitygap calibrate --from` and `realitygap gap`.

    Example: realitygap track --camera trial-12.mp4 --sheet -o trial-12.csv --overlay seen.mp4

    Example: realitygap track --camera trial-12.mp4 --study results/paper-robot --trial 12 --into tracked.sqlite

    Example: realitygap track --camera 0 --tag aruco4x4:7 --tag-size 0.05 --lens webcam.toml -o live.csv

    In Python: realitygap.vision.track_video(realitygap.vision.VideoFile(path), realitygap.vision.Marks(arena))
    """
    wanted = _wanted(study, trials, trial, into)
    if sheet and (corner_size is not None or corner_inset is not None):
        raise StudyError(
            "--sheet defines the positions of the corner tags. Leave --corner-size and --corner-inset out."
        )
    marks = _marks(
        arena,
        wanted,
        realitygap.study.tag_of(tag, tag_size, tag_height, tag_at),
        lens,
        corner_size,
        corner_inset,
    )
    _refuse_outputs(out, save_lens, overlay, into, camera)
    source = realitygap.vision.open_source(camera)
    found = _tracked(source, marks, seconds)
    placed = None
    if wanted is not None:
        placed = realitygap.study.place_trial(wanted, found.track, begins, who)
    _write(found, marks, source, out, save_lens, overlay)
    if wanted is not None and placed is not None:
        _enter(
            wanted,
            placed,
            study,
            trial or 0,
            into,
            realitygap.study.note_of_track(camera, found, placed),
            "second" if second else "score",
        )
    _print(found, placed, _Written(out, save_lens, overlay, into, study), as_json=as_json)


def print_tags(
    out: Annotated[Path, typer.Option("-o", "--out", metavar="FILE", help="PDF to write.")],
    tag: _Tag = "10",
    tag_size: _TagSize = 0.07,
    corner_size: Annotated[
        float, typer.Option(metavar="M", help="Side of the corner tags' black squares [m].")
    ] = 0.06,
    paper: Annotated[str, typer.Option(metavar="PAPER", help="Size of the pages: a4, letter or a3.")] = "a4",
) -> None:
    """Write the tags for the camera (PDF, true scale).

    Print the tags at 100 %, and measure the printed ruler. A sheet of `realitygap print-sheet` already has the corner
    tags.

    Example: realitygap print-tags -o tags.pdf

    Example: realitygap print-tags -o tags.pdf --tag aruco4x4:7 --tag-size 0.05 --paper letter

    In Python: realitygap.vision.print_tags("tags.pdf")
    """
    if out.suffix != ".pdf":
        raise StudyError(f"{out} does not end in .pdf. Expected a name such as tags.pdf.")
    _refuse_folder(out)
    try:
        printed = realitygap.study.tag_of(tag, tag_size, 0.1, "0,0,0")
        n = realitygap.vision.print_tags(out, printed, corner_size, paper)  # type: ignore[arg-type]
    except ValueError as error:
        raise StudyError(str(error)) from None
    echo(f"Written: {out} ({n} pages)")


def lens(
    camera: Annotated[
        str, typer.Option(metavar="CAMERA", help="Video of a checkerboard, or number of a camera.")
    ],
    out: Annotated[Path, typer.Option("-o", "--out", metavar="FILE", help="Lens file to write (.toml).")],
    board: Annotated[
        str, typer.Option(metavar="COLUMNSxROWS", help="Inner corners of the board, where four squares meet.")
    ] = "9x6",
    square: Annotated[float, typer.Option(metavar="M", help="Side of a square [m].")] = 0.025,
    seconds: Annotated[
        float, typer.Option(min=1, metavar="S", help="Duration of the recording from a camera [s].")
    ] = 30.0,
) -> None:
    """Calibrate a camera lens from a checkerboard video.

    Most cameras don't need this: without a lens file, `realitygap track` fits a lens to the tags.

    Example: realitygap lens --camera board.mp4 --board 9x6 --square 0.025 -o phone.toml

    In Python: realitygap.vision.fit_lens(images, 9, 6, 0.025)
    """
    columns, cross, rows = board.partition("x")
    if not (cross and columns.isdecimal() and rows.isdecimal()):
        raise StudyError(f"--board is {board!r}, expected inner corners across and down, such as 9x6.")
    _refuse_toml(out)
    source = realitygap.vision.open_source(camera)
    taken = _for_seconds(source, seconds if camera.isdecimal() else None)
    few = max(1, round(source.rate / 3))
    try:
        images = (realitygap.vision.gray_of(image) for k, (_, image) in enumerate(taken) if k % few == 0)
        made = realitygap.vision.fit_lens(images, int(columns), int(rows), square)
    except ValueError as error:
        raise StudyError(str(error)) from None
    finally:
        source.close()
    _save(out, made.to_toml())
    echo(f"The board's corners are off by {made.rms:.2f} pixels.\nWritten: {out}")


# what was asked for


def _wanted(
    study: Path | None, trials: Path | None, trial: int | None, into: Path | None
) -> TrialToTrack | None:
    """Return the trial in the video; None if none was named."""
    if study is not None and trials is not None:
        raise StudyError("--study and --trials exclude each other: the trial is in a ledger or in a file.")
    source = trials if study is None else study
    if (trial is None) != (source is None):
        raise StudyError(
            "A trial is named by --study DIR --trial NUMBER, or by --trials FILE --trial NUMBER."
        )
    if trial is None or source is None:
        if into is not None:
            raise StudyError(
                "--into saves a trial with its commands. Name the trial: --study DIR --trial NUMBER"
            )
        return None
    if study is None and into is None:
        raise StudyError(
            "No file for the trial with its poses. Name one with --into, such as tracked.sqlite."
        )
    return realitygap.study.trial_of_ledger(source, trial)


def _marks(
    arena: str | None,
    wanted: TrialToTrack | None,
    tag: RobotTag,
    lens: Path | None,
    corner_size: float | None,
    corner_inset: float | None,
) -> Marks:
    place = (
        realitygap.world.load_arena(arena or "paper") if wanted is None or arena is not None else wanted.arena
    )
    if wanted is not None and place.grid != wanted.arena.grid:
        raise StudyError(
            f"The trial was in arena {wanted.arena.name!r}, and --arena is another. Leave it out."
        )
    return realitygap.study.marks_of(place, tag, lens, corner_size, corner_inset)


def _refuse_outputs(
    out: Path | None, save_lens: Path | None, overlay: Path | None, into: Path | None, camera: str
) -> None:
    """Refuse what cannot be written before a video is gone through."""
    is_converted = into is not None and into.suffix == ".jsonl" and into.exists()
    endings = (".csv", ".toml", ".mp4", ".jsonl" if is_converted else ".sqlite")
    for path, ending in zip((out, save_lens, overlay, into), endings, strict=True):
        if path is None:
            continue
        if path.suffix != ending:
            raise StudyError(f"{path} does not end in {ending}. Expected a name such as track{ending}.")
        _refuse_folder(path)
    if overlay is not None and (camera.isdecimal() or overlay.resolve() == Path(camera).resolve()):
        raise StudyError("--overlay draws into a copy of a video file. Film first, and name another file.")


def _refuse_folder(path: Path) -> None:
    if not path.resolve().parent.is_dir():
        raise StudyError(f"There is no folder {path.parent} for {path.name}. Make it, or name another file.")


def _refuse_toml(path: Path) -> None:
    if path.suffix != ".toml":
        raise StudyError(f"{path} does not end in .toml. Expected the name of a lens, such as phone.toml.")
    _refuse_folder(path)


# what is done


def _tracked(source: Source, marks: Marks, seconds: float | None) -> Tracked:
    try:
        tracker = realitygap.vision.Tracker(marks.tag)
        try:
            for time, image in _for_seconds(source, seconds):
                tracker.take(time, image)
        except KeyboardInterrupt:
            if not source.name.startswith("camera "):
                raise
        return marks.tracked(tracker.sightings())
    except ValueError as error:
        raise StudyError(str(error)) from None
    finally:
        source.close()


def _for_seconds(source: Source, seconds: float | None) -> Iterator[tuple[float, Any]]:
    first: float | None = None
    for time, image in source:
        first = time if first is None else first
        if seconds is not None and time - first > seconds:
            return
        yield time, image


def _write(
    found: Tracked,
    marks: Marks,
    source: Source,
    out: Path | None,
    save_lens: Path | None,
    overlay: Path | None,
) -> None:
    if out is not None:
        _save(out, found.track.to_csv())
    if save_lens is not None:
        _save(save_lens, found.camera.lens.to_toml())
    if overlay is not None:
        realitygap.vision.save_overlay(overlay, source, found, marks.arena, source.rate)


def _save(path: Path, text: str) -> None:
    realitygap.records.write_whole(path, text.encode())


def _enter(
    wanted: TrialToTrack,
    placed: TrackedTrial,
    study: Path | None,
    trial: int,
    into: Path | None,
    told: str,
    role: ScoreRole,
) -> None:
    with contextlib.ExitStack() as stack:  # a file that does not do is refused before the ledger is written
        file = (
            None
            if into is None
            else stack.enter_context(realitygap.records.open_saved_trials(into, wanted.head))
        )
        if study is not None:
            realitygap.study.score_tracked(study, trial, placed, told, role)
        if file is not None:
            file.append(placed.trial)


@dataclass(frozen=True)
class _Written:
    """The files and the folder that were written."""

    out: Path | None
    lens: Path | None
    overlay: Path | None
    into: Path | None
    study: Path | None

    @property
    def files(self) -> list[Path]:
        return [path for path in (self.out, self.lens, self.overlay, self.into) if path is not None]


def _print(found: Tracked, placed: TrackedTrial | None, written: _Written, *, as_json: bool) -> None:
    track, camera = found.track, found.camera
    n, n_seen = len(found.sightings.times), int(track.seen.sum())
    x, y, above = camera.place.tolist()
    if as_json:
        values: dict[str, Any] = {
            "pictures": n,
            "seen": n_seen,
            "longest_gap_s": track.longest_gap_s,
            "from_s": float(track.times[0]),
            "to_s": float(track.times[-1]),
            "tag": f"{found.tag.family}:{found.tag.number}",
            "camera_m": [x, y, above],
            "corner_tags": sorted(found.sightings.corners),
            "corner_rms_px": camera.rms,
            "tag_size_error": track.size_error,
            "warnings": list(found.warnings),
            "study": written.study,
            "written": written.files,
        }
        if placed is not None:
            begun = placed.beginning
            values |= {
                "begins_s": begun.time,
                "agreement": None if math.isnan(begun.agreement) else begun.agreement,
                "cells": list(placed.score.cells),
            }
        print_json(values)
        return
    echo(
        f"Tag {found.tag.family}:{found.tag.number} seen in {n_seen} of {n} pictures; longest gap "
        f"{track.longest_gap_s:.2f} s, filled in."
    )
    echo(f"The camera is {above:.2f} m above the floor.")
    if placed is not None:
        begun = placed.beginning
        how = (
            "as said" if math.isnan(begun.agreement) else f"commands and path agree to {begun.agreement:.2f}"
        )
        echo(
            f"The trial begins at {fixed(begun.time, 2)} s ({how}) and crosses {len(placed.score.cells)} cells."
        )
    for said in found.warnings:
        echo(f"Note: {said}")
    if written.study is not None:
        echo(f"Entered into the ledger of {written.study}.")
    for path in written.files:
        echo(f"Written: {path}")
