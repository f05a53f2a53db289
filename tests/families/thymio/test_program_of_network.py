"""Networks as programs of a Thymio: Aseba's compiler takes them, and its machine computes what the integers say."""

import re

import numpy as np
import pytest

from realitygap.errors import ControllerError
from realitygap.evolution import ControllerInterface, Network
from realitygap.families.thymio import Thymio, _robot, to_aseba
from realitygap.families.thymio._aseba import FULL_SPEED, GROUND_BLACK, GROUND_WHITE, MOST_WORDS, READING_MAX
from realitygap.families.thymio._fixed_point import ONE, SATURATED, errors, fixed_point, tangent
from realitygap.families.thymio._robot import FULL_SCALE

from ...evolution.test_export import IDS, KINDS, evolved
from . import aseba

compiled = pytest.mark.skipif(bool(aseba.why_not()), reason=aseba.why_not() or "-")
NODES = aseba.FIRST_FREE + 1
SETS = [
    ("range.2", "line.1", "time"),
    ("obstacle", "last_move", "last_turn"),
    ("range.5", "range.6", "stall"),
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("aseba")


def size_said(text):
    return int(re.search(r"has ([\d,]+) words", text)[1].replace(",", ""))


def named(network, inputs, outputs=("move", "turn")):
    return ControllerInterface((*inputs, "bias") if network.to_dict()["constant"] else inputs, outputs)


def network_of(nodes, **changes):
    """A network of hand-made nodes: two inputs, two outputs, and hidden nodes from 4 on."""
    values = {
        "format": "realitygap network",
        "version": evolved({})[0].network().to_dict()["version"],
        "activation": "tanh",
        "activation_slope": 1.0,
        "recurrent": False,
        "bias_value": 1.0,
        "n_inputs": 2,
        "n_outputs": 2,
        "constant": False,
        "nodes": [
            {"node": node, "bias": bias, "sources": list(edges), "weights": list(edges.values())}
            for node, bias, edges in nodes
        ],
    }
    return Network.from_dict(values | changes)


# the integers


def test_tangent_of_each_sum_is_within_three_units():
    sums = np.arange(-0x7FFF, 0x8000)
    found = np.array([tangent(int(each)) for each in sums])
    assert np.abs(found - ONE * np.tanh(sums / 4096)).max() < 3.0
    assert tangent(SATURATED + 1) == ONE


@pytest.mark.parametrize("bias", [False, True])
@pytest.mark.parametrize("changes", [KINDS[0], KINDS[1], KINDS[2], KINDS[3], KINDS[4]], ids=IDS)
def test_integers_are_near_the_network(changes, bias):
    draw = np.random.default_rng(3)
    for genome in evolved(changes, bias=bias):
        network = genome.network()
        given = draw.integers(-ONE, ONE, (200, 3), endpoint=True).tolist()
        largest, median = errors(network, fixed_point(network), given)
        assert largest < 0.02
        assert median < 1e-4


def test_sums_beyond_16_and_32_bits_saturate():
    for weight in (3.0, 60.0, 2000.0, 55_000.0):
        network = network_of([(2, 0.0, {0: weight, 1: -weight}), (3, weight / 3, {0: weight, 1: weight})])
        given = [
            [x, y]
            for x in (-ONE, -1, 0, ONE // 2, ONE)
            for y in (-ONE, -ONE // 2, 0, 1, ONE)
            if abs(x - y) != 1
        ]
        assert errors(network, fixed_point(network), given)[0] < 0.003, weight


def test_networks_without_a_bound_in_16_bits_are_refused():
    both = [(2, 0.0, {0: 1.0}), (3, 0.0, {1: 1.0})]
    with pytest.raises(ValueError, match="'identity' have no bound"):
        fixed_point(network_of(both, activation="identity", recurrent=True))
    with pytest.raises(ValueError, match="reaches 1e\\+06, expected at most 131,072"):
        fixed_point(network_of([(2, 0.0, {0: 1e6}), (3, 0.0, {1: 1.0})]))


def test_large_sums_of_identity_nodes_keep_their_place():
    nodes = [(4, 0.0, {0: 300.0, 1: -100.0}), (2, 0.1, {4: 0.002}), (3, 0.0, {4: 0.5, 0: 1.0})]
    network = network_of(nodes, activation="identity")
    given = np.random.default_rng(4).integers(0, ONE, (300, 2), endpoint=True).tolist()
    assert errors(network, fixed_point(network), given)[0] < 0.02


# what a Thymio cannot carry


def test_inputs_and_settings_that_a_thymio_lacks_are_refused_with_one_message():
    network = evolved({}, bias=False)[0].network()
    two = ControllerInterface(("range.0", "range.1"))
    for interface, options, error, said in (
        (
            named(network, ("range.0", "range.7", "light.0")),
            {},
            ControllerError,
            "no range.7, light.0. Expected",
        ),
        (named(network, SETS[0]), {"steps": 40_000}, ValueError, "steps is 40000, expected 1 to 32,767"),
        (named(network, SETS[0]), {"step_s": 0.0}, ValueError, "step_s is 0.0, expected 0.01 to 32"),
        (
            named(network, SETS[0]),
            {"full_speed": 1001},
            ValueError,
            "full_speed is 1001, expected 1 to 1,000",
        ),
        (two, {}, ValueError, r"has 3 inputs and 2 outputs, expected 2 \(range.0 to range.1\)"),
    ):
        with pytest.raises(error, match=said):
            to_aseba(network, interface, **options)
    with pytest.raises(TypeError, match="expected a Network"):
        to_aseba(evolved({})[0], two)


def chain(n):
    """A network of n hidden nodes, each of which sees all before it."""
    hidden = [(4 + k, 0.0, dict.fromkeys([0, 1, *range(4, 4 + k)], 0.5)) for k in range(n)]
    return network_of([*hidden, (2, 0.0, {0: 1.0}), (3, 0.0, {3 + n: 1.0})])


def test_the_largest_network_has_room_and_the_next_one_is_refused():
    interface = ControllerInterface(("range.0", "range.1"))
    assert size_said(to_aseba(chain(16), interface)) <= MOST_WORDS
    with pytest.raises(ValueError, match=r"too large for a Thymio: its program has 1,\d+ words of bytecode"):
        to_aseba(chain(17), interface)


def test_the_program_sees_what_the_driver_sees():
    assert FULL_SCALE == READING_MAX
    assert (GROUND_WHITE, GROUND_BLACK) == (_robot.GROUND_WHITE, _robot.GROUND_BLACK)
    network = evolved({}, bias=False)[0].network()
    text = aseba.source_of(to_aseba(network, named(network, SETS[0]), full_speed=300))
    assert f"timer.period[0] = {round(Thymio.__init__.__kwdefaults__['step_s'] * 1000)}" in text
    assert Thymio.__init__.__kwdefaults__["full_speed"] == FULL_SPEED


def test_facts_and_names_are_in_the_comment_and_end_no_line():
    network = evolved({}, bias=False)[0].network()
    text = to_aseba(
        network, named(network, SETS[0]), origin={"study": "a < b & \n]]> </node>", "replicate": 3}
    )
    source = aseba.source_of(text)
    assert '# study: "a < b & \\n]]> </node>".' in source.splitlines()
    assert "# Inputs: range.2, line.1, time." in source.splitlines()
    assert "stops by itself after 100 steps" in source


# the program


@compiled
@pytest.mark.slow
@pytest.mark.parametrize("outputs", [("move", "turn"), ("left", "right")], ids=["turn", "wheels"])
@pytest.mark.parametrize("changes", KINDS, ids=IDS)
def test_aseba_computes_the_integers_bit_for_bit(changes, outputs, folder):
    """30 steps each of six networks, with readings of any size."""
    draw = np.random.default_rng(5)
    for bias in (True, False):
        network = evolved(changes, bias=bias)[0].network()
        for inputs in SETS:
            interface = named(network, inputs, outputs)
            text = aseba.source_of(to_aseba(network, interface, steps=500))
            n_nodes = fixed_point(network).n_nodes
            readings = draw.choice([0, 1, 1000, 3000, 4505, 5000], (30, 7))
            ground = draw.choice([-3, 0, 100, 900, 1023], (30, 2))
            commands = press()
            for prox, floor in zip(readings, ground, strict=True):
                for name, values in (("prox.horizontal", prox), ("prox.ground.delta", floor)):
                    commands += [f"put {aseba.OFFSETS[name] + j} {value}" for j, value in enumerate(values)]
                commands += [f"event {aseba.local('timer0')}", f"get {NODES} {n_nodes}"]
                commands += [f"get {aseba.OFFSETS['motor.left.target']} 2"]
            done = aseba.run(text, commands, folder)
            assert len(done.words) == size_said(text)
            check_steps(network, interface, readings, ground, done.answers)


def press():
    at = aseba.OFFSETS["button.center"]
    button = aseba.local("button.center")
    return [f"event {aseba.START}", f"put {at} 1", f"event {button}", f"put {at} 0", f"event {button}"]


def check_steps(network, interface, readings, ground, answers):
    fixed = fixed_point(network)
    nodes, command, at_host = [0] * fixed.n_nodes, [0, 0], Network.from_dict(network.to_dict())
    for step, (prox, floor) in enumerate(zip(readings.tolist(), ground.tolist(), strict=True)):
        got, targets = answers[2 * step], answers[2 * step + 1]
        inputs = got[: fixed.n_inputs]
        wanted = host_inputs(interface.sensed, prox, floor, step, [value / ONE for value in command])
        assert np.abs(np.array(inputs) / ONE - wanted).max() < 2.1 / ONE
        nodes = fixed.step(inputs, nodes)
        constant = network.to_dict()["n_inputs"] - 1 if network.to_dict()["constant"] else -1
        assert [v for k, v in enumerate(got) if k != constant] == [
            v for k, v in enumerate(nodes) if k != constant
        ]
        outputs = at_host.activate([value / ONE for value in inputs])
        given = np.array(fixed.command(nodes)) / ONE
        assert np.abs(given - np.clip(outputs, -1, 1)).max() < 0.025  # identity is the least exact
        move, turn = interface.commands(given).tolist()
        command = [ONE * move, ONE * turn]
        wheels = np.clip([move - turn, move + turn], -1, 1) * FULL_SPEED
        assert np.abs(np.array(targets) - wheels).max() < 0.6


def host_inputs(names, prox, floor, step, command):
    ranges = [min(max(value / FULL_SCALE, 0.0), 1.0) for value in prox]
    values = {f"range.{k}": value for k, value in enumerate(ranges)}
    span = GROUND_WHITE - GROUND_BLACK
    values |= {
        f"line.{k}": min(max((GROUND_WHITE - value) / span, 0.0), 1.0) for k, value in enumerate(floor)
    }
    values |= {"obstacle": max(ranges), "stall": 0.0, "time": step / 500}
    values |= {"last_move": command[0], "last_turn": command[1]}
    return [values[name] for name in names]


@compiled
@pytest.mark.slow
def test_the_largest_network_compiles_to_the_words_that_were_counted(folder):
    text = aseba.source_of(to_aseba(chain(16), ControllerInterface(("range.0", "range.1"))))
    done = aseba.run(text, [], folder)
    assert len(done.words) == size_said(text)
    assert done.n_variables <= aseba.ROOM[1]


@compiled
@pytest.mark.slow
def test_the_button_starts_and_stops_and_time_ends_the_trial(folder):
    network = evolved({}, bias=False)[0].network()
    at, targets = aseba.OFFSETS["button.center"], f"get {aseba.OFFSETS['motor.left.target']} 2"
    step, button = f"event {aseba.local('timer0')}", f"event {aseba.local('button.center')}"

    def run(inputs, commands):
        text = aseba.source_of(to_aseba(network, named(network, inputs), steps=3))
        return aseba.run(text, [f"event {aseba.START}", *commands], folder).answers

    stands = [[0, 0]]
    assert run(SETS[0], [step, targets]) == stands
    down, up = [f"put {at} 1", button], [f"put {at} 0", button]
    drives = run(SETS[0], [*down, step, targets])
    assert drives != stands
    assert run(SETS[0], [*down, *up, step, targets]) == drives
    assert run(SETS[0], [*down, *up, step, *down, targets, *up, step, targets]) == stands * 2
    assert run(SETS[0], [*down, *up, step, step, step, targets, *down, *up, step, targets])[0] == [0, 0]
    assert run(SETS[0], [*down, *up, step, step, step, *down, *up, step, targets]) == drives
    assert run(SETS[2], [*down, *up, *[step] * 9, targets]) != stands
