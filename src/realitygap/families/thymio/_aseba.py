"""A network as a program in Aseba's language, for a Thymio II without a computer."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from xml.sax.saxutils import escape

import numpy as np

from realitygap._version import __version__
from realitygap.errors import ControllerError
from realitygap.evolution import ControllerInterface, Network, listed

from ._fixed_point import (
    CUBE,
    ONE,
    ONE_BITS,
    SATURATED,
    SPACING_BITS,
    TABLE,
    WORD,
    FixedNetwork,
    FixedNode,
    errors,
    fixed_point,
)

MOST_WORDS = 1534
"""Words of bytecode that a Thymio has room for. Source: Mobsya/aseba-target-thymio2, `skel-usb-user.h`."""
MOST_VARIABLES = 512
"""Words of a Thymio's memory for variables of a program. Source: as above."""
FULL_SPEED = 300
"""Target of a wheel for a command of 1."""
READING_MAX = 4505
"""Reading of an infrared sensor that touches white paper; source: Enki, `Thymio2.cpp`."""
GROUND_WHITE, GROUND_BLACK = 938, 76
"""Readings of a ground sensor on white and on black; source: means of 3,000 readings each in Enki 1.6.99."""
N_TRIED = 1000
"""Random sets of inputs from which the error in a program is."""
LEAST_SHOWN = 1e-6
"""Errors below it are shown as this one."""
_N_RANGE, _N_LINE = 7, 2
_SMALL = range(-0x800, 0x800)
"""Numbers that one word of bytecode pushes; larger ones need two."""
_OTHERS = frozenset(("obstacle", "stall", "time", "last_move", "last_turn"))
_FRAME = """<!DOCTYPE aesl-source>
<network>
<keywords flag="true"/>
<node nodeId="1" name="thymio-II">{text}</node>
</network>
"""


@dataclass
class _Code:
    """Statements of a program, and the words of bytecode that Aseba's compiler makes of them."""

    lines: list[str] = field(default_factory=list)
    n_words: int = 1
    n_variables: int = 0
    n_temporary: int = 0
    depth: int = 0

    def add(self, line: str, n_words: int = 0, n_temporary: int = 0) -> None:
        """Add a line.

        Args:
            line: The line.
            n_words: Number of its words of bytecode.
            n_temporary: Variables that the compiler makes for it, and forgets.
        """
        self.lines.append("  " * self.depth + line)
        self.n_words += n_words
        self.n_temporary = max(self.n_temporary, n_temporary)

    def begin(self, line: str, n_words: int = 0) -> None:
        """Add a line after which lines are set in."""
        self.add(line, n_words)
        self.depth += 1

    def end(self, line: str = "", n_words: int = 0) -> None:
        """Add a line that ends what the last `begin` began."""
        self.depth -= 1
        self.add(line, n_words)

    def declare(self, name: str, size: int = 1, values: Sequence[int] | None = None) -> None:
        """Add a variable, or an array of a size, with its first values."""
        self.n_variables += size
        text = name if size == 1 else f"{name}[{size}]"
        if values is None:
            self.add(f"var {text}")
        else:
            shown = f"{values[0]}" if size == 1 else f"[{', '.join(map(str, values))}]"
            self.add(f"var {text} = {shown}", sum(1 + _pushed(value) for value in values))

    def call(self, function: str, *arguments: str | int, n_sizes: int = 1) -> None:
        """Add a call of a native function; the compiler puts numbers among its arguments into variables."""
        numbers = [argument for argument in arguments if isinstance(argument, int)]
        n_words = sum(1 + _pushed(number) for number in numbers) + len(arguments) + n_sizes + 1
        self.add(f"call {function}({', '.join(map(str, arguments))})", n_words, len(numbers))


def _span(name: str, first: int, n: int) -> str:
    """Return the text of n entries of an array."""
    return f"{name}[{first}]" if n == 1 else f"{name}[{first}:{first + n - 1}]"


def _pushed(number: int) -> int:
    """Return the words of bytecode that push a number."""
    return 1 if number in _SMALL else 2


