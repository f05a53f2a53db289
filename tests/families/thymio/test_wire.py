"""The link to a Thymio: exact bytes, then lost, added, late and random ones, and ports that are gone."""

import random
from types import SimpleNamespace

import pytest

from realitygap.errors import RobotError, RobotTimeout
from realitygap.families.thymio import Thymio, _clock, _link, _robot
from realitygap.families.thymio._link import Description, Link
from realitygap.families.thymio._messages import Kind, Message
from realitygap.robots import Command

from ...robots.ports import BufferPort, Wire
from .peers import EVENTS, FIRST_FREE, LEFT, OFFSETS, PROX, VARIABLES, FakePort, FakeThymio, text

STILL = (0, 0)


@pytest.fixture
def on_its_clock(monkeypatch):
    """Give the driver the clock of a port."""

    def use(port):
        clock = SimpleNamespace(monotonic=port.clock.now, sleep=port.clock.sleep)
        monkeypatch.setattr(_link, "time", clock)
        monkeypatch.setattr(_robot, "time", clock)
        monkeypatch.setattr(_clock, "time", clock)
        return port

    return use


class ScriptedPort(BufferPort):
    """Expects exactly these bytes, each write as one, and answers with these."""

    def __init__(self, *script):
        super().__init__()
        self.timeout = 0.02
        self.script = [(bytes.fromhex(sent), bytes.fromhex(answer)) for sent, answer in script]

    def write(self, data):
        assert self.script, f"{data.hex(' ')} was sent after the end of the script"
        sent, answer = self.script.pop(0)
        assert data == sent, f"{data.hex(' ')} was sent, the script has {sent.hex(' ')}"
        self.incoming += answer
        return len(data)

    def check_all_said(self):
        assert not self.script
        assert not self.incoming


def described(n=1):
    places = {name: (OFFSETS[name], size) for name, size in VARIABLES.items()}
    return Description("thymio-II", n, places, EVENTS, FIRST_FREE, 1534)


# exact bytes

DESCRIPTION = (
    "1800 0100 0090 09 7468796d696f2d4949 0500 fe05 2000 6c02 0200 0100 0000"
    "0600 0100 0190 0100 03 5f6964"
    "0a00 0100 0190 0700 07 70726f782e6878"
    "0a00 0100 0290 04 70726f78 04 31304879"
)
FOUND = ("0200 0000 11a0 0500", "0200 0100 0c90 0500"), ("0400 0000 10a0 0100 0500", DESCRIPTION)


def test_a_robot_is_found_and_described_with_exactly_these_bytes(on_its_clock):
    port = on_its_clock(ScriptedPort(*FOUND))
    robot = Link(port, "a port").find()
    assert robot == Description("thymio-II", 1, {"_id": (0, 1), "prox.hx": (1, 7)}, ("prox",), 8, 1534)
    port.check_all_said()


CALLS = [
    (
        lambda link, robot: link.read(robot, (42, 3)),
        [("0600 0000 0ba0 0100 2a00 0300", "0800 0100 0590 2a00 38ff 0000 a911")],
        [(-200, 0, 4521)],
    ),
    (
        lambda link, robot: [len(words) for words in link.read(robot, (10, 50), (99, 2))],
        [
            (
                "0600 0000 0ba0 0100 0a00 2800"
                + "0600 0000 0ba0 0100 3200 0a00"
                + "0600 0000 0ba0 0100 6300 0200",
                "5200 0100 0590 0a00"
                + "0100" * 40
                + "1600 0100 0590 3200"
                + "0200" * 10
                + "0600 0100 0590 6300 0300 0400",
            ),
        ],
        [50, 2],
    ),
    (
        lambda link, robot: link.write(robot, 8, [-200, 300]),
        [
            ("0800 0000 0ca0 0100 0800 38ff 2c01", ""),
            ("0600 0000 0ba0 0100 0800 0200", "0600 0100 0590 0800 38ff 2c01"),
        ],
        None,
    ),
    (lambda link, robot: link.emit(0, [100, -100, 15]), [("0800 0000 0000 6400 9cff 0f00 e104", "")], None),
    (lambda link, robot: link.reset(robot), [("0200 0000 02a0 0100", "")], None),
    # an event, another robot's answer and an answer of another place come before
    (
        lambda link, robot: link.read(robot, (42, 1)),
        [
            (
                "0600 0000 0ba0 0100 2a00 0100",
                "0400 0100 0100 0500 0600 0400 0200 0590 2a00 0900 0400 0100 0590 2b00 0800 0400 0100 0590 2a00 0700",
            )
        ],
        [(7,)],
    ),
]


