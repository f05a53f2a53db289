"""Random and mutated bytes: no crash, no hang, no memory without bounds, and a robot that can be used afterwards."""

import random
import traceback

import pytest

from realitygap.families.scribbler.emulator import Emulator, Faults

from .wire import SET_UPS, packet, say

OPENING = [
    packet(80),
    bytes((11, 213)),
    bytes((131, 18, 20)),
    bytes((127, 0, 3, 0, 128, 191, 2, 1)),
    bytes((127, 0, 0, 3, 0, 0, 2, 128, 3, 31, 2, 1)),
    bytes((118, 90, 4, 0, 255, 51, 136, 190, 255)),
    packet(98),
    packet(109, 150, 120),
    packet(113, 0, 30, 3, 16),
    packet(162, 5, 0, 100, 0, 100),
    packet(163, 3, 0, 100, 0, 100, 0, 80),
    bytes((151, 3, 1, 2, 3)),
    bytes((138, 1)),
    bytes((88, 0)),
]


def mutated(dice):
    """A command with some of its bytes changed, lost or doubled, or plain noise."""
    if dice.random() < 0.3:
        return dice.randbytes(dice.randrange(1, 30))
    data = bytearray(b"".join(dice.choices(OPENING, k=dice.randrange(1, 4))))
    for _ in range(dice.randrange(4)):
        place = dice.randrange(len(data)) if data else 0
        kind = dice.randrange(3)
        if kind == 0 and data:
            data[place] = dice.randrange(256)
        elif kind == 1 and data:
            del data[place]
        else:
            data.insert(place, dice.randrange(256))
    return bytes(data)


PAUSES = (0.0, 0.0, 0.001, 0.05, 1.5)


def hurl(model, fluke, n, seed, faults=None, pauses=PAUSES):
    """Throw n strings at a robot, one new robot for each thousand; how many bytes came back."""
    dice = random.Random(seed)
    came = 0
    for k in range(n):
        if k % 1000 == 0:
            robot = Emulator(model, fluke, seed=seed, timing=dice.random() < 0.5, faults=faults)
            if robot.fluke is not None:
                robot.fluke._camera.set_size(64, 48)  # small pictures: it is the bytes that are tried
                robot.fluke._camera.set_size = lambda *_: None
        robot.receive(mutated(dice))
        robot.advance(dice.choice(pauses))
        came += len(robot.transmit())
        assert len(robot._incoming) < 100_000
        assert len(robot._events) < 1000
        assert len(robot.robot._packets) <= 64
        assert robot.fluke is None or len(robot.fluke._held) < 100_000
    return came


@pytest.mark.parametrize(("model", "fluke"), SET_UPS)
def test_emulator_survives_ten_thousand_random_and_mutated_strings(model, fluke):
    assert hurl(model, fluke, 10_000 // len(SET_UPS) + 1, 1) > 10_000


def test_emulator_survives_random_strings_over_a_link_with_faults():
    hurl("s2", "2", 1000, 2, Faults(drop=0.05, extra=0.05, flip=0.05, delay=0.1, hangup=20.0, sag=0.4))


@pytest.mark.long
@pytest.mark.parametrize(("model", "fluke"), SET_UPS)
def test_emulator_survives_a_million_random_and_mutated_strings(model, fluke):
    pauses = (0.0,) * 12 + PAUSES
    assert hurl(model, fluke, 1_000_000 // len(SET_UPS) + 1, 3, pauses=pauses) > 100_000


@pytest.mark.parametrize(("model", "fluke"), SET_UPS)
def test_after_noise_the_known_way_out_leads_back_into_step(model, fluke):
    """Silence, single zeros until an echo comes, silence, then 98 0: what section 11 of the protocol advises."""
    dice = random.Random(4)
    for _ in range(20):
        robot = Emulator(model, fluke, seed=1)
        noise = bytes(
            byte for byte in dice.randbytes(dice.randrange(1, 60)) if byte not in (134, 151, 155, 139)
        )
        say(robot, noise, 200.0)
        for _ in range(300):
            if len(say(robot, bytes(1), 0.05)) >= 9:
                break
        robot.advance(2.0)
        robot.transmit()
        # behind a Fluke an argument of one of its own commands may still be missing: ask until the count is right
        answers = [say(robot, packet(98, 0), 3.0) for _ in range(3)]
        assert len(answers[-1]) == 20, (noise, answers)


def test_many_packets_that_waited_are_carried_out_one_after_another():
    """They were once carried out within each other, until Python's stack was full."""
    robot = Emulator("s2", "none", timing=False)
    depths = []
    robot.senses.line = lambda: (depths.append(len(traceback.extract_stack())), (False, False))[1]
    for _ in range(2):
        robot.receive(packet(162, 5, 0, 50, 0, 50))
    robot.receive(packet(65) * 60)
    robot.advance(60.0)
    assert len(depths) == 62
    assert max(depths) < min(depths) + 12
    assert robot.transmit()[-20:-11] == packet(65)


def test_bytes_that_nobody_reads_are_bounded():
    robot = Emulator("s2", "2", timing=False)
    for _ in range(20):
        robot.receive(b"\x53")
    assert robot._line._n_waiting <= 8 << 20


def test_bytes_that_come_too_fast_are_bounded():
    robot = Emulator("s2", "none")
    for _ in range(40):
        robot.receive(bytes(1 << 16))
    assert len(robot._incoming) <= 1 << 20


def test_the_path_is_bounded():
    robot = Emulator("s2", "none", timing=False)
    import realitygap.families.scribbler.emulator._table as table

    before = table.MOST_POINTS
    table.MOST_POINTS = 1000
    try:
        robot.place((0.5, 0.3, 0.0), 1)
        say(robot, packet(109, 180, 100), 60.0)
        assert len(robot.table.points) <= 4 * 1000 + 4
        assert robot.cells()
    finally:
        table.MOST_POINTS = before


def test_bytes_that_come_while_a_fluke_works_are_bounded():
    robot = Emulator("s2", "2")
    for _ in range(60):
        robot.receive(b"\x55" * 5000)  # an obstacle reading each, which takes 40 ms
        robot.advance(0.1)
    assert len(robot.fluke._held) <= 1 << 16
    assert len(robot.fluke._held) + len(robot._incoming) > 1 << 15