def to_aseba(
    network: Network,
    interface: ControllerInterface,
    *,
    steps: int = 100,
    step_s: float = 0.1,
    full_speed: int = FULL_SPEED,
    reading_max: int = READING_MAX,
    origin: Mapping[str, object] | None = None,
) -> str:
    """Return the network as a program of Aseba Studio (.aesl), with which a Thymio II drives without a computer.

    The center button starts and stops the robot. The network is computed in 16-bit integers; a comment says how far
    its outputs are from those of `Network.activate`. A network that sees `time` stops after `steps`.

    Args:
        network: The network; its memory is not exported.
        interface: Names of its inputs and outputs. A Thymio has `range.0` to `range.6`, `line.0`, `line.1`, and all
            computed inputs. Its `stall` is 0.
        steps: Commands of a trial, of which `time` is a share, 1 to 32,767.
        step_s: Duration of a command [s], 0.01 to 32.
        full_speed: Target of a wheel for a command of 1, 1 to 1000.
        reading_max: Infrared reading that counts as 1, 1 to 32,767.
        origin: Facts for the comment at the top, such as study and condition.

    Raises:
        ControllerError: A Thymio lacks an input.
        TypeError: Something other than a network, such as a genome.
        ValueError: A number is out of its range, the network has other inputs or outputs than the interface, it has no
            bound in 16 bits, or it is too large for a Thymio.
    """
    if not isinstance(network, Network):
        raise TypeError(f"network is {network!r}, expected a Network, such as genome.network().")
    for name, number, low, high in (
        ("steps", steps, 1, WORD),
        ("step_s", step_s, 0.01, 32),
        ("full_speed", full_speed, 1, 1000),
        ("reading_max", reading_max, 1, WORD),
    ):
        if not low <= number <= high:
            raise ValueError(f"{name} is {number}, expected {low:,} to {high:,}.")
    sensed = interface.sensed
    if (network.n_inputs, network.n_outputs) != (len(sensed), len(interface.outputs)):
        raise ValueError(
            f"The network has {network.n_inputs} inputs and {network.n_outputs} outputs, expected {len(sensed)} "
            f"({listed(sensed)}) and {len(interface.outputs)} ({listed(interface.outputs)})."
        )
    _check_inputs(sensed)
    fixed = fixed_point(network)
    code = _Code()
    _declare(code, fixed, sensed, step_s)
    if fixed.activation != "identity":
        _tangent(code)
    _events(code)
    _inputs(code, sensed, steps, reading_max)
    _nodes(code, fixed)
    _commands(code, fixed, interface, full_speed)
    code.add("done = done + 1", 4)
    if "time" in sensed:
        code.add(f"if done == {steps} then callsub halt end", 4 + _pushed(steps))
    code.end("", 1)
    n_variables = code.n_variables + code.n_temporary
    if code.n_words > MOST_WORDS or n_variables > MOST_VARIABLES:
        raise ValueError(
            f"The network is too large for a Thymio: its program has {code.n_words:,} words of bytecode and "
            f"{n_variables:,} of variables, expected at most {MOST_WORDS:,} and {MOST_VARIABLES:,}. Export a smaller "
            "one, or evolve with a smaller `add_node` and `add_link`."
        )
    head = _head(network, fixed.n_nodes, interface, steps, code.n_words, origin or {})
    return _FRAME.format(text=escape("\n".join((*head, *code.lines, ""))))


def aseba_error(network: Network, interface: ControllerInterface) -> tuple[float, float]:
    """Return how far outputs in 16-bit integers are from those of the network: the largest and the median difference.

    It is that of 1,000 steps with random inputs; outputs are limited to -1..1.

    Raises:
        ValueError: The network has no bound in 16 bits.
    """
    return errors(network, fixed_point(network), _tried(interface.sensed))


def _check_inputs(sensed: Sequence[str]) -> None:
    existing = _OTHERS | {f"range.{k}" for k in range(_N_RANGE)} | {f"line.{k}" for k in range(_N_LINE)}
    missing = [name for name in sensed if name not in existing]
    if missing:
        raise ControllerError(
            f"A Thymio has no {', '.join(missing)}. Expected range.0 to range.{_N_RANGE - 1}, line.0, line.1, "
            f"{', '.join(sorted(_OTHERS))}, and bias. Export a network with such inputs."
        )


def _head(
    network: Network,
    n_nodes: int,
    interface: ControllerInterface,
    steps: int,
    n_words: int,
    origin: Mapping[str, object],
) -> list[str]:
    """Return the comment at the top."""
    largest, median = aseba_error(network, interface)
    facts = [f"# {key}: {json.dumps(value)}." for key, value in origin.items()]
    ends = f" It stops by itself after {steps} steps." if "time" in interface.sensed else ""
    return [
        f"# A network of realitygap {__version__} for a Thymio II, in Aseba's language.",
        *facts,
        "#",
        f"# The center button starts and stops the robot.{ends}",
        f"# nodes[0..{n_nodes - 1}]: inputs, outputs, hidden nodes. {ONE} is 1.",
        f"# Inputs: {', '.join(interface.sensed)}.",
        f"# Outputs: {', '.join(interface.outputs)}.",
        f"# In {N_TRIED:,} steps with random inputs, outputs are off the network by at most {largest:.1g};",
        f"# half of them by less than {max(median, LEAST_SHOWN):.1g}. The program has {n_words:,} words of bytecode.",
        "",
    ]