@pytest.mark.parametrize(("call", "script", "value"), CALLS)
def test_a_call_sends_exactly_these_bytes_and_understands_the_answer(call, script, value, on_its_clock):
    port = on_its_clock(ScriptedPort(*script))
    assert call(Link(port, "a port"), described()) == value
    port.check_all_said()
    assert port.clock.now() == 0.0


def test_the_program_is_loaded_in_pieces_that_fit_and_started(on_its_clock):
    port = on_its_clock(FakePort())
    Link(port, "a port").load(described())
    *pieces, reset, run = port.writes
    assert (reset, run) == (bytes.fromhex("0200 0000 02a0 0100"), bytes.fromhex("0200 0000 03a0 0100"))
    assert pieces[0][:10] == bytes([len(pieces[0]) - 6, 0, 0, 0, 1, 0xA0, 1, 0, 0, 0])
    assert sorted(port.robot.program) == list(range(len(port.robot.program)))
    assert port.robot.runs


# faults

FAULTS = {
    "lost": lambda byte: b"",
    "doubled": lambda byte: bytes((byte, byte)),
    "stray": lambda byte: bytes((byte, 200)),
    "zero": lambda byte: bytes((0, byte)),
}


def scene(robot):
    """What a program may do, whose every value is known."""
    robot.drive(Command(0.5, -0.25))
    seen = [robot.observe().raw for _ in range(2)]
    robot.drive(Command(0.5, -0.25))
    return seen


def undisturbed(on_its_clock):
    port = on_its_clock(FakePort())
    with Thymio(port) as robot:
        assert scene(robot) == [PROX, PROX]
    return port.wire


def check_faults(direction, fault, every, on_its_clock):
    """Each n-th byte of a session is damaged in turn; a motor may turn only while no program is on board."""
    n_right = 0
    places = range(0, getattr(undisturbed(on_its_clock), f"n_{direction}"), every)
    for at in places:
        change = {
            direction: lambda number, byte, at=at: FAULTS[fault](byte) if number == at else bytes((byte,))
        }
        port = on_its_clock(FakePort(wire=Wire(**change)))
        try:
            with Thymio(port) as robot:
                assert scene(robot) == [PROX, PROX], at
            n_right += 1
            assert port.robot.motors(port.clock.now()) == STILL, at
        except RobotError:
            assert not port.is_open, at
        assert port.clock.now() < 60, at
        if port.robot.runs:
            assert port.robot.motors(port.clock.now() + 1.0) == STILL, at
    return n_right / len(places)


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
def test_one_damaged_byte_of_an_answer_changes_no_value(fault, on_its_clock):
    assert check_faults("to_host", fault, 19, on_its_clock) > 0.98


@pytest.mark.long
@pytest.mark.parametrize("fault", FAULTS)
def test_any_damaged_byte_of_an_answer_changes_no_value(fault, on_its_clock):
    assert check_faults("to_host", fault, 1, on_its_clock) > 0.98


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
def test_a_damaged_question_is_one_error_and_the_motors_stop(fault, on_its_clock):
    check_faults("to_robot", fault, 7, on_its_clock)


def test_a_robot_that_turns_while_its_program_cannot_start_is_stopped(on_its_clock):
    """Its own remote control may turn the wheels before the program on board runs."""
    port = on_its_clock(FakePort())
    answer = port.robot.answer

    def turning(message, now):
        if message.kind != Kind.RUN:
            return answer(message, now)
        port.robot.memory[LEFT] = 100
        return b""

    port.robot.answer = turning
    with pytest.raises(RobotError, match="program does not run"):
        Thymio(port)
    assert port.robot.motors(port.clock.now()) == STILL
    assert not port.is_open


def test_a_late_answer_is_not_taken_for_that_of_the_next_question(on_its_clock):
    """An answer that came late once put each later reading one question behind."""
    port = on_its_clock(FakePort())
    link, robot, held = Link(port, "a port"), described(), bytearray()
    port.wire.to_host = lambda number, byte: held.append(byte) or b""
    asked = port.clock.now()

    def late():
        if held and port.clock.now() - asked > 1.0:  # after it was given up
            port.incoming += held
            held.clear()
            port.wire.to_host = Wire().to_host

    port.wake = late
    for value in range(20, 40):
        port.robot.memory[LEFT] = value
        assert link.read(robot, (LEFT, 1)) == [(value,)]


