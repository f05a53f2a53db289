"""The lines between a driver and its gateway, or an emulated robot: a JSON object each.

| request | answer |
|---|---|
| `{"do": "drive", "ahead": m/s, "turn": rad/s, "life": s}` | `{}`; the command is repeated until its life ends |
| `{"do": "drive", …, "once": 1}` | `{}`; the command is published once, and zeros at the end of its life |
| `{"do": "stop"}` | `{}`; zeros are published and repeated |
| `{"do": "read"}` | `now` [s], `topics` (newest message, age, number, publishers), `trails` ([now, x, y, yaw]) |
| `{"do": "graph"}` | `graph` (who publishes and subscribes), `kinds` (the types of commands that somebody takes) |

A request may have an `id`, which its answer repeats. An answer to a wrong request has `error`. A number that is
infinite or NaN is null.
"""

IDLE = b"idle"
"""Tells a spare gateway to end without zeros. If its input ends without it, it publishes them."""
REPEAT_S = 0.05
"""Time between two messages of a command that lasts [s]: `diff_drive_controller` stops after 0.5 s by default."""
ZEROS_S = 0.5
"""Time for which zeros are repeated after a stop [s]."""
LIFE_S = 2.0
"""Longest life of a command that is repeated [s]."""
ONCE_S = 5.0
"""Longest life of a command that is published once [s]."""
TICK_S = 0.01
"""Time between two looks for messages [s]."""
MOST_TRAIL = 10_000
"""Largest number of poses that are kept until they are read."""
MOST_VALUES = 100_000
"""Largest number of values in a message that is passed on."""
