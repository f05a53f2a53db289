"""The opcodes of the Scribbler (S1, S2, S3) and of the Fluke (1, 2), with the lengths of what goes over the wire.

A robot's command is always a packet of nine bytes, echoed before it is answered; a Fluke's is its opcode and its
arguments, without padding or echo. The first byte decides which of the two it is.

Source: the firmware of Myro's repository (Scribbler/scribbler_server.bs2, Scribbler2/ipre_s2_port.spin,
Fluke/firmware/main.c and server-helper.c), and the headers of the Fluke 2's server.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

PACKET = 9  # bytes of a robot's command: opcode, up to eight arguments, filled up
SENSOR_BLOCK = 11  # bytes with which every command that sets something is answered
LINE = -1  # the length of an answer that ends with a line feed
COUNTED = -2  # the length of an answer that begins with its length, a big-endian word
JPEG_HEADER = -3  # begins with its length, a little-endian word
JPEG_SCAN = -4  # ends with FF D9 and twelve bytes more


class Op(IntEnum):
    """Every opcode by name."""

    # the robot, reading
    SOFT_RESET = 33
    GET_PASS1 = 50
    GET_PASS2 = 51
    GET_NAME2 = 64
    GET_ALL = 65
    GET_ALL_BINARY = 66
    GET_LIGHT_LEFT = 67
    GET_LIGHT_CENTER = 68
    GET_LIGHT_RIGHT = 69
    GET_LIGHT_ALL = 70
    GET_IR_LEFT = 71
    GET_IR_RIGHT = 72
    GET_IR_ALL = 73
    GET_LINE_LEFT = 74
    GET_LINE_RIGHT = 75
    GET_LINE_ALL = 76
    GET_STATE = 77
    GET_NAME1 = 78
    GET_STALL = 79
    GET_INFO = 80
    GET_DATA = 81
    # the robot, setting
    SET_PASS1 = 55
    SET_PASS2 = 56
    SET_SINGLE_DATA = 96
    SET_DATA = 97
    SET_ECHO_MODE = 98
    SET_LED_LEFT_ON = 99
    SET_LED_LEFT_OFF = 100
    SET_LED_CENTER_ON = 101
    SET_LED_CENTER_OFF = 102
    SET_LED_RIGHT_ON = 103
    SET_LED_RIGHT_OFF = 104
    SET_LED_ALL_ON = 105
    SET_LED_ALL_OFF = 106
    SET_LED_ALL = 107
    SET_MOTORS_OFF = 108
    SET_MOTORS = 109
    SET_NAME1 = 110
    SET_LOUD = 111
    SET_QUIET = 112
    SET_SPEAKER = 113
    SET_SPEAKER_2 = 114
    SET_NAME2 = 119
    # the S2 alone
    SET_VOLUME = 160
    PATH = 161
    MOVE = 162
    ARC = 163
    TURN = 164
    GET_POSITION = 165
    SET_POSITION = 166
    GET_ANGLE = 167
    SET_ANGLE = 168
    GET_MIC_ENVELOPE = 169
    GET_MOTOR_STATS = 170
    GET_ENCODERS = 171
    GET_IR_EX = 172
    GET_LINE_EX = 173
    GET_DISTANCE = 175
    # the Fluke
    GET_ERRORS = 10
    SET_PICTURE_SIZE = 11
    SET_SERVO = 12
    ENABLE_PAN = 13
    UPDATE_FIRMWARE = 40
    SAVE_EEPROM = 41
    RESTORE_EEPROM = 42
    WATCHDOG_RESET = 43
    GET_RLE = 82
    GET_IMAGE = 83
    GET_WINDOW = 84
    GET_DONGLE_IR_LEFT = 85
    GET_DONGLE_IR_CENTER = 86
    GET_DONGLE_IR_RIGHT = 87
    GET_WINDOW_LIGHT = 88
    GET_BATTERY = 89
    GET_SERIAL_MEMORY = 90
    GET_SCRIBBLER_PROGRAM = 91
    GET_CAMERA_PARAMETER = 92
    GET_BLOB_WINDOW = 94
    GET_BLOB = 95
    SET_FRONT_LED_ON = 116
    SET_FRONT_LED_OFF = 117
    SET_RLE = 118
    SET_DONGLE_IR = 120
    SET_SERIAL_MEMORY = 121
    SET_SCRIBBLER_PROGRAM = 122
    SET_START_PROGRAM = 123
    RESET_SCRIBBLER = 124
    ERASE_SERIAL_MEMORY = 125
    SET_BACK_LED = 126
    SET_WINDOW = 127
    SET_FORWARDNESS = 128
    WHITE_BALANCE_ON = 129
    WHITE_BALANCE_OFF = 130
    SET_CAMERA_PARAMETER = 131
    SET_UART0 = 132
    PASS_BYTE = 133
    SET_PASSTHROUGH = 134
    GET_JPEG_GRAY_HEADER = 135
    GET_JPEG_GRAY_SCAN = 136
    GET_JPEG_COLOR_HEADER = 137
    GET_JPEG_COLOR_SCAN = 138
    PASS_N_BYTES = 139
    GET_PASS_N_BYTES = 140
    GET_PASS_BYTES_UNTIL = 141
    GET_VERSION = 142
    RELAY_ON = 143
    RELAY_OFF = 144
    GET_IR_MESSAGE = 150
    SEND_IR_MESSAGE = 151
    SET_IR_EMITTERS = 152
    SET_START_PROGRAM_2 = 153
    RESET_SCRIBBLER_2 = 154
    SET_SCRIBBLER_BATCH = 155
    GET_ROBOT_ID = 156
    GET_DONGLE_IR = 157


ROBOT_ANSWERS: dict[Op, int] = {
    Op.SOFT_RESET: 0,
    **dict.fromkeys((Op.GET_PASS1, Op.GET_PASS2, Op.GET_NAME1, Op.GET_NAME2, Op.GET_DATA), 8),
    Op.GET_ALL: SENSOR_BLOCK,
    Op.GET_ALL_BINARY: 1,
    **dict.fromkeys((Op.GET_LIGHT_LEFT, Op.GET_LIGHT_CENTER, Op.GET_LIGHT_RIGHT), 2),
    Op.GET_LIGHT_ALL: 6,
    **dict.fromkeys((Op.GET_IR_LEFT, Op.GET_IR_RIGHT, Op.GET_LINE_LEFT, Op.GET_LINE_RIGHT), 1),
    **dict.fromkeys((Op.GET_IR_ALL, Op.GET_LINE_ALL, Op.GET_STATE), 2),
    Op.GET_STALL: 1,
    Op.GET_INFO: LINE,
    **dict.fromkeys((Op(code) for code in (55, 56, *range(96, 115), 119)), SENSOR_BLOCK),
}
"""Bytes of the answer to each command that every robot knows, after the echo."""

S2_ANSWERS: dict[Op, int] = {
    **dict.fromkeys(
        (Op.SET_VOLUME, Op.PATH, Op.MOVE, Op.ARC, Op.TURN, Op.SET_POSITION, Op.SET_ANGLE), SENSOR_BLOCK
    ),
    **dict.fromkeys((Op.GET_POSITION, Op.GET_ENCODERS), 8),
    **dict.fromkeys((Op.GET_ANGLE, Op.GET_MIC_ENVELOPE), 4),
    Op.GET_MOTOR_STATS: 5,
    **dict.fromkeys((Op.GET_IR_EX, Op.GET_LINE_EX, Op.GET_DISTANCE), 1),
}
"""Bytes of the answer to each command that only the S2 knows, after the echo."""


class FlukeLengths(NamedTuple):
    """Bytes of a Fluke's command after the opcode, and of its answer."""

    arguments: int
    answer: int


