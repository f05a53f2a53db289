"""Networks as C, compiled by a real compiler and compared with the network in Python."""

from __future__ import annotations

import shutil
import subprocess

import numpy as np
import pytest

from realitygap.evolution import Network, to_c

from .test_export import IDS, KINDS, answers, evolved

COMPILER = shutil.which("cc")
compiled = pytest.mark.skipif(COMPILER is None, reason="needs a C compiler, cc, on the PATH")

PROGRAM = """
#include <stdio.h>
{networks}
int main(void) {{
{calls}
    return 0;
}}
"""
CALL = """
    {{
        {name} controller;
        double given[6][3] = {{{given}}};
        {name}_reset(&controller);
        for (int step = 0; step < 6; step++) {{
            {name}_real inputs[{guard}_INPUTS], outputs[{guard}_OUTPUTS];
            for (int k = 0; k < {guard}_INPUTS; k++) inputs[k] = ({name}_real)given[step][k];
            {name}_step(&controller, inputs, outputs);
            for (int k = 0; k < {guard}_OUTPUTS; k++) printf("%.17g\\n", (double)outputs[k]);
        }}
    }}"""


def run_in_c(networks, tmp_path, **options):
    """(n, 6, 2) outputs of networks, given the inputs that `answers` gives, from one program with all of them."""
    given = np.random.default_rng(0).uniform(-1, 1, (6, 3))
    rows = ", ".join("{" + ", ".join(map(repr, row.tolist())) + "}" for row in given)
    names = [f"net_{k}" for k in range(len(networks))]
    headers = [to_c(each, name=name, **options) for name, each in zip(names, networks, strict=True)]
    calls = [CALL.format(name=name, guard=name.upper(), given=rows) for name in names]
    source = tmp_path / "networks.c"
    source.write_text(PROGRAM.format(networks="\n".join(headers), calls="\n".join(calls)))
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O2"]
    subprocess.run([COMPILER, *flags, source, "-o", tmp_path / "networks", "-lm"], check=True)
    printed = subprocess.run([tmp_path / "networks"], check=True, capture_output=True, text=True).stdout
    return np.array(printed.split(), float).reshape(len(networks), 6, 2)


@compiled
@pytest.mark.parametrize("bias", [False, True])
@pytest.mark.parametrize("changes", KINDS, ids=IDS)
def test_the_program_answers_as_the_network_does(changes, bias, tmp_path):
    networks = [genome.network() for genome in evolved(changes, bias=bias)]
    wanted = np.array([answers(each) for each in networks])
    assert run_in_c(networks, tmp_path) == pytest.approx(wanted, rel=1e-12, abs=1e-12)


@compiled
@pytest.mark.parametrize("changes", [KINDS[0], KINDS[1], KINDS[4]], ids=["sigmoid", "tanh", "identity"])
def test_single_precision_is_near_it(changes, tmp_path):
    networks = [genome.network() for genome in evolved(changes)]
    wanted = np.array([answers(each) for each in networks])
    assert run_in_c(networks, tmp_path, precision="single") == pytest.approx(wanted, rel=1e-4, abs=1e-4)


def test_names_become_constants_and_facts_a_comment():
    (genome, *_) = evolved({})
    text = to_c(
        genome.network(),
        ["range.0", "range-0", "time"],
        ["move", "turn"],
        name="avoid",
        origin={"study": "a */ b\n#error", "condition": 'c"\\'},
    )
    assert "enum { AVOID_IN_RANGE_0, AVOID_IN_RANGE_0_1, AVOID_IN_TIME, AVOID_INPUTS };" in text
    assert "enum { AVOID_OUT_MOVE, AVOID_OUT_TURN, AVOID_OUTPUTS };" in text
    assert r'// study: "a */ b\n#error".' in text
    assert not any(line.startswith("#error") for line in text.splitlines())


