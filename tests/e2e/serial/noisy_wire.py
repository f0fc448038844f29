"""A wire between a serial host and the printer's port, that damages some of the lines on it: a bit flips, or a byte is lost."""

import os
import pty
import random
import select
import threading
import tty


class NoisyWire:
    """The host opens `host_end`. With `share` of the lines damaged, either way."""

    def __init__(self, printer_port, share, seed):
        self.random = random.Random(seed)
        self.share = share
        self.damaged = {"to the printer": 0, "to the host": 0}
        self.printer = os.open(printer_port, os.O_RDWR | os.O_NOCTTY)
        self.near, self.far = pty.openpty()
        tty.setraw(self.far)
        self.host_end = os.ttyname(self.far)
        self.stop_asked = os.pipe()
        self.thread = threading.Thread(target=self.carry, daemon=True)
        self.thread.start()

    def damage(self, line, way):
        # An M110 that turns into an M112 acts at once. That is right, and no test of the numbers.
        if self.random.random() >= self.share or b"M1" in line:
            return line
        at = self.random.randrange(len(line))
        self.damaged[way] += 1
        if self.random.random() < 0.5:
            return line[:at] + line[at + 1:]
        # Bit 7 stays as it is: printcore gives up on a byte that is no UTF-8.
        return line[:at] + bytes([line[at] ^ 1 << self.random.randrange(7)]) + line[at + 1:]

    def carry(self):
        held = {self.near: b"", self.printer: b""}
        ways = {self.near: (self.printer, "to the printer"), self.printer: (self.near, "to the host")}
        while True:
            ready, _, _ = select.select([self.near, self.printer, self.stop_asked[0]], [], [])
            if self.stop_asked[0] in ready:
                return
            for end in ready:
                try:
                    held[end] += os.read(end, 4096)
                except OSError:  # the other end has gone
                    return
                out, way = ways[end]
                while b"\n" in held[end]:
                    line, held[end] = held[end].split(b"\n", 1)
                    os.write(out, self.damage(line + b"\n", way))

    def close(self):
        os.write(self.stop_asked[1], b"x")
        self.thread.join(timeout=10)
        for end in (self.printer, self.near, self.far, *self.stop_asked):
            os.close(end)
