"""Networks that drive a Thymio of Aseba's playground without a computer, and the same networks at the host."""

import os
import shutil
import subprocess
import time
from dataclasses import replace

import numpy as np
import pytest

from realitygap.evolution import ControllerInterface, Network
from realitygap.families.thymio import Playground, to_aseba
from realitygap.families.thymio import _messages as messages
from realitygap.families.thymio._fixed_point import ONE, fixed_point
from realitygap.families.thymio._link import Link
from realitygap.families.thymio._messages import Kind
from realitygap.families.thymio._ports import open_port
from realitygap.families.thymio.playground._playground import why_not
from realitygap.world import Pose, paper_arena

from ...evolution.test_export import KINDS, evolved
from . import aseba

REASON = why_not() or aseba.why_not()
pytestmark = [pytest.mark.long, pytest.mark.skipif(bool(REASON), reason=REASON or "-")]
INTERFACE = ControllerInterface(("range.1", "range.2", "range.3"), ("left", "right"))
ARENA = replace(paper_arena(), start=Pose(0.5, 0.3, 0.1))
N_STEPS = 60
STEP_S = 0.1


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("aseba")


@pytest.mark.parametrize("changes", [KINDS[0], KINDS[1], KINDS[3]], ids=["sigmoid", "tanh", "recurrent tanh"])
def test_the_robot_computes_each_step_as_the_network_does(changes, folder):
    network = evolved(changes, bias=False)[1].network()
    fixed = fixed_point(network)
    with Playground(ARENA) as playground:
        port = open_port(playground.port)
        link = Link(port, playground.port)
        try:
            robot = link.find()
            text = aseba.source_of(to_aseba(network, INTERFACE))
            sizes = {name: size for name, (_, size) in robot.variables.items()}
            room = (robot.room, robot.first_free + 512, 32)
            words = aseba.run(text, [], folder, sizes, robot.events, room).words
            for start in range(0, len(words), 200):
                port.write(messages.set_bytecode(robot.node, start, words[start : start + 200]))
            port.write(messages.control(Kind.RESET, robot.node))
            port.write(messages.control(Kind.RUN, robot.node))
            time.sleep(0.3)
            stands = playground.pose()
            assert not any(link.read(robot, (robot.first_free, 1 + fixed.n_nodes))[0])
            playground.press(2)
            seen = watched(link, robot, fixed)
            assert playground.pose() != stands
            playground.press(2, False)
            playground.press(2)
            time.sleep(0.1)
            assert link.read(robot, (robot.offsets["motor.left.target"], 2)) == [(0, 0)]
            stands = playground.pose()
            time.sleep(0.3)
            assert playground.pose() == stands
        finally:
            link.close()
    compare(network, fixed, seen)


def watched(link, robot, fixed):
    """The number of steps, the nodes, and with a recurrent network the nodes before, after each step that is seen."""
    n_read = 1 + fixed.n_nodes * (1 + fixed.is_recurrent)
    seen, until = {}, time.monotonic() + N_STEPS * STEP_S
    while time.monotonic() < until:
        ((done, *values),) = link.read(robot, (robot.first_free, n_read))
        if done:
            assert seen.setdefault(done, values) == values
    assert len(seen) > N_STEPS / 2
    return seen


def compare(network, fixed, seen):
    n, size = fixed.n_inputs, fixed.n_nodes
    twin, differences = Network.from_dict(network.to_dict()), []
    for k, (done, values) in enumerate(seen.items(), 1):
        nodes = values[:size]
        before = values[size:] if fixed.is_recurrent else [0] * size
        assert fixed.step(nodes[:n], before) == nodes
        if fixed.is_recurrent and done != k:
            continue  # a step was not seen, and the network at the host has another memory from here on
        outputs = twin.activate([value / ONE for value in nodes[:n]])
        found = np.array(fixed.command(nodes)) / ONE
        differences.append(np.abs(found - np.clip(outputs, -1, 1)).max())
    print(f"{len(differences)} steps, largest difference {max(differences):.2g}")
    assert len(differences) > N_STEPS / 4
    # what a recurrent network remembers adds up
    assert np.median(differences) < 0.001
    assert fixed.is_recurrent or max(differences) < 0.005


@pytest.mark.skipif(shutil.which("asebamassloader") is None, reason="needs asebamassloader")
def test_asebas_own_loader_takes_the_file_and_the_button_starts_and_stops(folder):
    """The loader needs a locale that may be missing."""
    aseba.built(folder)
    file = folder / "network.aesl"
    network = evolved(KINDS[1], bias=False)[1].network()
    file.write_text(to_aseba(network, INTERFACE))
    with Playground(ARENA) as playground:
        host, port = playground.port.removeprefix("socket://").split(":")
        done = subprocess.run(
            ["asebamassloader", "--once", file, f"tcp:host={host};port={port}"],
            env={**os.environ, "LOCPATH": str(folder)},
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
        assert "bytecodes loaded to target thymio-II" in done.stderr
        link = Link(open_port(playground.port), playground.port)
        try:
            robot = link.find()
            stands = playground.pose()
            playground.press(2)
            time.sleep(1.0)
            assert playground.pose() != stands
            playground.press(2, False)
            playground.press(2)
            time.sleep(0.2)
            assert link.read(robot, (robot.offsets["motor.left.target"], 2)) == [(0, 0)]
        finally:
            link.close()
