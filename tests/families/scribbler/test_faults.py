"""Whatever happens to bytes, the port or the program: a link that works, or one clear error, and motors that stop."""

from __future__ import annotations

import gc
import random
import signal
import time
import warnings

import pytest
from hypothesis import given
from hypothesis import strategies as st

import realitygap.emulator  # noqa: F401  # its ports are known from then on
from realitygap.errors import ProtocolError, RobotError, RobotTimeout
from realitygap.families.scribbler import Scribbler
from realitygap.robots import Command

from ...robots.ports import Wire, WiredPort
from .peers import INFOS, FakeScribbler, ScriptedPort, greeting, packet

SETUPS = ["s1", "s2", "s1+fluke1", "s2+fluke1", "s2+fluke2"]
LEFT_RIGHT = (0.5, -0.25)
RIGHT_LEFT_BYTES = (75, 150)
STILL = (100, 100)


def scene(robot: Scribbler) -> list[object]:
    """What a program may do, whose every value is known."""
    seen: list[object] = [robot.motors(*LEFT_RIGHT)[1:]]
    seen += [robot.observe().readings for _ in range(3)]
    seen.append(robot.light())
    if robot.info.fluke != "none":
        seen.append(round(robot.battery(), 3))
    seen += [robot.motors(0, 0)[1:], robot.stall()]
    return seen


def undisturbed(setup: str) -> tuple[list[object], Wire, list[bytes]]:
    port = WiredPort(FakeScribbler(setup))
    with Scribbler(port) as robot:
        seen = scene(robot)
        assert robot.faults.recoveries == robot.faults.retries == 0
    assert port.clock.now() == 0
    return seen, port.wire, port.robot.carried_out


FAULTS = {
    "lost": lambda byte: b"",
    "doubled": lambda byte: bytes((byte, byte)),
    "spurious": lambda byte: bytes((byte, 200)),
}


@pytest.mark.parametrize("direction", ["to_robot", "to_host"])
@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("setup", SETUPS)
def test_wherever_one_byte_is_lost_or_added_all_values_are_right_and_the_motors_stop(setup, fault, direction):
    """The one thing that cannot be noticed is a byte before an answer that reads as another good value."""
    expected, wire, _ = undisturbed(setup)
    n_unnoticed = 0
    for at in range(getattr(wire, f"n_{direction}")):
        change = {
            direction: lambda number, byte, at=at: FAULTS[fault](byte) if number == at else bytes((byte,))
        }
        port = WiredPort(FakeScribbler(setup), Wire(**change))
        with Scribbler(port) as robot:
            n_unnoticed += scene(robot) != expected
        assert port.robot.motors == STILL, at
        assert port.clock.now() < 30, at
        if fault == "lost":
            drove = {command[1:3] for command in port.robot.carried_out if command[0] == 109}
            assert drove <= {bytes(RIGHT_LEFT_BYTES), bytes(STILL)}, at
    assert n_unnoticed == 0


@pytest.mark.parametrize("setup", SETUPS)
def test_noise_on_the_line_ends_in_a_working_link_or_one_error_and_motors_off(setup):
    """1 in 500 bytes lost, doubled or changed, for 200 sessions a set-up, from a fixed seed."""
    draw = random.Random(setup)
    n_good = 0

    def noisy(number: int, byte: int) -> bytes:
        if draw.random() > 0.002:
            return bytes((byte,))
        return draw.choice([b"", bytes((byte, byte)), bytes((draw.randrange(256),))])

    for _ in range(200):
        port = WiredPort(FakeScribbler(setup), Wire(noisy, noisy))
        try:
            with Scribbler(port) as robot:
                scene(robot)
            n_good += 1
            assert port.robot.motors == STILL
        except RobotError as error:
            said = str(error)
            assert "motors" in said or "No Scribbler" in said
        port.wire = Wire()
        assert not port.is_open
    assert n_good >= 195