def test_a_description_that_comes_late_does_not_move_the_offsets(on_its_clock):
    """Two descriptions in a row once added up."""
    port = on_its_clock(FakePort())
    whole = b"".join(each.encoded() for each in port.robot.description())
    tail = whole[whole.index(text("prox.horizontal")) - 8 :]
    answer = port.robot.answer
    port.robot.answer = lambda message, now: (
        tail + answer(message, now) if message.kind == Kind.GET_NODE_DESCRIPTION else answer(message, now)
    )
    assert Link(port, "a port").find().offsets == OFFSETS


def test_a_link_that_is_opened_within_a_message_finds_its_robot(on_its_clock):
    port = on_its_clock(FakePort())
    port.incoming += Message(1, 1, bytes(range(60))).encoded()[11:]
    assert Link(port, "a port").find().first_free == FIRST_FREE


@pytest.mark.parametrize("after", range(0, 60, 7))
def test_a_port_that_is_gone_is_one_error(after, on_its_clock):
    port = on_its_clock(FakePort())
    robot = Thymio(port)
    read, n_reads = port.read, 0

    def counted(size=1):
        nonlocal n_reads
        n_reads += 1
        port.gone = n_reads > after
        return read(size)

    port.read = counted
    with pytest.raises(RobotError, match="is lost"):
        drive_for_long(robot)
    with pytest.raises(RobotError, match="is lost"):
        robot.close()
    assert not port.is_open
    assert port.robot.motors(port.clock.now() + 1.0) == STILL


def drive_for_long(robot):
    for _ in range(200):
        robot.drive(Command(0.1, 0.0))


def test_a_silent_robot_is_one_error_in_seconds(on_its_clock):
    port = on_its_clock(FakePort())
    robot = Thymio(port)
    port.wire.to_host = lambda number, byte: b""
    for _ in range(12):
        began = port.clock.now()
        with pytest.raises(RobotTimeout, match=r"does not answer|has not answered"):
            robot.observe()
        assert port.clock.now() - began < 3.0
    with pytest.raises(RobotError):
        robot.close()


def test_a_robot_that_never_stops_talking_is_one_error(on_its_clock):
    port = on_its_clock(FakePort())
    robot = Thymio(port)
    noise = Message(1, 1, bytes(20)).encoded()
    port.wire.to_host = lambda number, byte: b""

    def talk():
        port.clock.sleep(0.001)
        port.incoming += noise

    read = port.read
    port.read = lambda size=1: talk() or read(size)
    with pytest.raises(RobotTimeout):
        robot.observe()
    port.read = read
    port.incoming.clear()
    port.wire.to_host = Wire().to_host
    robot.close()


def mutated(draw, data):
    """The same with up to three bytes lost, added, or changed, or random bytes, or the front of it."""
    for _ in range(draw.randint(1, 3)):
        at, what = draw.randrange(len(data) + 1), draw.randrange(5)
        if what == 0:
            data = data[:at] + data[at + 1 :]
        elif what == 1:
            data = data[:at] + draw.randbytes(draw.randint(1, 8)) + data[at:]
        elif what == 2:
            data = data[:at] + draw.randbytes(1) + data[at + 1 :]
        elif what == 3:
            data = data[:at]
        else:
            data = draw.randbytes(draw.randrange(60))
    return data


def fuzz(n, on_its_clock):
    """Sessions with n damaged frames in all; returns the number of calls that worked, and that ended in errors."""
    draw, n_frames, worked, failed = random.Random(7), 0, 0, 0
    while n_frames < n:
        port = on_its_clock(FakePort(FakeThymio()))
        rate, answer = draw.choice((0.02, 0.2, 0.9)), port.robot.answer

        def damaged(message, now, rate=rate, answer=answer):
            nonlocal n_frames
            data = answer(message, now)
            if draw.random() < rate:
                n_frames += 1
                data = mutated(draw, data)
            return data

        port.robot.answer = damaged
        try:
            robot = Thymio(port)
        except RobotError:
            failed += 1
            continue
        for _ in range(10):
            try:
                draw.choice(
                    (Thymio.observe, Thymio.sensors, Thymio.stop, lambda it: it.drive(Command(0.3, 0.1)))
                )(robot)
                worked += 1
            except RobotError as error:
                failed += 1
                n_letters = len(str(error))
                assert n_letters < 500
        port.robot.answer = answer
        robot.link._wait_for_silence()
        robot.close()
        assert port.robot.motors(port.clock.now()) == STILL
        assert port.clock.now() < 600
    return worked, failed


@pytest.mark.slow
def test_ten_thousand_damaged_frames_end_in_values_or_errors_of_ours(on_its_clock):
    worked, failed = fuzz(10_000, on_its_clock)
    assert worked > 0.1 * failed > 0


def test_a_few_damaged_frames_end_in_values_or_errors_of_ours(on_its_clock):
    fuzz(200, on_its_clock)
