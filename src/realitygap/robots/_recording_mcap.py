"""A recording as MCAP, the format of robotics viewers."""

from __future__ import annotations

import json
import secrets
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Any

from realitygap.errors import RecordError, from_extra

from ._recording import KINDS, Line, read_recording

NANOSECONDS = 1_000_000_000
_TYPES = {bool: "boolean", int: "integer", float: "number", str: "string"}


def export_mcap(recording: Path | str, out: Path | str) -> int:
    """Write a recording as MCAP: a topic for each kind of call (`/call/drive` ...), one for the wire, one for faults.

    Messages are JSON, with a schema; their time is that of the recording's beginning and the robot's clock since.

    Args:
        recording: The recording.
        out: The file to write. An existing file is replaced when the new one is complete.

    Returns:
        Number of messages.

    Raises:
        RecordError: The recording cannot be read, or the file cannot be written.
        MissingExtraError: The package mcap, of the extra `export`, is not installed.
    """
    writer_of = from_extra("mcap.writer", "export").Writer
    source = read_recording(recording)
    out = Path(out)
    began = int(datetime.fromisoformat(source.header["started"]).timestamp() * NANOSECONDS)
    temporary = out.with_name(f".{out.name}.{secrets.randbits(63)}.tmp")
    try:
        with temporary.open("xb") as file:
            writer = writer_of(file)
            writer.start(profile="", library="realitygap")
            writer.add_metadata("set-up", {key: _text(value) for key, value in source.header.items()})
            channels: dict[str, int] = {}
            for line in source.lines:
                topic, message = _message(line)
                if topic not in channels:
                    channels[topic] = _channel(writer, topic, line["kind"], message)
                time = began + round(line["t"] * NANOSECONDS)
                data = json.dumps(message).encode()
                writer.add_message(channel_id=channels[topic], log_time=time, publish_time=time, data=data)
            writer.finish()
        temporary.replace(out)
    except OSError as error:
        raise RecordError(f"Could not write {out}: {error.strerror or error}. Name another file.") from error
    finally:
        temporary.unlink(missing_ok=True)
    return len(source.lines)


def _text(value: object) -> str:
    return value if isinstance(value, str) else json.dumps(value)


def _message(line: Line) -> tuple[str, dict[str, object]]:
    """Return topic and content of a line."""
    if line["kind"] == "call":
        return f"/call/{line['name']}", dict(line.get("values", {}))
    rest = {key: value for key, value in line.items() if key not in ("t", "kind", "values")}
    return f"/{line['kind']}", rest


def _channel(writer: Any, topic: str, kind: str, example: Mapping[str, object]) -> int:
    schema = {
        "type": "object",
        "title": topic,
        "description": KINDS[kind],
        "properties": {name: _property(value) for name, value in example.items()},
    }
    schema_id = writer.register_schema(name=topic, encoding="jsonschema", data=json.dumps(schema).encode())
    channel: int = writer.register_channel(topic=topic, message_encoding="json", schema_id=schema_id)
    return channel


def _property(value: object) -> dict[str, object]:
    if isinstance(value, list):
        return {"type": "array", "items": {"type": "number"}}
    return {"type": _TYPES.get(type(value), "object")}