def test_a_fluke_1_that_is_stuck_in_a_packet_is_released_and_nothing_is_carried_out_by_it():
    port = WiredPort(FakeScribbler("s2+fluke1"))
    with Scribbler(port) as robot:
        for n_sent in range(1, 9):
            port.write(bytes([109, 200, 0, 0, 0, 0, 0, 0, 0][:n_sent]))  # cut short
            port.clock.sleep(2.0)
            before = len(port.robot.carried_out)
            assert robot.observe().readings == (800 / 1700,) * 3
            done = [command[0] for command in port.robot.carried_out[before:] if len(command) == 9]
            assert set(done) <= {98, 108, 79}, n_sent
    assert port.robot.motors == STILL


def test_a_fluke_stuck_by_the_program_before_is_released_as_the_port_is_opened():
    for n_sent in range(1, 9):
        port = WiredPort(FakeScribbler("s1+fluke1"))
        port.write(packet(109, 200)[:n_sent])
        port.incoming.clear()
        with Scribbler(port) as robot:
            assert robot.info.fluke == "1", n_sent
            assert robot.info.model == "s1", n_sent


def test_motors_go_on_as_told_after_a_fault_was_put_right():
    port = WiredPort(FakeScribbler("s2"))
    with Scribbler(port) as robot:
        robot.motors(*LEFT_RIGHT)
        port.send(b"\x07" * 30)  # late, of nothing
        lost = port.wire.n_to_host + 12
        port.wire.to_host = lambda number, byte: b"" if number == lost else bytes((byte,))
        robot.light()
        assert robot.faults.retries == 1
        assert robot.faults.strays >= 30
        assert port.robot.motors == RIGHT_LEFT_BYTES
        stops = [command[0] for command in port.robot.carried_out].count(108)
        assert stops == 2  # at the beginning, and while the step was sought
    assert port.robot.motors == STILL


def test_a_late_answer_is_not_taken_for_that_of_the_next_command():
    port = WiredPort(FakeScribbler("s2+fluke1"))
    with Scribbler(port) as robot:
        held = bytearray()
        port.wire.to_host = lambda number, byte: held.append(byte) or b""
        asked = port.wake
        port.wake = lambda: (
            (  # 3 s late, after it was given up
                port.incoming.extend(held),
                held.clear(),
                setattr(port.wire, "to_host", Wire().to_host),
            )
            if port.clock.now() > 3.0
            else asked()
        )
        assert robot.obstacle() == (800, 800, 800)
        assert robot.faults.recoveries >= 1


class Silence:
    """Cuts the wire from the robot after so many bytes."""

    def __init__(self, port: WiredPort, n_bytes: int = 0) -> None:
        port.wire.to_host = lambda number, byte: b""


def test_a_robot_that_falls_silent_is_one_error_that_says_all_there_is_to_know():
    port = WiredPort(FakeScribbler("s2"))
    robot = Scribbler(port, step_s=0.5)
    for _ in range(41):
        robot.drive(Command(0.5, 0.0))
    Silence(port)
    with pytest.raises(RobotTimeout) as caught:
        robot.observe()
    text = str(caught.value)
    assert "No answer within 2.0 s" in text
    assert "'distance left' on /dev/test" in text
    assert "step 41" in text
    assert "(step 41; the motors may be running: switch the robot off)" in text  # sent once
    assert port.robot.motors == STILL  # it heard all the same
    since = port.clock.now()
    with pytest.raises(RobotTimeout, match="'stop' on /dev/test"):
        robot.close()
    assert port.clock.now() - since < 8  # not the whole search again
    assert not port.is_open
    robot.close()


