"""Robots and arenas by name, or from files."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from realitygap._image_file import MOST_IMAGE_BYTES, on_white, open_image, plain
from realitygap._limits import MOST_TOML_BYTES, is_file, parse_toml
from realitygap._named_file import NamedFileError, open_named
from realitygap.errors import DescriptionError, did_you_mean
from realitygap.robot_families import RobotFamily, own_families, robot_families

from ._arena import NAMED_STARTS, Arena, paper_arena
from ._arena_file import ArenaFile, in_meters
from ._calibration import Calibration, is_calibration
from ._described import in_si
from ._floor import MOST_PIXELS, FloorImage
from ._robot_model import RobotModel
from ._svg import svg_values

T = TypeVar("T")

LONGEST_NAME = 500  # in a message
MOST_BASES = 8  # robots that build on robots


def robot_names() -> list[str]:
    """Return the names of the robots that come with realitygap, or with families of other packages."""
    return sorted(
        [*_names("robots"), *(name for family in robot_families() for name in family.robot_names())]
    )


def load_robot(robot: str | Path) -> RobotModel:
    """Return a robot by name, or from a TOML file.

    Args:
        robot: One of `robot_names`, or the path of a file.

    Raises:
        DescriptionError: There is no such robot or file, or it cannot be used: every mistake with its place.
    """
    values, origin = _robot_values(robot, [])
    return _checked(origin, lambda: RobotModel(**values))


def _robot_values(robot: str | Path, chain: list[str]) -> tuple[dict[str, Any], str]:
    """Return the values of a robot's file laid over those of the robot it builds on, and what to call it."""
    below, addition = _taken_apart(str(robot))
    if addition is not None:
        file = addition
        values, origin = _values_of(file, str(robot)), str(robot)
        values |= {"name": str(robot), "base": below}
    else:
        file, origin = _find("robot", robot_names, robot)
        values = read_toml(file, origin)
        if not is_calibration(values):
            values = _values_of(file, origin)
            values.setdefault("name", Path(origin).stem)
    if str(file) in chain or len(chain) >= MOST_BASES:
        raise DescriptionError(
            f"{origin}: `base` leads back to it, or through more than {MOST_BASES} robots. Expected a robot "
            "without `base` at the end of the chain."
        )
    if is_calibration(values):
        return _calibrated(_as_calibration(values, origin), origin, [*chain, str(file)]), origin
    return _with_base(values, origin, [*chain, str(file)]), origin


def load_calibration(path: str | Path) -> Calibration:
    """Read the file that `realitygap calibrate` wrote.

    Raises:
        DescriptionError: There is no such file, or it is no calibration: every mistake with its place.
    """
    file = Path(path)
    if not is_file(file):
        raise DescriptionError(f"There is no calibration {file}. `realitygap calibrate` writes one.")
    values = read_toml(file, str(file))
    if not is_calibration(values):
        raise DescriptionError(
            f"{file} is not a calibration: it does not have format = "
            f"{Calibration.model_fields['format'].default!r}. Expected a file that `realitygap calibrate` "
            "wrote."
        )
    return _as_calibration(values, str(file))


def read_calibration(robot: str | Path) -> Calibration | None:
    """Return the calibration in a file; None for the name or file of a robot, or an unknown name.

    Raises:
        DescriptionError: It is a calibration with mistakes.
    """
    path = Path(robot)
    if not is_file(path) or str(robot) in robot_names():
        return None
    values = read_toml(path, str(path))
    return _as_calibration(values, str(path)) if is_calibration(values) else None


def _as_calibration(values: Mapping[str, Any], origin: str) -> Calibration:
    """Return the calibration in a file's values. A robot file in the same folder gets that folder in its path."""
    made = _checked(origin, lambda: Calibration(**values))
    return made.model_copy(update={"robot": str(_beside(made.robot, origin))}).in_file(origin)


