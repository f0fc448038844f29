"""What a file means, as its generator knows it: the ways of the nozzle, in physical millimetres from the switches.

A description is a list of pieces. None of them is worked out by reading G-code: whoever writes the file states them, so
a reader that misunderstands the file cannot agree with it by making the same mistake.
"""

import dataclasses
import math


@dataclasses.dataclass
class Straight:
    """From the end of the piece before to `end` = (x, y, z, e), in a straight line, E in proportion. `speed`: mm/s that
    the middle of a long line must have, or None."""

    end: tuple
    speed: float | None = None


@dataclasses.dataclass
class Free:
    """However the machine likes, but pushing nothing and never below the lower end: until each coordinate of `end` that
    is a number is reached (None: it may stand anywhere). `home`: these axes ("xy") are homed on the way, and the others
    stand still at their place meanwhile."""

    end: tuple
    home: str = ""


def circle(start, centre, clockwise, turn, rise=0.0, push=0.0):
    """The pieces of an arc from `start` (x, y, z, e) around `centre` (x, y) by `turn` radians, in chords that leave it by
    less than 0.002 mm. `rise`, `push`: of Z and of E, in proportion."""
    radius = math.hypot(start[0] - centre[0], start[1] - centre[1])
    at = math.atan2(start[1] - centre[1], start[0] - centre[0])
    chord = 2 * math.acos(max(0.0, 1 - 0.002 / radius))
    count = max(1, math.ceil(turn / chord))
    sign = -1 if clockwise else 1
    pieces = []
    for k in range(1, count + 1):
        angle = at + sign * turn * k / count
        pieces.append(
            Straight((centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle), start[2] + rise * k / count, start[3] + push * k / count))
        )
    return pieces