@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("beep", lambda robot: robot.beep(0.5, 440)),
        ("move_by", lambda robot: robot.move_by(10, 0)),
        ("turn_by", lambda robot: robot.turn_by(10)),
        ("move_to", lambda robot: robot.move_to(10, 0)),
        ("turn_to", lambda robot: robot.turn_to(10)),
        ("encoders", lambda robot: robot.encoders(zero=True)),
    ],
)
def test_commands_that_are_not_safe_to_repeat_are_sent_once_and_reported_as_in_doubt(name, call):
    port = WiredPort(FakeScribbler("s2"))
    with Scribbler(port) as robot:
        robot.motors(*LEFT_RIGHT)
        lost = port.wire.n_to_host + 10
        port.wire.to_host = lambda number, byte: b"" if number == lost else bytes((byte,))
        with pytest.raises(
            RobotError, match=rf"'{name}' .*motors stopped\). It is not safe to repeat '{name}'"
        ) as caught:
            call(robot)
        assert "The link is in step again." in str(caught.value)
        opcodes = [command[0] for command in port.robot.carried_out]
        assert sum(opcodes.count(code) for code in (113, 162, 164, 171)) == 1
        assert port.robot.motors == STILL
        assert robot.light() == (0, 0, 0)  # the link works


def test_a_motion_that_a_fault_cut_short_is_said_and_one_that_has_ended_is_not():
    port = WiredPort(FakeScribbler("s2"))
    with Scribbler(port) as robot:
        robot.move_by(100, 0)
        lose_a_byte(port)
        with pytest.raises(
            RobotError, match=r"motion that may not have ended .*'light' .*motors stopped.* in step"
        ):
            robot.light()
        assert robot.light() == (0, 0, 0)
        robot.move_by(100, 0)
        robot.link.is_in_motion = False  # as `motor_stats` says
        lose_a_byte(port)
        assert robot.light() == (0, 0, 0)


def test_motor_stats_say_whether_a_motion_has_ended():
    with Scribbler("emulator://s2?fluke=none&seed=1&speed=off") as robot:
        robot.move_by(20, 0)
        assert not robot.motor_stats().ready
        assert robot.link.is_in_motion
        robot.clock.sleep(5.0)
        assert robot.motor_stats().ready
        assert not robot.link.is_in_motion


def lose_a_byte(port: WiredPort) -> None:
    """Of the next answer."""
    lost = port.wire.n_to_host + 10
    port.wire.to_host = lambda number, byte: b"" if number == lost else bytes((byte,))


def test_a_hang_up_is_survived_when_the_port_comes_back():
    port = WiredPort(FakeScribbler("s2+fluke1"))
    with Scribbler(port) as robot:
        robot.motors(*LEFT_RIGHT)
        port.gone = True
        sleep = port.clock.sleep

        def come_back(seconds: float) -> None:
            sleep(seconds)
            port.gone = port.clock.now() < 4.0

        port.clock.sleep = come_back  # type: ignore[method-assign]
        assert robot.observe().readings == (800 / 1700,) * 3
        assert robot.faults.hang_ups == 1
        assert port.robot.motors == RIGHT_LEFT_BYTES  # went on
        assert [command[0] for command in port.robot.carried_out].count(108) == 2
    assert port.robot.motors == STILL


def silence(port: WiredPort) -> None:
    """Have a robot answer nothing, without a hang-up."""
    port.wire.to_host = lambda number, byte: b""


def hang_up(port: WiredPort) -> None:
    port.gone = True


@pytest.mark.parametrize("lose", [silence, hang_up])
@pytest.mark.parametrize("setup", ["s1", "s2", "s2+fluke1", "s2+fluke2"])
def test_warning_that_motors_may_be_running_comes_within_3_s(lose, setup):
    port = WiredPort(FakeScribbler(setup))
    warned: list[tuple[float, str]] = []
    robot = Scribbler(port)
    with warnings.catch_warnings():
        warnings.simplefilter("default")
        warnings.showwarning = lambda text, *_: warned.append((port.clock.now(), str(text)))
        for n_episodes in (1, 2):
            robot.motors(*LEFT_RIGHT)
            lost_s = port.clock.now()
            to_host = port.wire.to_host
            lose(port)
            with pytest.raises(RobotError, match="the motors may be running"):
                robot.observe()
            assert len(warned) == n_episodes
            said_s, text = warned[-1]
            assert said_s - lost_s <= 3.0
            assert "its motors may be running" in text
            port.wire.to_host, port.gone = to_host, False
            robot.stop()
    robot.close()


