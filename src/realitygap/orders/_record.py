"""The order that made a file."""

from __future__ import annotations

import html
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from realitygap._limits import MOST_TABLE_BYTES, parse_json, parse_toml, read_file
from realitygap.errors import StudyError, did_you_mean

from ._calibrate import CalibrateOrder
from ._close import CloseOrder
from ._compare import CompareOrder
from ._estimate import EstimateOrder
from ._gap import GapOrder
from ._order import Order
from ._plan import PlanOrder
from ._transfer import TransferOrder, TryOrder

ORDERS: dict[str, type[Order]] = {
    model.command: model
    for model in (
        CalibrateOrder,
        CloseOrder,
        EstimateOrder,
        CompareOrder,
        GapOrder,
        PlanOrder,
        TransferOrder,
        TryOrder,
    )
}
"""Orders by the name of their command."""

ORDER_FILE = "order.toml"
"""Name of the file with its order in a folder of results."""

_ON_PAGE = re.compile(r'<pre id="order"[^>]*>(.*?)</pre>', re.DOTALL)


def read_order(path: str | Path) -> Order:
    """Return the order that made a report, a file of JSON, a calibration, or the folder of a transfer.

    Raises:
        StudyError: The file cannot be read, or has no order.
    """
    path = Path(path)
    record = _record_in(path / ORDER_FILE if path.is_dir() else path)
    values = {name: value for name, value in record.items() if name not in ("command", "version")}
    command = record.get("command")
    if command not in ORDERS:
        raise StudyError(
            f"{path}: the order is for the command {command!r}. {did_you_mean(str(command), ORDERS)}"
        )
    order = ORDERS[str(command)](**values)
    for field in order.fields():
        value = getattr(order, field.name)
        for part in value if field.is_list else (value,):
            if field.face.is_argument and str(part).startswith("-"):  # would be an option
                raise StudyError(f"{path}: {field.name} is {part!r}, expected a name.")
    return order


def _record_in(path: Path) -> Mapping[str, Any]:
    """Return the table of an order in a file.

    Raises:
        StudyError: The file cannot be read, or has no order.
    """
    try:
        text = read_file(path, MOST_TABLE_BYTES).decode("utf-8", "replace")
        if path.suffix == ".json":
            values = parse_json(text)
        elif match := _ON_PAGE.search(text):
            values = parse_toml(html.unescape(match[1]))
        else:
            values = parse_toml(text) if path.suffix == ".toml" else {}
    except (OSError, ValueError) as error:
        reason = error.strerror or str(error) if isinstance(error, OSError) else str(error)
        raise StudyError(f"{path} cannot be read: {reason}.") from None
    record = values.get("order") if isinstance(values, Mapping) else None
    if not isinstance(record, Mapping):
        raise StudyError(
            f"{path} does not state how it was made. Expected the report of a gap (.html), a calibration (.toml), the "
            f"folder of a transfer, or what one of these commands prints with --json: {', '.join(ORDERS)}."
        )
    return record
