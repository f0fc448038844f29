"""Makes a description of a small print, and has it written: objects with names, some of them left out, walls, circles,
retractions, and an end."""

import math

import intent
import writer

LONG = "plate_of_many_parts_from_one_and_the_same_drawing_with_a_long_title_%s"
NAME_PAIRS = (
    ("a", "b"),
    (LONG % "id_0_copy_0", LONG % "id_0_copy_1"),
    ("立方体" * 8 + "一", "立方体" * 8 + "二"),
    ("Ultimate Box 1/2", "Ultimate Box 2/2"),
    ("Bob's part 1/2", "Bob's part 2/2"),
    ("part_1e2", "part_1e3"),
)


class Print:
    """One file: its bytes, its meaning, and which ways of writing are in it."""

    def __init__(self, random, plain=False):
        self.random = random
        self.klipper = random.random() < 0.5
        self.w = writer.Writer(random, self.klipper, plain)
        self.build()
        end = "\r\n" if not plain and random.random() < 0.2 else "\n"
        self.text = end.join(self.w.lines) + (end if random.random() < 0.9 else "")
        self.pieces = self.w.pieces
        self.used = sorted(self.w.used)

    def build(self):
        w, r = self.w, self.random
        if self.klipper:
            w.line("SET_VELOCITY_LIMIT SQUARE_CORNER_VELOCITY=%d" % r.choice([5, 8, 20]), plain=True)
        self.define_objects()
        self.start()
        layers = r.choice([1, 1, 2])
        self.lifted = False
        for layer in range(layers):
            z = 0.3 * (layer + 1)
            w.move(4, z=z)
            for index in range(len(self.names)):
                is_last = layer == layers - 1 and index == len(self.names) - 1
                self.object(index, z, layer, is_last and r.random() < 0.4)
        self.finish()

    # ---- objects

    def define_objects(self):
        w, r = self.w, self.random
        count = r.choice([1, 2, 2])
        self.names = list(r.choice(NAME_PAIRS))[:count]
        if r.random() < 0.5:
            self.names.reverse()
        self.out = [r.random() < 0.4 for _ in self.names]
        if any(self.out):
            w.used.add("left out")
            if self.out[-1]:
                w.used.add("the last is left out")
        self.out_before = r.random() < 0.5
        if self.klipper:
            for name in self.names:
                w.line("EXCLUDE_OBJECT_DEFINE NAME=%s CENTER=60,60" % self.quoted(name), plain=True)

    def quoted(self, name):
        if " " not in name and "'" not in name:
            return name
        return '"%s"' % name

    def leave_out(self, index):
        if self.klipper:
            self.w.line("EXCLUDE_OBJECT NAME=%s" % self.quoted(self.names[index]), plain=True)
        else:
            self.w.line("M486 P%d" % index, plain=True)

    def object(self, index, z, layer, lift):
        """`lift`: the nozzle leaves the part before the mark of the object's end, as some slicers write it."""
        w, r = self.w, self.random
        begin, end = (
            ("EXCLUDE_OBJECT_START NAME=" + self.quoted(self.names[index]), "EXCLUDE_OBJECT_END NAME=" + self.quoted(self.names[index]))
            if self.klipper
            else ("M486 S%d" % index, "M486 S-1")
        )
        if self.out[index] and layer == 0 and not self.out_before:
            self.leave_out(index)
        w.line(begin, plain=True)
        if not self.klipper and layer == 0:
            w.line("M486 A" + self.names[index], plain=True)
        w.left_out = self.out[index]
        self.body(15 + 45 * index + r.uniform(0, 3), 20 + r.uniform(0, 40), z)
        if lift:
            self.lift()
        if w.left_out:
            w.left_out = False
            w.behind_left_out = True
            if lift:
                w.used.add("the lift is left out")
        w.line(end, plain=True)

    def body(self, x, y, z):
        """What is printed of one object in one layer, in a square of 35 mm from (x, y)."""
        w, r = self.w, self.random
        w.move(r.choice([60, 90, 120]), x=x, y=y)
        for _ in range(r.randrange(2, 6)):
            w.noise()
            self.change_modes()
            kind = r.randrange(5)
            if kind == 0:
                self.circle(x, y)
            elif kind == 1:
                self.arc()
            elif kind == 2:
                self.hop(x, y, z)
            elif kind == 3:
                self.small_moves()
            else:
                self.wall(x, y)
        if not w.absolute or w.inches:
            self.plain_modes()

    def wall(self, x, y):
        w, r = self.w, self.random
        to = (x + r.uniform(0, 35), y + r.uniform(0, 35))
        way = math.dist(to, w.at[:2])
        w.move(r.choice([15, 20, 30, 45, 60]), x=to[0], y=to[1], e=way * r.uniform(0.03, 0.06))

    def small_moves(self):
        """Ten steps of a tenth of a millimetre: their sum is no round number."""
        w, r = self.w, self.random
        if w.absolute:
            w.mode(False)
        sign = 1 if w.at[0] < 75 else -1
        for _ in range(10):
            w.move(20, x=w.at[0] + 0.1 * sign)
        if r.random() < 0.7:
            w.mode(True)

    def circle(self, x, y):
        w, r = self.w, self.random
        radius = r.uniform(1.5, 6)
        angle = math.atan2(y + 17 - w.at[1], x + 17 - w.at[0])
        w.used.add("circle")
        push = None if r.random() < 0.15 else radius * 2 * math.pi * 0.04
        w.round(r.choice([15, 25]), radius * math.cos(angle), radius * math.sin(angle), 2 * math.pi, r.random() < 0.5, push, r.random() < 0.6)

    def arc(self):
        w, r = self.w, self.random
        radius = r.uniform(2, 6)
        angle = math.atan2(75 - w.at[1], 75 - w.at[0])
        turn = r.uniform(0.4, 5.8)
        w.round(r.choice([15, 25]), radius * math.cos(angle), radius * math.sin(angle), turn, r.random() < 0.5, radius * turn * 0.04, True)

    def hop(self, x, y, z):
        """Filament back, up, sideways, down, filament again."""
        w, r = self.w, self.random
        if r.random() < 0.3:
            w.line("G10", plain=True)
            self.pushed(-1.0)
            firmware = True
        else:
            w.move(20, e=-0.8)
            firmware = False
        high = r.random() < 0.6
        if high:
            w.move(4, z=z + 0.4)
        w.move(100, x=x + r.uniform(0, 35), y=y + r.uniform(0, 35))
        if high:
            w.move(4, z=z)
        if firmware:
            w.line("G11", plain=True)
            self.pushed(1.0)
        else:
            w.move(20, e=0.8)

    def pushed(self, e):
        """Firmware retraction: the filament moves, and the file's coordinate of it does not."""
        w = self.w
        if not w.left_out:
            w.at[3] += e
            w.shift[3] -= e
        w.record([intent.Straight(tuple(w.at))], False)

    # ---- modes

    def change_modes(self):
        w, r = self.w, self.random
        if w.plain or r.random() < 0.5:
            return
        kind = r.randrange(7)
        if kind == 0:
            w.mode(not w.absolute)
        elif kind == 1:
            w.mode_e(not w.absolute_e)
        elif kind == 2:
            w.rename(3, r.choice([0, 0, 5.5]))
        elif kind == 3:
            w.rename(r.randrange(2), r.choice([0, 12.346, 40.1]))
        elif kind == 4:
            w.unit(not w.inches)
        elif kind == 5:
            w.change_pace(r.choice([50, 80, 100, 125]))
        else:
            w.change_flow(r.choice([80, 95, 100, 110]))

    def plain_modes(self):
        w = self.w
        if w.inches:
            w.unit(False)
        if not w.absolute:
            w.mode(True)

    # ---- both ends

    def start(self):
        w, r = self.w, self.random
        w.line("G21")
        w.mode(True)
        w.mode_e(r.random() < 0.5)
        w.line("M207 S1 F1800", plain=True)
        w.line("M107", plain=True)
        if r.random() < 0.3:
            w.line("M140 S0", plain=True)
        w.line("G28", plain=True)
        if r.random() < 0.25:
            w.used.add("cold wait")
            w.line("M109 R170", plain=True)
            w.line("M302 S160", plain=True)
        else:
            w.line(r.choice(["M109 S205", "M104 S205\nM109 S205"]), plain=True)
        w.line("G4 P4000", plain=True)
        if r.random() < 0.5:
            w.rename(3, 0)
        w.line("M220 S100", plain=True)
        if any(self.out) and self.out_before:
            for index, out in enumerate(self.out):
                if out:
                    self.leave_out(index)

    def lift(self):
        w, r = self.w, self.random
        self.lifted = True
        if r.random() < 0.6:
            w.mode(False)
        w.move(4, z=w.at[2] + r.choice([1, 3]))
        if not w.absolute:
            w.mode(True)

    def finish(self):
        """Up, and home, sideways, let go, or nothing more."""
        w, r = self.w, self.random
        left_high = w.behind_left_out and self.lifted
        if not self.lifted and r.random() < 0.85:
            self.lift()
        end = r.randrange(4)
        if left_high and end != 1:  # the nozzle may not stay in the part
            w.pieces.append(intent.Free((None, None, w.at[2], w.at[3])))
        if end == 0 and self.lifted:
            w.line("G28 X0 Y0", plain=True)
            w.pieces.append(intent.Free((0.0, 0.0, w.at[2], w.at[3]), home="xy"))
            w.used.add("homed at the end")
        elif end == 1:
            w.move(80, x=10, y=130)
        elif end == 2:
            w.line("M84", plain=True)
        for text in r.sample(["M104 S0", "M140 S0", "M107", "M84"], r.randrange(5)):
            w.line(text, plain=True)