def test_robot_that_stands_gives_no_warning_when_it_is_lost():
    port = WiredPort(FakeScribbler("s2+fluke1"))
    robot = Scribbler(port)
    silence(port)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for command in (robot.observe, robot.close):
            with pytest.raises(RobotError, match="motors stopped"):
                command()


def test_a_hang_up_in_the_greeting_is_survived_too():
    port = WiredPort(FakeScribbler("s2"))
    write = port.write

    def hang_up(data: bytes) -> int:
        port.write = write  # type: ignore[method-assign]
        port.close()
        raise OSError(5, "Input/output error")

    port.write = hang_up  # type: ignore[method-assign]
    with Scribbler(port) as robot:
        assert robot.info.model == "s2"
        assert robot.faults.hang_ups == 1


def test_a_hang_up_for_good_is_one_error():
    port = WiredPort(FakeScribbler("s2+fluke1"))
    robot = Scribbler(port)
    robot.motors(*LEFT_RIGHT)
    port.gone = True
    with pytest.raises(
        RobotError, match=r"The port hung up .* on /dev/test .*may be running: switch the robot off"
    ):
        robot.observe()
    assert 5 < port.clock.now() < 15
    with pytest.raises(RobotError, match="'stop'"):
        robot.close()


def test_a_pseudo_terminal_that_ended_is_not_opened_again():
    """The next one with its name belongs to another program, which would get the bytes for the robot."""
    port = WiredPort(FakeScribbler("s2+fluke1"))
    port.name = "/dev/pts/7"
    robot = Scribbler(port)
    robot.motors(*LEFT_RIGHT)
    port.gone, opened = True, []
    port.open = lambda: opened.append(1)  # type: ignore[method-assign]
    with pytest.raises(RobotError, match="may be running: switch the robot off"):
        robot.observe()
    with pytest.raises(RobotError, match="'stop'"):
        robot.close()
    assert not opened


@pytest.mark.parametrize("setup", SETUPS)
def test_a_reset_of_the_robot_is_survived(setup):
    """Three seconds deaf, then its name once a second until it is spoken to."""
    port = WiredPort(FakeScribbler(setup))
    with Scribbler(port) as robot:
        robot.motors(*LEFT_RIGHT)
        back, spoken = port.clock.now() + 3.0, []
        answer = port.robot.robot_command
        byte = port.robot.robot_byte
        port.robot.robot_byte = lambda value, now: byte(value, now) if now >= back else b""  # type: ignore[method-assign]
        port.robot.robot_command = lambda command: spoken.append(1) or answer(command)  # type: ignore[method-assign]
        port.robot.motors = STILL
        next_call = back

        def broadcast() -> None:
            nonlocal next_call
            if port.clock.now() >= next_call and not spoken:
                next_call = port.clock.now() + 1.0
                port.incoming += b"IPREScribby  \0"

        port.wake = broadcast  # type: ignore[method-assign]
        assert robot.light() == (0, 0, 0)
        assert port.robot.motors == RIGHT_LEFT_BYTES


def test_a_port_that_is_never_silent_is_one_error_and_no_hang():
    class Chatter(WiredPort):
        def read(self, size: int = 1) -> bytes:
            return b"U" * size

        in_waiting = property(lambda self: 4096)

    with pytest.raises(ProtocolError, match="No Scribbler answers on /dev/test"):
        Scribbler(Chatter(FakeScribbler("s2")))