def _tried(sensed: Sequence[str]) -> list[list[int]]:
    """Return random inputs as integers."""
    rng = np.random.default_rng(0)
    low = [-ONE if name.startswith("last_") else 0 for name in sensed]
    high = [0 if name == "stall" else ONE for name in sensed]
    return [[int(value) for value in rng.integers(low, high, endpoint=True)] for _ in range(N_TRIED)]


def _runs(sensed: Sequence[str], kind: str) -> list[tuple[int, int, int]]:
    """Return the parts in which the inputs of a kind have the order of the robot's sensors: input, sensor, number."""
    stretches: list[tuple[int, int, int]] = []
    for place, name in enumerate(sensed):
        if match := re.fullmatch(rf"{kind}\.(\d+)", name):
            sensor = int(match[1])
            if stretches and (place, sensor) == (sum(stretches[-1][::2]), sum(stretches[-1][1:])):
                stretches[-1] = (*stretches[-1][:2], stretches[-1][2] + 1)
            else:
                stretches.append((place, sensor, 1))
    return stretches


def _declare(code: _Code, fixed: FixedNetwork, sensed: Sequence[str], step_s: float) -> None:
    widest = max(
        [
            2,
            *(len(node.sources) + 1 for node in fixed.nodes),
            *(n for kind in ("range", "line") for _, _, n in _runs(sensed, kind)),
        ]
    )
    # the table of events and addresses: the start, the button, and the timer
    code.n_words += 6
    code.declare("done", 1, [0])
    code.declare("nodes", fixed.n_nodes)
    if fixed.is_recurrent:
        code.declare("before", fixed.n_nodes)
    code.declare("sources", widest)
    code.declare("weights", widest)
    code.declare("total")
    if any(node.excess for node in fixed.nodes):
        code.declare("far")
    if fixed.activation != "identity":
        for name in ("answer", "size", "entry", "rest", "part"):
            code.declare(name)
        code.declare("tangents", len(TABLE), TABLE)
    if "obstacle" in sensed:
        for name in ("low", "high", "mean"):
            code.declare(name)
    code.declare("command", 2)
    code.declare("wheels", 2)
    code.declare("running", 1, [0])
    code.add(f"timer.period[0] = {round(step_s * 1000)}", 1 + _pushed(round(step_s * 1000)))
    code.add("motor.left.target = 0", 2)
    code.add("motor.right.target = 0", 2)
    code.add("", 1)


def _tangent(code: _Code) -> None:
    """Add a subroutine: answer = ONE times the hyperbolic tangent of total / 4096."""
    half = 1 << (SPACING_BITS - 1)
    code.begin("sub tangent")
    code.add("size = abs(total)", 3)
    code.add(f"answer = {ONE}", 1 + _pushed(ONE))
    code.begin(f"if size <= {SATURATED} then", 3 + _pushed(SATURATED))
    code.add(f"entry = (size + {half}) >> {SPACING_BITS}", 6)
    code.add(f"rest = size - (entry << {SPACING_BITS})", 6)
    code.call("math.muldiv", "part", "rest", "rest", 8192)
    code.add(f"rest = 4 * rest - part * rest / {CUBE}", 10)
    code.add("size = tangents[entry]", 4)
    code.call("math.muldiv", "part", "size", "rest", ONE)
    code.add(f"part = part + {ONE}", 3 + _pushed(ONE))
    code.add("rest = size + rest", 4)
    code.call("math.muldiv", "answer", "rest", ONE, "part")
    code.end("end")
    code.add("if total < 0 then answer = -answer end", 4 + 3)
    code.end("", 1)


def _events(code: _Code) -> None:
    code.begin("sub halt")
    code.add("running = 0", 2)
    code.add("motor.left.target = 0", 2)
    code.add("motor.right.target = 0", 2)
    code.end("", 1)
    code.begin("onevent button.center")
    code.begin("if button.center == 1 then", 4)
    code.begin("if running == 1 then callsub halt else", 4 + 1 + 1)
    code.call("math.fill", "nodes", 0)
    code.add("command = [0, 0]", 4)
    code.add("done = 0", 2)
    code.add("running = 1", 2)
    code.end("end")
    code.end("end")
    code.end("", 1)
    code.begin("onevent timer0")
    code.add("if running == 0 then return end", 4 + 1)