FLUKE_COMMANDS: dict[Op, FlukeLengths] = {
    Op.GET_RLE: FlukeLengths(0, COUNTED),
    Op.GET_IMAGE: FlukeLengths(0, 256 * 192),
    **dict.fromkeys(
        (Op.GET_DONGLE_IR_LEFT, Op.GET_DONGLE_IR_CENTER, Op.GET_DONGLE_IR_RIGHT, Op.GET_BATTERY),
        FlukeLengths(0, 2),
    ),
    Op.GET_WINDOW_LIGHT: FlukeLengths(1, 3),
    Op.GET_SERIAL_MEMORY: FlukeLengths(4, 1),
    Op.GET_SCRIBBLER_PROGRAM: FlukeLengths(2, 1),
    Op.GET_CAMERA_PARAMETER: FlukeLengths(1, 1),
    Op.GET_BLOB_WINDOW: FlukeLengths(1, 4),
    Op.GET_BLOB: FlukeLengths(0, 4),
    **dict.fromkeys(
        (
            *(Op.SET_FRONT_LED_ON, Op.SET_FRONT_LED_OFF, Op.RESET_SCRIBBLER, Op.RESET_SCRIBBLER_2),
            *(Op.WHITE_BALANCE_ON, Op.WHITE_BALANCE_OFF, Op.RELAY_ON, Op.RELAY_OFF, Op.WATCHDOG_RESET),
            *(Op.SAVE_EEPROM, Op.RESTORE_EEPROM),
        ),
        FlukeLengths(0, 0),
    ),
    Op.SET_RLE: FlukeLengths(8, 0),
    **dict.fromkeys(
        (
            *(Op.SET_DONGLE_IR, Op.SET_BACK_LED, Op.SET_FORWARDNESS, Op.PASS_BYTE, Op.SET_PASSTHROUGH),
            Op.SET_IR_EMITTERS,
        ),
        FlukeLengths(1, 0),
    ),
    Op.SET_SERIAL_MEMORY: FlukeLengths(5, 0),
    Op.SET_SCRIBBLER_PROGRAM: FlukeLengths(3, 0),
    **dict.fromkeys((Op.SET_START_PROGRAM, Op.SET_START_PROGRAM_2), FlukeLengths(4, 0)),
    **dict.fromkeys((Op.ERASE_SERIAL_MEMORY, Op.UPDATE_FIRMWARE), FlukeLengths(2, 0)),
    Op.SET_WINDOW: FlukeLengths(7, 0),
    Op.SET_CAMERA_PARAMETER: FlukeLengths(2, 0),
    Op.SET_UART0: FlukeLengths(4, 0),
    **dict.fromkeys((Op.GET_JPEG_GRAY_HEADER, Op.GET_JPEG_COLOR_HEADER), FlukeLengths(0, JPEG_HEADER)),
    **dict.fromkeys((Op.GET_JPEG_GRAY_SCAN, Op.GET_JPEG_COLOR_SCAN), FlukeLengths(1, JPEG_SCAN)),
    Op.GET_VERSION: FlukeLengths(0, LINE),
    Op.GET_ROBOT_ID: FlukeLengths(0, LINE),
    Op.GET_IR_MESSAGE: FlukeLengths(0, COUNTED),
    Op.GET_DONGLE_IR: FlukeLengths(3, 2),
}
"""The commands of the Fluke 1 whose length is fixed. Not here: those that carry their own length (151, 155, 139, 140,
141) and the window of GET_WINDOW (84), whose answer is as long as the window is large."""

FLUKE_2_COMMANDS: dict[Op, FlukeLengths] = {
    **FLUKE_COMMANDS,
    Op.GET_ERRORS: FlukeLengths(0, COUNTED),
    Op.SET_PICTURE_SIZE: FlukeLengths(1, 0),
    Op.SET_SERVO: FlukeLengths(2, 0),
    Op.ENABLE_PAN: FlukeLengths(2, 0),
    Op.SET_WINDOW: FlukeLengths(11, 0),
}
"""Commands of the Fluke 2, whose windows have coordinates of two bytes."""