def test_a_port_where_nobody_answers_is_one_error_after_a_few_tries():
    port = WiredPort(FakeScribbler("s2"), Wire(to_robot=lambda number, byte: b""))
    with pytest.raises(
        RobotTimeout, match=r"No Scribbler answers on /dev/test, asked 3 times within \d+ s. No answer"
    ):
        Scribbler(port)
    assert not port.is_open
    assert port.clock.now() < 40


def test_an_info_line_that_is_not_quite_as_known_is_taken_when_it_comes_twice():
    line = b"Robot:Scribbler2,Robot-Version:1.2,Color:red,Mode:Serial\n"
    port = ScriptedPort([*greeting(line)[:1], *greeting(line)])
    robot = Scribbler(port)
    assert (robot.info.model, robot.info.robot_version) == ("s2", "1.2")
    port.check_all_said()


def test_an_answer_of_something_else_is_no_scribbler():
    port = ScriptedPort([])
    port.write = lambda data: port.incoming.extend(b"login: \n") or len(data)  # type: ignore[method-assign]
    with pytest.raises(ProtocolError, match="not how a Scribbler or a Fluke presents itself"):
        Scribbler(port)


# ways out


def test_motors_stop_when_an_exception_leaves_the_block():
    port = WiredPort(FakeScribbler("s2"))
    with pytest.raises(ZeroDivisionError), Scribbler(port) as robot:  # noqa: PT012
        robot.motors(1, 1)
        raise ZeroDivisionError
    assert port.robot.motors == STILL


