"""A network as C99, for robots that carry it without a computer."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np

from realitygap._version import __version__
from realitygap.kernels.neat.network import IDENTITY_LIMIT

from ._export import check_network
from ._genome import Network
from ._interface import given_names

_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")

_WORDS = """
    alignas alignof and and_eq asm auto bitand bitor bool break case catch char char16_t char32_t class compl const
    const_cast constexpr continue decltype default delete do double dynamic_cast else enum explicit export extern false
    float for friend goto if inline int long mutable namespace new noexcept not not_eq nullptr operator or or_eq private
    protected public register reinterpret_cast restrict return short signed sizeof static static_assert static_cast
    struct switch template this thread_local throw true try typedef typeid typename union unsigned using virtual void
    volatile wchar_t while xor xor_eq main
"""
_RESERVED = frozenset(_WORDS.split()) | frozenset(
    f"{name}{kind}" for name in (*dir(math), "y0", "y1", "yn", "j0", "j1", "jn") for kind in ("", "f", "l")
)
"""Words of C and C++, and functions of math.h."""

_ACTIVATIONS = {
    "tanh": "return tanh{f}({slope} * x);",
    "sigmoid": "return {one} / ({one} + exp{f}(-{slope} * x));",
    "identity": "return x < -{limit} ? -{limit} : x > {limit} ? {limit} : x;",
}

_FRAME = """\
// A network of realitygap {version} as C99. It needs nothing but math.h.
{origin}//
// Inputs: {inputs}.
// Outputs: {outputs}.
//
//     {name} controller;
//     {name}_reset(&controller);                  // before each trial
//     {name}_step(&controller, inputs, outputs);  // in each step
//
// A robot limits the outputs to -1..1.

#ifndef {guard}_H
#define {guard}_H

#include <math.h>

typedef {real} {name}_real;

enum {{ {input_names}, {guard}_INPUTS }};
enum {{ {output_names}, {guard}_OUTPUTS }};

typedef struct {{
    {name}_real nodes[{n_nodes}]; // inputs, outputs, hidden nodes
}} {name};

static inline void {name}_reset({name} *self) {{
    for (int k = 0; k < {n_nodes}; k++) self->nodes[k] = {zero};
}}

static inline {name}_real {name}_answer({name}_real x) {{
    {activation}
}}

static inline void {name}_step({name} *self, const {name}_real inputs[{guard}_INPUTS],
                               {name}_real outputs[{guard}_OUTPUTS]) {{
    {name}_real *now = self->nodes;
    {name}_real x;
    for (int k = 0; k < {guard}_INPUTS; k++) now[k] = inputs[k];
{body}
    for (int k = 0; k < {guard}_OUTPUTS; k++) outputs[k] = now[{first_output} + k];
}}

#endif
"""

_BEFORE = """\
    {name}_real before[{n_nodes}]; // a recurrent network sees other nodes as they were after the step before
    for (int k = 0; k < {n_nodes}; k++) before[k] = now[k];"""


def to_c(
    network: Network,
    input_names: Sequence[str] | None = None,
    output_names: Sequence[str] | None = None,
    *,
    precision: Literal["double", "single"] = "double",
    name: str = "network",
    origin: Mapping[str, object] | None = None,
) -> str:
    """Return the network as a header of C99, which any C or C++ program can include.

    It has a type for the state of the network, a function that resets it, and a function that computes one step. In
    double precision the outputs are those of `Network.activate` but for rounding, below 1e-12; in single precision,
    which suits small processors, below 1e-4 for a feed-forward network.

    Args:
        network: Network of any genome. Its memory is not exported.
        input_names: Names of the inputs to be given, without the constant one; they become constants.
        output_names: Names of the outputs.
        precision: Type of all numbers: double or single (float).
        name: Prefix of all types, functions and constants.
        origin: Facts for the comment at the top, such as study and condition.

    Raises:
        TypeError: Something other than a network, such as a genome.
        ValueError: Another number of names than of inputs or outputs, an unknown precision, or a name that C does not
            take.
    """
    check_network(network, precision)
    if not _IDENTIFIER.fullmatch(name) or name in _RESERVED:
        raise ValueError(f"name is {name!r}, expected a name that C takes, such as 'network'.")
    if network.n_inputs == 0:
        raise ValueError(
            "This network has no inputs but the constant one, so its outputs are constants, too."
        )
    inputs = given_names("input_names", input_names, range(network.n_inputs))
    outputs = given_names("output_names", output_names, range(network.n_outputs))
    values = network.to_dict()
    single = precision == "single"
    guard = name.upper()
    n_nodes = 1 + max([values["n_inputs"] - 1, *(node["node"] for node in values["nodes"])])
    common = {"name": name, "guard": guard, "n_nodes": n_nodes}
    activation = _ACTIVATIONS[values["activation"]].format(
        f="f" if single else "",
        slope=_number(values["activation_slope"], single),
        one=_number(1.0, single),
        limit=_number(IDENTITY_LIMIT, single),
    )
    return _FRAME.format(
        **common,
        version=__version__,
        origin="".join(f"// {key}: {json.dumps(value)}.\n" for key, value in (origin or {}).items()),
        inputs=_in_comment(inputs),
        outputs=_in_comment(outputs),
        real="float" if single else "double",
        input_names=", ".join(_constants(guard, "IN", inputs)),
        output_names=", ".join(_constants(guard, "OUT", outputs)),
        zero=_number(0.0, single),
        activation=activation,
        body=_body(values, common, single=single),
        first_output=values["n_inputs"],
    )


def _in_comment(names: Sequence[str]) -> str:
    """Return names in ASCII, on one line."""
    return ", ".join(json.dumps(name)[1:-1] for name in names)


def _constants(guard: str, kind: str, names: Sequence[str]) -> list[str]:
    """Return a constant for each input or output, with numbers if two would be equal."""
    words: list[str] = []
    for k, name in enumerate(names):
        word = f"{guard}_{kind}_" + re.sub(r"[^A-Z0-9]", "_", name.upper())
        while word in words:
            word += f"_{k}"
        words.append(word)
    return words


def _number(value: float, single: bool) -> str:
    """Return a number of C that has the same value."""
    text = str(np.float32(value)) + "f" if single else repr(float(value))
    return text if "." in text or "e" in text else text.replace("f", ".0f")


def _body(values: Mapping[str, Any], common: Mapping[str, Any], *, single: bool) -> str:
    """Return the statements that compute all nodes in the order of their activation."""
    constant = values["n_inputs"] - 1 if values["constant"] else -1
    lines = []
    if values["constant"]:
        lines.append(f"    now[{constant}] = {_number(values['bias_value'], single)};")
    seen = "before" if values["recurrent"] else "now"
    if values["recurrent"] and any(node["sources"] for node in values["nodes"]):
        lines.append(_BEFORE.format(**common))
    for node in values["nodes"]:
        lines.append(f"    x = {_number(node['bias'], single)};")
        lines += [
            f"    x += {_number(weight, single)} * {seen}[{source}];"
            for source, weight in zip(node["sources"], node["weights"], strict=True)
        ]
        lines.append(f"    now[{node['node']}] = {common['name']}_answer(x);")
    return "\n".join(lines)
