"""Orders: each operation described once, as a model with all its settings.

A command, a function, a form of the lab, the message to a worker, and the record in a result derive from the model.
"""

from ._calibrate import CalibrateOrder
from ._close import CloseOrder
from ._compare import CompareOrder, range_ends
from ._estimate import EstimateOrder
from ._field import Limits, OrderField
from ._function import takes_order, with_fields
from ._gap import GapOrder
from ._order import Order, OrderError
from ._plan import PlanOrder, Question
from ._record import ORDER_FILE, ORDERS, read_order
from ._shared import ONLY_ROBOTS
from ._transfer import TransferOrder, TryOrder

__all__ = [
    "ONLY_ROBOTS",
    "ORDERS",
    "ORDER_FILE",
    "CalibrateOrder",
    "CloseOrder",
    "CompareOrder",
    "EstimateOrder",
    "GapOrder",
    "Limits",
    "Order",
    "OrderError",
    "OrderField",
    "PlanOrder",
    "Question",
    "TransferOrder",
    "TryOrder",
    "range_ends",
    "read_order",
    "takes_order",
    "with_fields",
]