def _calibrated(calibration: Calibration, origin: str, chain: list[str]) -> dict[str, Any]:
    """Return the values of the robot that a calibration builds on, with its numbers."""
    below, _ = _robot_values(calibration.robot, chain)
    model = _checked(origin, lambda: RobotModel(**below).with_numbers(calibration.numbers))
    source = f"{Path(origin).name}: {calibration.kind} of {calibration.target}, {calibration.date}"
    texts = {"sources": [*_texts(below.get("sources")), source]}
    named = {"name": Path(origin).stem[:80], "description": model.description}
    return model.to_dict() | calibration.step | named | texts


def _with_base(values: dict[str, Any], origin: str, chain: list[str]) -> dict[str, Any]:
    """Return the values of a robot laid over those of its base."""
    base, turned = values.pop("base", None), values.pop("turned", False)
    if base is None and not turned:
        return values
    if not isinstance(base, str):
        raise DescriptionError(f"{origin}: base is {base!r}, expected the name of a robot or its file.")
    if not isinstance(turned, bool):
        raise DescriptionError(f"{origin}: turned is {turned!r}, expected true or false.")
    below, _ = _robot_values(_beside(base, origin), chain)
    sources = [*_texts(below.get("sources")), *_texts(values.get("sources"))]
    below = _turned(below, origin) if turned else dict(below)
    for kind, common in values.pop("each", {}).items():
        _put_into_each(below, kind, common, origin, is_over=True)
    merged = _laid_over(below, values)
    return merged | ({"sources": sources} if sources else {})


def _beside(robot: str, origin: str) -> str | Path:
    """Return the robot's file in the folder of `origin` if it is there, otherwise the robot's name."""
    beside = Path(origin).parent / robot
    return beside if is_file(origin) and is_file(beside) else robot


def _taken_apart(name: str) -> tuple[str, Traversable | None]:
    """Return the robot that a name like ROBOT-ADDITION begins with, and the file of the addition; None without one."""
    rest, _, last = name.rpartition("-")
    family = _family_with(name) if rest else None
    if family is not None and any(last in group for group in family.additions):
        return rest, family.robot_folder() / "additions" / f"{last}.toml"
    return name, None


def _texts(value: Any) -> list[Any]:
    return list(value) if isinstance(value, list | tuple) else []


def _values_of(file: Traversable, origin: str) -> dict[str, Any]:
    """Return the values of a robot's file in SI units, what [each.KIND] says put into every entry of that kind.

    `each` stays for those kinds of which only the robot's base has entries.
    """
    values = _checked(origin, lambda: in_si(read_toml(file, origin)))
    each = values.pop("each", {})
    if not isinstance(each, dict):
        raise DescriptionError(f"{origin}: each is {each!r}, expected tables such as [each.range].")
    for_base = {kind: common for kind, common in each.items() if "base" in values and kind not in values}
    for kind in each.keys() - for_base.keys():
        _put_into_each(values, kind, each[kind], origin)
    return values | ({"each": for_base} if for_base else {})


def _put_into_each(
    values: dict[str, Any], kind: str, common: Any, origin: str, *, is_over: bool = False
) -> None:
    """Put values that all entries of a kind have in common below those of each entry, or over them."""
    if not isinstance(common, dict):
        raise DescriptionError(f"{origin}: each.{kind} is {common!r}, expected a table [each.{kind}].")
    entries = values.get(kind)
    if not isinstance(entries, list | tuple) or not entries:
        raise DescriptionError(f"{origin}: [each.{kind}] is only for [[{kind}]], of which there are none.")
    values[kind] = [
        (entry | common if is_over else common | entry) if isinstance(entry, dict) else entry
        for entry in entries
    ]


