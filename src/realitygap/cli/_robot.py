"""`realitygap robot`: a robot on its port, from the terminal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from math import isfinite
from pathlib import Path
from typing import Annotated, Any

import typer

import realitygap
from realitygap._terminal import echo
from realitygap._wording import fixed
from realitygap.errors import RobotError
from realitygap.robot_families import default_family, own_families, ports_by_family, robot_families

from ._options import Json, print_json
from ._tables import print_rows

robot = typer.Typer(
    name="robot",
    help='Connect to a robot and send it commands.\n\nIn Python: realitygap.robots.open_on("/dev/rfcomm0")',
    epilog="\n\n".join(
        f"Example: realitygap robot info {family.as_typed(family.ports[0])}" for family in own_families()
    ),
    no_args_is_help=True,
    rich_markup_mode=None,
)

Port = Annotated[
    str,
    typer.Argument(
        metavar="PORT",
        help=f"{ports_by_family()} `realitygap robot list` lists the ports of this machine.",
    ),
]
Record = Annotated[
    Path | None, typer.Option(metavar="FILE", help="New file to record the session in, for show-recording.")
]

LONGEST_DRIVE_S = 3600.0

_NO_PORTS = ("sim", "jyro", "emulator")
"""Words for robots that newcomers give as a port, besides the names of families and their platforms."""


@contextmanager
def _opened(port: str, record: Path | None) -> Iterator[tuple[Any, Any]]:
    """Yield the functions of the robot's family and the robot on a port, stopped and let go of in the end."""
    if port in _NO_PORTS or any(port in (family.name, *family.platforms) for family in robot_families()):
        raise RobotError(
            f"{port} is no port. For an emulated robot, use {default_family().emulated}. `realitygap robot list` lists "
            "the ports of this machine."
        )
    if port.startswith("recording:"):
        raise RobotError(f"{port} is a recording: `realitygap robot show-recording` shows it.")

    try:
        terminal, robot = realitygap.robots.open_on(port, record)
        with robot as opened:
            yield terminal, opened
    except ValueError as error:
        raise RobotError(str(error)) from error


@contextmanager
def _opened_with(part: str, port: str, record: Path | None) -> Iterator[Any]:
    """Yield the robot on a port, if it has a part that not every robot has."""
    with _opened(port, record) as (_, opened):
        if not hasattr(opened, part):
            raise RobotError(f"The robot on {port} cannot do this: it has no {part}.")
        yield opened


@robot.command("list")
def list_ports(as_json: Json = False) -> None:
    """List the serial ports and their probable devices.

    Example: realitygap robot list

    In Python: realitygap.robots.list_ports()
    """
    found = realitygap.robots.list_ports()
    if as_json:
        print_json([guess._asdict() for guess in found])
    elif found:
        print_rows(("port", "seems to be", "the system says"), found)
    else:
        echo("No serial port found. Pair the robot or plug it in, see docs/how-to/robot.md.")


@robot.command("info")
def info(
    port: Port,
    probe: Annotated[
        bool,
        typer.Option(
            "--probe",
            help="Measure for how long the robot follows a command that is not repeated. It turns on the spot for "
            "up to 5 s.",
        ),
    ] = False,
    as_json: Json = False,
    record: Record = None,
) -> None:
    """Identify the robot on a port.

    Prints the model of the robot, its firmware, and whether the robot is real or emulated.

    Example: realitygap robot info /dev/rfcomm0

    Example: realitygap robot info ros2:/robot1 --probe

    In Python: realitygap.robots.open_on("/dev/rfcomm0")[1].info
    """
    with _opened(port, record) as (terminal, opened):
        if probe and not hasattr(opened, "timeout"):
            raise RobotError(f"The robot on {port} has no timeout to measure. Leave --probe out.")
        found = terminal.info(opened)
        if probe:
            lasts_s = opened.timeout()
            found |= {"measured_timeout_s": lasts_s if isfinite(lasts_s) else "none found"}
    _print(found, as_json)


@robot.command("sense")
def sense(port: Port, as_json: Json = False, record: Record = None) -> None:
    """Read every sensor except the camera once.

    Example: realitygap robot sense /dev/rfcomm0

    In Python: realitygap.robots.open_on("/dev/rfcomm0")[1].sensors()
    """
    with _opened(port, record) as (terminal, opened):
        seen = terminal.sense(opened)
    _print(seen, as_json)


@robot.command("drive")
def drive(
    port: Port,
    move: Annotated[
        float, typer.Argument(metavar="MOVE", help="Share of full speed, -1 (back) to 1 (ahead).")
    ],
    turn: Annotated[
        float, typer.Argument(metavar="TURN", help="Share of full turn, -1 (right) to 1 (left).")
    ] = 0.0,
    seconds: Annotated[float, typer.Option(metavar="S", help="Duration [s], at most 3600.")] = 0.5,
    record: Record = None,
) -> None:
    """Drive for a while, then stop.

    Ctrl-C stops the robot immediately.

    Example: realitygap robot drive /dev/rfcomm0 0.5 0.2 --seconds 2

    Example: realitygap robot drive /dev/rfcomm0 -- -0.5

    In Python: realitygap.robots.open_on("/dev/rfcomm0")[1].drive(Command(0.5, 0.2))
    """
    if not 0 <= seconds <= LONGEST_DRIVE_S:
        raise RobotError(f"--seconds is {seconds:g}, expected 0 to {LONGEST_DRIVE_S:g}.")
    with _opened(port, record) as (_, opened):
        opened.step_s = seconds
        opened.drive(realitygap.robots.Command(move, turn))
        opened.stop()
        recoveries = opened.faults.recoveries if hasattr(opened, "faults") else 0
    echo(f"Drove {seconds:g} s with move {move:g} and turn {turn:g}, then stopped.")
    if recoveries:
        echo(f"The link was disturbed {recoveries} times; the robot stood still meanwhile.", err=True)


