"""Writes a description as G-code, in one of the many ways in which it may be written: the random choices are of words,
and never of what is meant. It knows of each mode only what it has itself written."""

import math

import intent


class Writer:
    """Coordinates are physical: mm from the switches; `e`: filament pushed since the file began. `self.at` is where the
    nozzle is once the lines so far are carried out, by the very numbers that were written.

    `klipper`: the file speaks Klipper's words. G91 then makes the filament's coordinate relative, too, and G90 leaves it as
    M82 or M83 has it (klippy/extras/gcode_move.py, cmd_G1). Else G90 and G91 set it, as in Marlin."""

    def __init__(self, random, klipper, plain=False):
        self.random = random
        self.klipper = klipper
        self.plain = plain  # numbers and lines as most slicers write them
        self.lines = []
        self.pieces = []
        self.at = [0.0, 0.0, 0.0, 0.0]
        self.shift = [0.0, 0.0, 0.0, 0.0]  # what the file calls a place, minus where that is
        self.absolute = True
        self.absolute_e = True
        self.inches = False
        self.speed = None  # of the last F, in mm/s
        self.pace = 1.0  # M220
        self.flow = 1.0  # M221
        self.left_out = False  # an object that is not printed
        self.behind_left_out = False
        self.number = 0
        self.numbered = not plain and random.random() < 0.15
        self.used = set()

    # ---- words

    def spelled(self, value, digits, packed=False):
        """A number that is meant, as text, and the number that the text stands for. `packed`: the next word follows
        without a blank, so an exponent would look like the word E."""
        text = "%.*f" % (digits, value)
        value = float(text)
        if value == 0:
            text = text.lstrip("-")
        r = self.random
        if self.plain or r.random() < 0.6:
            return text, value
        form = r.randrange(6)
        if form == 0 and value != 0 and not packed:
            self.used.add("exponent")
            power = r.choice([-3, -2, -1, 1, 2, 3])
            mantissa = "%.*f" % (digits + max(0, power), value / 10.0**power)
            text = mantissa + r.choice("eE") + r.choice(["", "+"] if power > 0 else [""]) + str(power)
            return text, float(text)
        if form == 1:
            text = text.rstrip("0")
            return (text[:-1] if text.endswith(".") and r.random() < 0.5 else text), value
        if form == 2 and text.startswith(("0.", "-0.")) and value != 0:
            return text.replace("0.", ".", 1), value
        if form == 3 and value >= 0 and not packed:
            return "+" + text, value
        if form == 4 and not text.startswith("-"):
            return "0" + text, value
        return text, value

    def line(self, text, plain=False):
        """One line of the file, with what may stand around it."""
        r = self.random
        if not (plain or self.plain):
            if r.random() < 0.06:
                text = r.choice([text + " ; X9 E9", text + "(E5; G28) ", text + " ;", "  " + text, text + "\t"])
                self.used.add("comment")
            if r.random() < 0.03 and '"' not in text and not any(word in text for word in ("NAME", "M486", "M117")):
                text = text.lower()
        if self.numbered and not plain and ";" not in text and "(" not in text:
            self.number += 1
            text = "N%d %s" % (self.number, text)
            sum_ = 0
            for byte in text.encode():
                sum_ ^= byte
            text += "*%d" % sum_
        self.lines.append(text)

    def code(self, letter, number):
        r = self.random
        return letter + ("0" if not self.plain and r.random() < 0.1 and number < 10 else "") + str(number)

    def noise(self):
        """Lines that mean nothing for the part."""
        r = self.random
        if self.plain or r.random() > 0.12:
            return
        self.line(
            r.choice(
                ["; a remark", "", "M117 Layer X1 of E9", "M73 P101", "M73 P50 R-1", "M73 R99999999999", "(X50 E9; G28)", "M105", "M118 G1 X9", "M300 S440 P10"]
            ),
            plain=True,
        )

    # ---- moves

    def word(self, axis, physical, packed=False):
        """The word for `physical` on an axis (0 to 3), and where that word leads."""
        letter = "XYZE"[axis]
        scale = 25.4 if self.inches else 1.0
        digits = 5 if self.inches else (5 if axis == 3 else 3)
        absolute = self.absolute_e and (self.absolute or not self.klipper) if axis == 3 else self.absolute
        factor = self.flow if axis == 3 else 1.0
        if absolute:
            text, value = self.spelled((self.told(axis) + (physical - self.at[axis]) / factor) / scale, digits, packed)
            reached = self.at[axis] + (value * scale - self.told(axis)) * factor
        else:
            text, value = self.spelled((physical - self.at[axis]) / factor / scale, digits, packed)
            reached = self.at[axis] + value * scale * factor
        return letter + text, reached

    def told(self, axis):
        """What the file calls the present place."""
        return self.file_place[axis]

    @property
    def file_place(self):
        return [self.at[i] + self.shift[i] for i in range(4)]

    def reach(self, axis, reached):
        """E's coordinate counts words, not what the flow makes of them."""
        if axis == 3:
            words = (reached - self.at[3]) / self.flow
            if self.left_out:  # no filament moves, and the file's coordinate does
                self.shift[3] += words
                return
            self.shift[3] += words - (reached - self.at[3])
        self.at[axis] = reached

    def feed(self, speed, packed=False):
        """The word F for mm/s, or nothing where it is in force; sometimes on a line of its own."""
        if self.speed is not None and abs(self.speed - speed) < 1e-9 and self.random.random() < 0.7:
            return ""
        digits = 4 if self.inches else 1
        text, value = self.spelled(speed / self.pace * 60 / (25.4 if self.inches else 1), digits, packed)
        self.speed = value * self.pace / 60 * (25.4 if self.inches else 1)
        if not self.plain and self.random.random() < 0.08:
            self.used.add("speed alone")
            self.line("F" + text)
            return ""
        return " F" + text

    def record(self, pieces, sideways):
        """Takes down what the last line means."""
        if self.left_out:
            return
        if self.behind_left_out:
            end = pieces[-1].end
            if sideways:
                self.behind_left_out = False
                self.pieces.append(intent.Free(tuple(end)))
            else:
                self.pieces.append(intent.Free((None, None, end[2], end[3])))
            return
        self.pieces.extend(pieces)

    def move(self, speed, x=None, y=None, z=None, e=None, words=None):
        """A straight line. `words`: more of the axes to name, though they stay."""
        blank = "" if not self.plain and self.random.random() < 0.05 and not self.numbered else " "
        feed = self.feed(speed, packed=not blank)
        asked = [x, y, z, None if e is None else self.at[3] + e]
        parts, reached = [], list(self.at)
        order = [0, 1, 2, 3]
        if not self.plain and self.random.random() < 0.1:
            self.random.shuffle(order)
        for axis in order:
            if asked[axis] is None:
                continue
            text, reached[axis] = self.word(axis, asked[axis], packed=not blank)
            parts.append(text)
        self.line(self.code("G", 1 if e is not None or self.random.random() < 0.5 else 0) + blank + blank.join(parts) + feed)
        old = list(self.at)
        for axis in range(4):
            if reached[axis] != self.at[axis]:
                self.reach(axis, reached[axis])
        sideways = x is not None or y is not None
        length = math.dist(old[:3], self.at[:3])
        limit = self.speed if length > 0 else None
        if limit and e is not None and length > 0:
            push = abs(self.at[3] - old[3]) / length
            if push * limit > 13:
                limit = None
        self.record([intent.Straight(tuple(self.at), limit)], sideways)

    def round(self, speed, i, j, turn, clockwise, e, name_end):
        """An arc around the place (i, j) away. A whole turn may leave its end out."""
        feed = self.feed(speed)
        scale = 25.4 if self.inches else 1.0
        start = tuple(self.at)
        i_text, i_value = self.spelled(i / scale, 5)
        j_text, j_value = self.spelled(j / scale, 5)
        centre = (start[0] + i_value * scale, start[1] + j_value * scale)
        whole = turn >= 2 * math.pi - 1e-9
        parts = []
        reached = list(self.at)
        if not whole:
            angle = math.atan2(start[1] - centre[1], start[0] - centre[0]) + (-turn if clockwise else turn)
            radius = math.hypot(start[0] - centre[0], start[1] - centre[1])
            for axis, end in ((0, centre[0] + radius * math.cos(angle)), (1, centre[1] + radius * math.sin(angle))):
                text, reached[axis] = self.word(axis, end)
                parts.append(text)
        elif name_end:
            self.used.add("circle with its end")
            for axis in (0, 1):
                text, _ = self.word(axis, self.at[axis])
                parts.append(text)
        parts += ["I" + i_text, "J" + j_text]
        if e is not None:
            text, reached[3] = self.word(3, self.at[3] + e)
            parts.append(text)
        self.line(self.code("G", 2 if clockwise else 3) + " " + " ".join(parts) + feed)
        push = reached[3] - self.at[3]
        pieces = intent.circle(start, centre, clockwise, turn, 0.0, push)
        if not whole:
            pieces.append(intent.Straight((reached[0], reached[1], start[2], reached[3])))
        for axis in range(4):
            if reached[axis] != self.at[axis]:
                self.reach(axis, reached[axis])
        self.record(pieces, True)

    # ---- modes

    def mode(self, absolute):
        self.line("G90" if absolute else "G91")
        self.absolute = absolute
        if not self.klipper:
            self.absolute_e = absolute

    def mode_e(self, absolute):
        self.line("M82" if absolute else "M83")
        self.absolute_e = absolute

    def unit(self, inches):
        self.line("G20" if inches else "G21")
        self.inches = inches
        self.used.add("inches")

    def rename(self, axis, value):
        """G92: the present place is called `value` (in the file's unit)."""
        text, value = self.spelled(value, 3)
        self.line("G92 %s%s" % ("XYZE"[axis], text))
        self.shift[axis] = value * (25.4 if self.inches else 1.0) - self.at[axis]
        self.used.add("G92")

    def change_pace(self, percent):
        self.line("M220 S%d" % percent)
        if self.speed is not None:
            self.speed *= percent / 100 / self.pace
        self.pace = percent / 100

    def change_flow(self, percent):
        self.line("M221 S%d" % percent)
        self.flow = percent / 100