LEAVINGS = (
    "M203 X20 Y20",
    "M201 X80 Y80",
    "M204 P80 T80",
    "M204 S80",
    "M205 X1 Y1",
    "M900 K0.6",
    "M572 D0 S0.6",
    "M593 F20",
    "SET_PRESSURE_ADVANCE ADVANCE=0.6",
    "SET_VELOCITY_LIMIT ACCEL=80",
    "SET_VELOCITY_LIMIT VELOCITY=20",
    "SET_INPUT_SHAPER SHAPER_FREQ_X=15 SHAPER_FREQ_Y=15",
    "M220 S40",
    "M221 S70",
    "M92 E110",
    "M206 X5 Y5",
    "SET_GCODE_OFFSET X=4 Y=4",
    "G20",
    "G91",
    "M83",
    "M82",
    "G92 X30 Y30 E7",
    "M200 D1.75",
    "M207 S3 Z1",
    "M302 S150",
    "G18",
    "EXCLUDE_OBJECT NAME=a",
    "EXCLUDE_OBJECT NAME=b",
    "M486 P0",
    "M486 P1",
    "G17",
)


def job_before(random):
    """A job that leaves as much behind as a file can."""
    lines = ["G28", "M109 S205", "G1 Z5 F240", "G1 X20 Y20 F3000"]
    # Inches last: no diameter of M200 is 1.75 of them.
    lines += sorted(random.sample(LEAVINGS, random.randrange(1, 6)), key=lambda line: line == "G20")
    lines += ["G90", "G21", "G1 X21 Y21 F600"] if random.random() < 0.5 else []
    return "\n".join(lines + ["M104 S205", ""])
