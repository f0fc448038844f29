"""Did the motors go the way that was meant? Reads the steps that a printer made, as its pins showed them, and a list of
pieces (intent.py), and tells the first place where they part. It reads no G-code."""

import csv
import math

import intent

STEPS_PER_MM = {"X": 80, "Y": 80, "Z": 2020, "E": 96}  # of the reference machine (docs/machine.md)
LARGEST_SPEED = (125.0, 125.0, 5.0)
NEAR_MM = 0.05  # of a place that is to be reached
NEAR_E_MM = 0.06
BESIDE_MM = 0.12  # of the way between: what is near its end already goes on to the next
BESIDE_E_MM = 0.12
QUIET_NS = 3_000_000_000
AXES = "XYZE"


def read_steps(path):
    """(ns, axis, direction) of each step behind the first rest of 3 s: the generator has the machine wait so long after
    its homing, and so its place is known there."""
    steps = []
    with open(path, encoding="ascii", newline="") as file:
        rows = csv.reader(file)
        next(rows)
        for time, axis, direction in rows:
            steps.append((int(time), AXES.index(axis), int(direction)))
    for index in range(1, len(steps)):
        if steps[index][0] - steps[index - 1][0] > QUIET_NS:
            return steps[index:]
    return []


class Difference(Exception):
    """The machine left the way: the text says where and how."""


def words(place):
    return "X%.3f Y%.3f Z%.3f E%.3f" % tuple(place)


def along(a, b, p):
    """Where on the straight line from a to b the place p is (0 to 1), and how far from it, sideways and in E."""
    way = [b[i] - a[i] for i in range(3)]
    square = sum(each * each for each in way)
    if square > 1e-12:
        t = max(0.0, min(1.0, sum((p[i] - a[i]) * way[i] for i in range(3)) / square))
    else:
        push = b[3] - a[3]
        t = max(0.0, min(1.0, (p[3] - a[3]) / push)) if abs(push) > 1e-12 else 1.0
    aside = math.sqrt(sum((a[i] + way[i] * t - p[i]) ** 2 for i in range(3)))
    return t, aside, abs(a[3] + (b[3] - a[3]) * t - p[3])


def is_near(p, end):
    return all(end[i] is None or abs(p[i] - end[i]) <= (NEAR_MM if i < 3 else NEAR_E_MM) for i in range(4))


class Speed:
    """The speed in the middle third of one straight line."""

    def __init__(self, a, piece):
        way = [piece.end[i] - a[i] for i in range(3)]
        self.length = math.sqrt(sum(each * each for each in way))
        self.asked = piece.speed
        self.marks = []
        if self.asked and self.length > 0:
            for i in range(3):
                if abs(way[i]) > 1e-9:
                    self.asked = min(self.asked, LARGEST_SPEED[i] * self.length / abs(way[i]))

    def see(self, t, time):
        if len(self.marks) < 2 and t >= (0.35, 0.65)[len(self.marks)]:
            self.marks.append((t, time))

    def check(self):
        if self.asked is None or self.length < 12 or len(self.marks) < 2 or self.marks[1][1] <= self.marks[0][1]:
            return
        (t0, time0), (t1, time1) = self.marks
        built = (t1 - t0) * self.length / ((time1 - time0) * 1e-9)
        if abs(built / self.asked - 1) > 0.04:
            raise Difference("a line of %.1f mm was made at %.2f mm/s, and %.2f were meant" % (self.length, built, self.asked))


class Walk:
    """Goes through the steps, a piece at a time."""

    def __init__(self, steps, start):
        self.steps = steps
        self.next = 0
        self.place = list(start)

    def step(self):
        if self.next >= len(self.steps):
            return None
        time, axis, direction = self.steps[self.next]
        self.next += 1
        self.place[axis] += direction / STEPS_PER_MM[AXES[axis]]
        return time

    def straight(self, a, piece):
        speed = Speed(a, piece)
        while not is_near(self.place, piece.end):
            time = self.step()
            if time is None:
                raise Difference("the steps end at %s on the way to %s" % (words(self.place), words(piece.end)))
            t, aside, pushed = along(a, piece.end, self.place)
            if aside > BESIDE_MM:
                raise Difference("at %s the nozzle is %.3f mm beside the line to %s" % (words(self.place), aside, words(piece.end)))
            if pushed > BESIDE_E_MM:
                raise Difference("at %s the filament is %.3f mm beside what the line to %s asks for" % (words(self.place), pushed, words(piece.end)))
            speed.see(t, time)
        speed.check()

    def free(self, a, piece):
        """Until the end is reached; of several times the first. Pushing is an error, and so is going lower."""
        floor = min(a[2], a[2] if piece.end[2] is None else piece.end[2])
        low = min(a[3], a[3] if piece.end[3] is None else piece.end[3]) - 12
        high = max(a[3], a[3] if piece.end[3] is None else piece.end[3])
        while not is_near(self.place, piece.end):
            if self.step() is None:
                raise Difference("the steps end at %s, and %s was meant" % (words(self.place), piece.end))
            if self.place[2] < floor - BESIDE_MM:
                raise Difference("at %s the nozzle is below Z%.3f on a way beside the part" % (words(self.place), floor))
            if not low <= self.place[3] <= high + BESIDE_E_MM:
                raise Difference("at %s filament moves on a way beside the part" % words(self.place))
            for i, axis in enumerate("xyz"):
                if piece.home and axis not in piece.home and abs(self.place[i] - a[i]) > BESIDE_MM:
                    raise Difference("at %s %s moves while %s is homed" % (words(self.place), axis, piece.home))

    def tail(self):
        """Behind the last piece: a machine may leave its part, and must not touch it."""
        floor, pushed = self.place[2], self.place[3]
        while self.step() is not None:
            if self.place[2] < floor - BESIDE_MM:
                raise Difference("behind the end of the file the nozzle goes down to Z%.3f" % self.place[2])
            if self.place[3] > pushed + BESIDE_E_MM:
                raise Difference("behind the end of the file filament is pushed")


def judge(steps, pieces, start=(0.0, 0.0, 0.0, 0.0)):
    """None, or where the steps leave what was meant."""
    walk = Walk(steps, start)
    at = list(start)
    try:
        for number, piece in enumerate(pieces):
            if isinstance(piece, intent.Free):
                walk.free(at, piece)
            else:
                walk.straight(at, piece)
            at = [walk.place[i] if piece.end[i] is None else piece.end[i] for i in range(4)]
        number = len(pieces)
        walk.tail()
    except Difference as difference:
        return "piece %d of %d: %s" % (number, len(pieces), difference)
    return None