@robot.command("stop")
def stop(port: Port) -> None:
    """Stop the motors.

    Example: realitygap robot stop /dev/rfcomm0

    In Python: realitygap.robots.open_on("/dev/rfcomm0")[1].stop()
    """
    with _opened(port, None) as (_, opened):
        opened.stop()
    echo("The motors are off.")


@robot.command("battery")
def battery(port: Port, as_json: Json = False, record: Record = None) -> None:
    """Read the battery.

    Example: realitygap robot battery /dev/rfcomm0

    In Python: realitygap.robots.open_on("/dev/rfcomm0")[1].battery()
    """
    with _opened(port, record) as (terminal, opened):
        name, value = terminal.battery(opened)
    if as_json:
        print_json({name: round(value, 3)})
        return
    echo(f"{fixed(value, 2)} V" if name.endswith("_v") else f"{value:g}, without a unit")


@robot.command("picture")
def picture(
    port: Port,
    out: Annotated[Path, typer.Option("-o", "--out", metavar="FILE.png", help="Picture to write.")] = Path(
        "picture.png"
    ),
    kind: Annotated[
        str,
        typer.Option(
            metavar="KIND", help="Kind: jpeg, jpeg-fast, gray, grayjpeg-fast, grayraw, color (raw) or blob."
        ),
    ] = "jpeg",
    record: Record = None,
) -> None:
    """Take a picture with the robot's camera (PNG).

    Example: realitygap robot picture /dev/rfcomm0 -o picture.png

    In Python: realitygap.robots.open_on("/dev/rfcomm0")[1].picture()
    """
    if out.suffix.lower() != ".png":
        raise RobotError(f"{out} does not end in .png: pictures are written as PNG.")
    with _opened_with("picture", port, record) as opened:
        pixels = opened.picture(kind)
    from PIL import Image

    Image.fromarray(pixels).save(out, "PNG")
    echo(f"Written: {out} ({pixels.shape[1]} x {pixels.shape[0]})")


@robot.command("beep")
def beep(
    port: Port,
    seconds: Annotated[float, typer.Option(metavar="S", help="Duration [s], at most 8.191.")] = 0.5,
    hz: Annotated[float, typer.Option(metavar="HZ", help="Frequency [Hz], at most 10000.")] = 880.0,
    hz2: Annotated[float | None, typer.Option(metavar="HZ", help="Frequency of a second tone [Hz].")] = None,
    record: Record = None,
) -> None:
    """Play a tone.

    Example: realitygap robot beep /dev/rfcomm0 --hz 440

    In Python: realitygap.robots.open_on("/dev/rfcomm0")[1].beep(0.5, 440)
    """
    with _opened_with("beep", port, record) as opened:
        opened.beep(seconds, hz, hz2)


@robot.command("show-recording")
def show_recording(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Recording that --record wrote.")],
    wire: Annotated[bool, typer.Option("--wire", help="Show every command with its bytes.")] = False,
    as_json: Json = False,
) -> None:
    """Show a recorded session with a robot.

    Each call has a row. With --wire, each command has one.

    Example: realitygap robot show-recording session.jsonl --wire

    In Python: realitygap.robots.read_recording("session.jsonl").table()
    """
    recording = realitygap.robots.read_recording(file)
    lines = [line for line in recording.lines if wire or line["kind"] != "wire"]
    if as_json:
        print_json({"header": recording.header, "lines": lines, "is_whole": recording.is_whole})
        return
    header = recording.header
    who = header.get("robot", {})
    named = who["name"] if "name" in who else f"{who.get('model')} with Fluke {who.get('fluke')}"
    echo(f"{header.get('label', 'no robot')} on {header['port']}, {named}, {header['started']}")
    print_rows(("t [s]", "kind", "name", "what"), [_row(line) for line in lines])
    if not recording.is_whole:
        echo("The last line is cut off, as after a crash, and left out.")


@robot.command("export-recording")
def export_recording(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Recording that --record wrote.")],
    out: Annotated[Path, typer.Option("-o", "--out", metavar="FILE.mcap", help="MCAP file to write.")],
) -> None:
    """Write a recording as MCAP.

    Viewers of robotics data read MCAP. The command needs the extra 'export'.

    Example: realitygap robot export-recording session.jsonl -o session.mcap

    In Python: realitygap.robots.export_mcap("session.jsonl", "session.mcap")
    """
    echo(f"Written: {out} ({realitygap.robots.export_mcap(file, out)} messages)")


def _row(line: Mapping[str, Any]) -> tuple[str, str, str, str]:
    """Return a line of a recording for people."""
    values = line.get("values", {})
    what = ", ".join(f"{name} {_value(value)}" for name, value in values.items())
    if line["kind"] == "wire":
        what = f"{line['sent']} > {_shortened(line['answered'])}"
    if line.get("outcome", "ok") != "ok":
        what = f"{what} {line['outcome']}".strip()
    return fixed(line["t"], 3), line["kind"], line["name"], what


def _shortened(text: str, most: int = 60) -> str:
    return text if len(text) <= most else f"{text[:most]}... ({len(text) // 2} bytes)"


def _value(value: object) -> str:
    if isinstance(value, float):
        return fixed(value, 3)
    return " ".join(map(_value, value)) if isinstance(value, list | tuple) else str(value)


def _print(found: Mapping[str, object], as_json: bool) -> None:
    if as_json:
        print_json(found)
        return
    shown = {name: "-" if value in (None, "") else _value(value) for name, value in found.items()}
    print_rows(None, [(name.replace("_", " "), value) for name, value in shown.items()])