def hand_made(**changes):
    """A network of three inputs that has an output without edges, an edge between outputs and an unused input."""
    values = evolved({}, bias=False)[0].network().to_dict()
    nodes = [
        {"node": 5, "bias": 0.25, "sources": [0, 2], "weights": [3.5, -1e-3]},
        {"node": 3, "bias": -0.5, "sources": [2, 5], "weights": [40.0, -0.0]},
        {"node": 4, "bias": 0.75, "sources": [], "weights": []},
    ]
    return Network.from_dict(values | {"nodes": nodes, "activation_slope": 1.0} | changes)


CORNERS = [
    {"activation": activation, "recurrent": recurrent, **more}
    for activation in ("tanh", "sigmoid", "identity")
    for recurrent in (False, True)
    for more in (
        {"activation_slope": 4.9},
        {
            "constant": True,
            "n_inputs": 4,
            "bias_value": -2.5,
            "nodes": [
                {"node": 6, "bias": 0.0, "sources": [3, 0], "weights": [1.5, -0.5]},
                {"node": 4, "bias": 0.1, "sources": [3, 6], "weights": [-1.0, 1e8]},
                {"node": 5, "bias": 0.0, "sources": [3], "weights": [1.0]},
            ],
        },
        {"nodes": [{"node": node, "bias": 0.5, "sources": [], "weights": []} for node in (3, 4)]},
    )
]
CORNERS += [
    {"activation": activation, "recurrent": True, "nodes": [
        {"node": 5, "bias": 0.0, "sources": [0, 4, 5], "weights": [1.0, 2.0, -3.0]},
        {"node": 3, "bias": 0.0, "sources": [4, 5], "weights": [1.0, 0.5]},
        {"node": 4, "bias": 0.0, "sources": [1, 3], "weights": [1.0, -1.5]},
    ]}
    for activation in ("tanh", "sigmoid", "identity")
]  # fmt: skip


@compiled
def test_hand_made_corners_answer_as_in_python(tmp_path):
    networks = [hand_made(**changes) for changes in CORNERS]
    wanted = np.array([answers(each) for each in networks])
    assert run_in_c(networks, tmp_path) == pytest.approx(wanted, rel=1e-12, abs=1e-12)


@compiled
def test_names_that_c_does_not_take_compile_without_a_warning(tmp_path):
    """Equal names once gave equal constants, and a name with the end of a line broke the comment."""
    network = hand_made()
    wild = [["x_2", "x", "x"], ["\u00e9", "\u00df", "a*/b"], ["a\nb", "c\\", "??/"], ["", " ", "1"]]
    headers = [to_c(network, inputs, ["left", "right"], name=f"x{k}") for k, inputs in enumerate(wild)]
    assert all(text.isascii() for text in headers)
    checks = " + ".join(f"(X{k}_INPUTS != 3)" for k in range(len(wild)))
    for compiler, standard, kind in (("cc", "c99", "c"), ("c++", "c++11", "cpp")):
        source = tmp_path / f"names.{kind}"
        source.write_text("\n".join([*headers, f"int main(void) {{ return {checks}; }}\n"]))
        flags = [f"-std={standard}", "-Wall", "-Wextra", "-Werror", "-pedantic"]
        subprocess.run([compiler, *flags, source, "-o", tmp_path / "names", "-lm"], check=True)
        subprocess.run([tmp_path / "names"], check=True)


def test_wrong_arguments_are_refused():
    network = evolved({})[0].network()
    with pytest.raises(TypeError, match="expected a Network"):
        to_c(evolved({})[0])
    for options, said in (
        ({"precision": "half"}, "expected 'double' or 'single'"),
        ({"name": "a b"}, "a name that C takes"),
        ({"name": "double"}, "name is 'double', expected a name that C takes"),
        ({"name": "class"}, "a name that C takes"),
        ({"name": "tanh"}, "a name that C takes"),
        ({"input_names": ["x"]}, "input_names has 1 names, expected 3"),
        ({"output_names": ["x"]}, "output_names has 1 names, expected 2"),
    ):
        with pytest.raises(ValueError, match=said):
            to_c(network, **options)