def _inputs(code: _Code, sensed: Sequence[str], steps: int, reading_max: int) -> None:
    """Add the statements that put readings into the first nodes, as shares of ONE."""
    for place, sensor, n in _runs(sensed, "range"):
        _scaled(code, place, n, _span("prox.horizontal", sensor, n), reading_max)
    for place, sensor, n in _runs(sensed, "line"):
        nodes = _span("nodes", place, n)
        code.call("math.fill", nodes, GROUND_WHITE)
        code.call("math.sub", nodes, nodes, _span("prox.ground.delta", sensor, n))
        _scaled(code, place, n, nodes, GROUND_WHITE - GROUND_BLACK)
    for place, name in enumerate(sensed):
        if name == "obstacle":
            code.call("math.stat", "prox.horizontal", "low", "high", "mean")
            _scaled(code, place, 1, "high", reading_max)
        elif name == "time":
            code.call("math.muldiv", f"nodes[{place}]", "done", ONE, steps)
        elif name.startswith("last_"):
            code.add(f"nodes[{place}] = command[{int(name == 'last_turn')}]", 2)


def _scaled(code: _Code, place: int, n: int, source: str, most: int) -> None:
    """Add the statements that set nodes to readings, as shares of ONE, limited to 0..ONE."""
    nodes, low, high = _span("nodes", place, n), _span("sources", 0, n), _span("weights", 0, n)
    code.call("math.fill", high, ONE)
    code.call("math.fill", low, most)
    code.call("math.muldiv", nodes, source, high, low)
    code.call("math.fill", low, 0)
    code.call("math.clamp", nodes, nodes, low, high)


def _nodes(code: _Code, fixed: FixedNetwork) -> None:
    """Add the statements that compute all nodes in the order of activation."""
    if fixed.is_recurrent:
        code.call("math.copy", "before", "nodes")
    state = "before" if fixed.is_recurrent else "nodes"
    for node in fixed.nodes:
        _sum(code, node, state)
        if fixed.activation == "identity":
            code.add(f"nodes[{node.node}] = total", 2)
            continue
        code.add("callsub tangent", 1)
        if fixed.activation == "tanh":
            code.add(f"nodes[{node.node}] = answer", 2)
        else:
            code.add(f"nodes[{node.node}] = {ONE // 2} + (answer >> 1)", 5 + _pushed(ONE // 2))


def _sum(code: _Code, node: FixedNode, state: str) -> None:
    n = len(node.sources) + 1
    into, factors = _span("sources", 0, n), _span("weights", 0, n)
    sources = [f"{state}[{k}]" for k in node.sources]
    numbers = (*node.weights, node.constant[1])
    code.add(
        f"{into} = [{', '.join((*sources, str(node.constant[0])))}]",
        2 * n - 1 + _pushed(node.constant[0]),
    )
    code.add(
        f"{factors} = [{', '.join(map(str, numbers))}]",
        sum(1 + _pushed(number) for number in numbers),
    )
    if not node.excess:
        code.call("math.dot", "total", into, factors, node.shift)
        return
    code.call("math.dot", "far", into, factors, node.shift + node.excess)
    for sign, comparison, number in (("", ">", node.limit), ("-", "<", -node.limit)):
        code.add(
            f"{'else' if sign else ''}if far {comparison} {number} then total = {sign}{WORD}",
            3 + _pushed(number) + 3 + 1,
        )
    code.begin("else")
    code.call("math.dot", "total", into, factors, node.shift)
    code.end("end")


def _commands(code: _Code, fixed: FixedNetwork, interface: ControllerInterface, full_speed: int) -> None:
    """Add the statements that limit the outputs and set the targets of the motors."""
    bits = {node.node: node.bits for node in fixed.nodes}
    for k, output in enumerate(fixed.outputs):
        limit = 1 << max(bits[output], 0)
        code.add(f"command[{k}] = nodes[{output}]", 2)
        if fixed.activation == "identity":
            code.call("math.clamp", f"command[{k}]", f"command[{k}]", -limit, limit)
            code.add(f"command[{k}] = command[{k}] << {ONE_BITS - max(bits[output], 0)}", 4)
    if interface.drives_wheels:
        code.add("wheels[0] = command[0] / 2", 4)
        code.add("wheels[1] = command[1] / 2", 4)
        if any(name.startswith("last_") for name in interface.sensed):
            code.add("command[0] = wheels[0] + wheels[1]", 4)
            code.add("command[1] = wheels[1] - wheels[0]", 4)
    else:
        half = ONE // 2
        code.add("wheels[0] = command[0] / 2 - command[1] / 2", 8)
        code.add("wheels[1] = command[0] / 2 + command[1] / 2", 8)
        for k in range(2):
            code.call("math.clamp", f"wheels[{k}]", f"wheels[{k}]", -half, half)
    # above 0, a quotient towards zero and half a unit round to the nearest
    for k, side in enumerate(("left", "right")):
        code.add(f"wheels[{k}] = wheels[{k}] + {ONE // 2}", 3 + _pushed(ONE // 2))
        code.call("math.muldiv", f"wheels[{k}]", f"wheels[{k}]", 2 * full_speed, ONE // 2)
        code.add(f"motor.{side}.target = ((wheels[{k}] + 1) >> 1) - {full_speed}", 8)