@pytest.mark.parametrize("n_reads", range(1, 9))
def test_motors_stop_after_ctrl_c_in_the_middle_of_an_answer(n_reads):
    port = WiredPort(FakeScribbler("s2+fluke1"))
    read, count = port.read, 0

    def interrupted(size: int = 1) -> bytes:
        nonlocal count
        count += 1
        if count == n_reads:
            read(size // 2)  # some of it was taken
            raise KeyboardInterrupt
        return read(size)

    with pytest.raises(KeyboardInterrupt), Scribbler(port) as robot:  # noqa: PT012
        robot.motors(1, 1)
        port.read = interrupted  # type: ignore[method-assign]
        while True:
            robot.observe()
    assert port.robot.motors == STILL
    assert not port.is_open
    # it was told at once, not after the silence that sorts things out
    assert port.writes[-1] == packet(108)


def test_a_stop_that_fails_on_the_way_out_is_a_note_on_the_exception():
    port = WiredPort(FakeScribbler("s2"))
    with pytest.raises(ZeroDivisionError) as caught, Scribbler(port) as robot:  # noqa: PT012
        robot.motors(1, 1)
        port.gone = True
        raise ZeroDivisionError
    assert "switch the robot off" in caught.value.__notes__[0]


def test_motors_stop_when_nobody_holds_the_robot_any_more():
    port = WiredPort(FakeScribbler("s2"))
    Scribbler(port).motors(1, 1)
    gc.collect()
    assert port.robot.motors == STILL
    assert not port.is_open


def test_signals_that_end_a_program_leave_blocks_while_a_robot_is_open():
    before = signal.getsignal(signal.SIGTERM)
    assert before is signal.SIG_DFL
    port = WiredPort(FakeScribbler("s2"))
    with pytest.raises(SystemExit) as caught, Scribbler(port) as robot:  # noqa: PT012
        robot.motors(1, 1)
        signal.raise_signal(signal.SIGTERM)
    assert caught.value.code == 128 + signal.SIGTERM
    assert port.robot.motors == STILL
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


def test_a_handler_of_ones_own_is_left_alone():
    def mine(*_: object) -> None: ...

    signal.signal(signal.SIGTERM, mine)
    try:
        with Scribbler(WiredPort(FakeScribbler("s2"))):
            assert signal.getsignal(signal.SIGTERM) is mine
        assert signal.getsignal(signal.SIGTERM) is mine
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


# the watchdog


def test_a_silent_program_is_stopped_by_the_watchdog_at_the_very_moment():
    port = WiredPort(FakeScribbler("s2"))
    with Scribbler(port, watchdog_s=1.0, step_s=3.0) as robot:
        robot.drive(Command(1, 0))  # a step may last longer than that
        assert port.robot.motors == (200, 200)
        stopped = []
        command = port.robot.robot_command
        port.robot.robot_command = lambda data: stopped.append((port.clock.now(), data[0])) or command(data)  # type: ignore[method-assign]
        robot.clock.sleep(0.9)
        robot.light()
        robot.clock.sleep(5.0)
        assert port.robot.motors == STILL
        assert stopped[1][0] == pytest.approx(3.0 + 0.9 + 1.0, abs=1e-4)
        assert stopped[1][1] == 108
        assert port.clock.now() == pytest.approx(8.9)
        assert robot.faults.watchdog_stops == 1
        robot.drive(Command(1, 0))  # and goes on when told to
        assert port.robot.motors == (200, 200)


@pytest.mark.parametrize("model", ["s1", "s2"])
def test_an_emulated_robot_is_watched_on_its_own_clock_and_the_same_each_time(model):
    """Where it came to stand after a silence, twice."""
    ends = []
    for _ in range(2):
        with Scribbler(
            f"emulator://{model}?arena=paper&seed=1&speed=off", watchdog_s=1.0, step_s=0.2
        ) as robot:
            robot.drive(Command(0.5, 0.1))
            robot.clock.sleep(30.0)
            assert robot.faults.watchdog_stops == 1
            ends.append((robot.port.witness.pose(), robot.clock.now()))
    assert ends[0] == ends[1]
    assert ends[0][1] == pytest.approx(30.3, abs=0.2)


def test_an_emulated_robot_in_real_time_is_watched_by_a_thread():
    with Scribbler("emulator://s2?seed=1&speed=100", watchdog_s=1.0, step_s=0.1) as robot:
        robot.drive(Command(0.5, 0.0))
        until = time.monotonic() + 10
        while not robot.faults.watchdog_stops and time.monotonic() < until:
            time.sleep(0.01)
        assert robot.faults.watchdog_stops == 1


class RealTimePort(WiredPort):
    """The same in real time; what would wait for an answer is not needed here."""

    clock = property(lambda self: None, lambda self, clock: None)

    def write(self, data: bytes) -> int:
        for byte in data:
            self.incoming += self.robot.receive(byte, time.monotonic())
        return len(data)


def test_a_watchdog_in_real_time_is_a_thread_that_stops_the_motors():
    port = RealTimePort(FakeScribbler("s2"))
    with Scribbler(port, watchdog_s=0.1, step_s=0.3) as robot:
        robot.drive(Command(1, 0))
        assert port.robot.motors == (200, 200)  # a step that lasts is not silence
        until = time.monotonic() + 10
        while port.robot.motors != STILL and time.monotonic() < until:
            time.sleep(0.01)
        assert port.robot.motors == STILL
        assert robot.faults.watchdog_stops == 1


# anything at all


@given(st.lists(st.binary(max_size=40), max_size=30), st.sampled_from(list(INFOS)))
def test_whatever_a_robot_answers_nothing_but_our_errors_comes_of_it(answers, setup):
    port = ScriptedPort(greeting(INFOS[setup]) * (2 if setup == "fluke1" else 1))
    robot = Scribbler(port)
    replies = iter(answers)
    port.write = lambda data: port.incoming.extend(next(replies, b"")) or len(data)  # type: ignore[method-assign]
    for call in (
        robot.observe,
        robot.sensors,
        lambda: robot.name,
        robot.blob,
        robot.picture,
        robot.encoders,
        robot.close,
    ):
        try:
            call()
        except RobotError as error:
            assert "/dev/test" in str(error)  # noqa: PT017
    assert port.clock.now() < 600