def _laid_over(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Override tables key by key. Other values, and lists, are replaced."""
    merged = dict(below)
    for key, value in above.items():
        old = merged.get(key)
        both = isinstance(value, Mapping) and isinstance(old, Mapping)
        merged[key] = _laid_over(old, value) if both and old is not None else value
    return merged


def _turned(values: Mapping[str, Any], origin: str) -> dict[str, Any]:
    """Return the values of a robot turned half round: its back is ahead, and its left wheel the right one."""
    model = _checked(origin, lambda: RobotModel(**values))
    if model.vary:
        raise DescriptionError(
            f"{origin}: turned needs a base of plain numbers, and {', '.join(model.vary)} are drawn in it."
        )
    changed: dict[str, float] = {}
    for name, value in model.centers().items():
        last = name.rsplit(".", 1)[-1]
        if last in ("x", "y", "axle", "idler"):
            changed[name] = -value or 0.0
        elif last == "direction":
            changed[name] = (value + 2 * math.pi) % (2 * math.pi) - math.pi
    for end in ("left", "right"):
        other = "right" if end == "left" else "left"
        changed |= {
            f"drive.{kind}_{end}": getattr(model.drive, f"{kind}_{other}") for kind in ("gain", "bias")
        }
    turned = model.with_numbers(changed).model_dump()
    for key in ("pen", "caster"):
        if turned["looks"][key] is not None:
            turned["looks"][key] = tuple(-value or 0.0 for value in turned["looks"][key])
    prose = {key: values[key] for key in ("description", "sources") if key in values}
    return turned | prose


def arena_names() -> list[str]:
    """Return the names of the arenas that come with realitygap."""
    return sorted({"paper", *_names("arenas")})


def load_arena(arena: str | Path) -> Arena:
    """Return an arena by name, or from a TOML or SVG file.

    Args:
        arena: One of `arena_names`, or the path of a file.

    Raises:
        DescriptionError: There is no such arena or file, or it cannot be used: every mistake with its place.
    """
    if str(arena) == "paper":
        return paper_arena()
    if str(arena).lower().endswith((".yaml", ".yml")):
        raise DescriptionError(
            f"{arena} looks like a map of ROS, expected an arena. Convert it: realitygap arena {arena} -o arena.toml"
        )
    file, origin = _find("arena", arena_names, arena)
    if origin.lower().endswith(".svg"):
        text = read_text(file, origin)
        values = _checked(origin, lambda: svg_values(text))
    else:
        written = read_toml(file, origin)
        values = _checked(origin, lambda: in_meters(_in_present_words(written)))
        _read_image(values, origin)
    values.setdefault("name", Path(origin).stem)
    return Arena.from_file(_checked(origin, lambda: ArenaFile(**values)))


def _in_present_words(values: dict[str, Any]) -> dict[str, Any]:
    """Return an emulator's scene file of 0.1 as the values of an arena file: its walls, lamps, tape and start."""
    values = dict(values)
    if "walls" in values and "wall" not in values:
        values["wall"] = values.pop("walls")
    lamps = values.pop("lamps", None) if "light" not in values else None
    if lamps is not None:
        names = ("x", "y", "strength")
        rows = lamps if isinstance(lamps, list) else [lamps]
        values["light"] = [
            dict(zip(names, row, strict=True)) if isinstance(row, list) and len(row) == len(names) else row
            for row in rows
        ]
    if "tape" in values and "floor" not in values:
        values["floor"] = {"tape": values.pop("tape")}
    start = values.get("start")
    if isinstance(start, str) and start in NAMED_STARTS:
        values["start"] = list(NAMED_STARTS[start])
    return values


def _read_image(values: dict[str, Any], origin: str) -> None:
    """Replace the file of a floor image by its pixels."""
    floor = values.get("floor")
    image = floor.get("image") if isinstance(floor, dict) else None
    if not isinstance(floor, dict) or not isinstance(image, dict) or not isinstance(image.get("file"), str):
        return  # what is wrong with it is said later
    gray = _gray(image["file"], origin)
    width = image.get("width")
    if isinstance(width, int | float):
        made = FloorImage.of(0.0, 0.0, float(width), gray)
        floor["image"] = image | {"columns": made.columns, "rows": made.rows, "pixels": made.pixels}


def _gray(name: str, origin: str) -> NDArray[np.uint8]:
    """Return the brightness of an image file in the folder of an arena file; white where it is transparent."""
    try:
        with (
            open_named(Path(origin).parent, name, MOST_IMAGE_BYTES) as file,
            open_image(file, MOST_PIXELS) as image,
        ):
            return np.asarray(on_white(plain(image)).convert("L"), dtype=np.uint8)
    except NamedFileError as error:
        raise DescriptionError(f"{origin}: floor.image.file: {error}") from None
    except (OSError, ValueError) as error:
        raise DescriptionError(
            f"{origin}: floor.image.file: {name} is no image that can be read ({error})."
        ) from None


def read_toml(file: Traversable, origin: str) -> dict[str, Any]:
    """Return the values of a TOML file.

    Raises:
        DescriptionError: It cannot be read, is too large, or is no TOML.
    """
    text = read_text(file, origin)
    try:
        return parse_toml(text)
    except ValueError as error:
        raise DescriptionError(f"{origin}: not TOML ({error}).") from None


def read_text(file: Traversable, origin: str) -> str:
    """Return the text of a file of sensible size."""
    try:
        with file.open("rb") as stream:
            data = stream.read(MOST_TOML_BYTES + 1)
    except OSError as error:
        raise DescriptionError(f"{origin} cannot be read: {error.strerror or error}.") from None
    if len(data) > MOST_TOML_BYTES:
        raise DescriptionError(
            f"{origin} is larger than {MOST_TOML_BYTES:,} bytes. Expected the file of a robot or arena."
        )
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise DescriptionError(f"{origin} is not a text file in UTF-8 (byte {error.start} is not).") from None


def _names(folder: str) -> list[str]:
    place = resources.files(__package__) / folder
    return sorted(
        entry.name.removesuffix(".toml") for entry in place.iterdir() if entry.name.endswith(".toml")
    )


def _find(what: str, names: Callable[[], list[str]], name: str | Path) -> tuple[Traversable, str]:
    """Return the file of that name or path, and what to call it in messages."""
    if not isinstance(name, str | Path):
        raise TypeError(f"{what} is {name!r}, expected the name of one, or the path of its file.")
    if str(name) in _names(f"{what}s"):
        return resources.files(__package__) / f"{what}s" / f"{name}.toml", str(name)
    family = _family_with(str(name)) if what == "robot" else None
    if family is not None:
        return family.robot_folder() / f"{name}.toml", str(name)
    path = Path(name)
    if str(name) and is_file(path):
        return path, str(path)
    if path.suffix or len(path.parts) > 1:
        raise DescriptionError(f"There is no {what} file {_short(str(path))}.")
    endings = ".toml or .svg" if what == "arena" else ".toml"
    raise DescriptionError(
        f"Unknown {what} {_short(str(name))!r}. {did_you_mean(str(name), names())} A file ends in {endings}."
    )


def _family_with(name: str) -> RobotFamily | None:
    """Return the family with a robot of that name; None if there is none. Other packages are searched last."""
    own = next((family for family in own_families() if name in family.robot_names()), None)
    if own is not None or is_file(name):
        return own
    return next((family for family in robot_families() if name in family.robot_names()), None)


def _short(name: str) -> str:
    return name if len(name) <= LONGEST_NAME else f"{name[:LONGEST_NAME]}..."


_OURS = ("RobotModel.", "ArenaFile.", "Calibration.")
_WHOLE = ("RobotModel: ", "ArenaFile: ", "Calibration: ")


def _checked(origin: str, make: Callable[[], T]) -> T:
    """Return what `make` returns, or raise an error that lists every mistake in the file `origin`."""
    try:
        return make()
    except DescriptionError:
        raise
    except ValueError as error:
        lines = [line.split(".", 1)[-1] if line.startswith(_OURS) else line.split(": ", 1)[-1]
                 if line.startswith(_WHOLE) else line
                 for line in str(error).split("\n")]  # fmt: skip
        count = len(lines)
        head = f"{origin} has {count} mistake{'s' if count != 1 else ''}."
        raise DescriptionError("\n  ".join([head, *lines])) from None
