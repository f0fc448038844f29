"""Two serial hosts: one of our own, and Printrun's printcore. Both send the next line at each `ok`, and go back when asked to."""

import os
import re
import select
import sys
import threading
import time
import tty

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
# Unpacked by tools/dependencies.sh.
PRINTRUN = os.path.join(ROOT, "build", "printrun", "usr", "lib", "python3", "dist-packages")
# A host that has heard nothing for so long takes an `ok` for lost.
SILENCE_S = 1.5


def checked(number, code):
    line = b"N%d %s" % (number, code.encode())
    total = 0
    for byte in line:
        total ^= byte
    return line + b"*%d\n" % total


class Host:
    def __init__(self, port):
        self.port = os.open(port, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self.port)
        self.heard, self.errors, self.rest = [], 0, b""

    def hear(self, timeout_s):
        """The lines that have come."""
        if not select.select([self.port], [], [], timeout_s)[0]:
            return []
        *lines, self.rest = (self.rest + os.read(self.port, 4096)).split(b"\n")
        lines = [line.decode(errors="replace").strip() for line in lines]
        self.heard += lines
        self.errors += sum(line.startswith("Error") for line in lines)
        return lines

    def say(self, line):
        os.write(self.port, line.encode() + b"\n")

    def hear_until(self, pattern, timeout_s=60):
        end, heard = time.monotonic() + timeout_s, []
        while time.monotonic() < end:
            for line in self.hear(0.1):
                heard.append(line)
                if re.search(pattern, line):
                    return heard
        raise AssertionError("never heard %r; heard:\n%s" % (pattern, "\n".join(heard)))

    def say_all(self, data):
        """Without waiting for an answer. What is heard meanwhile is kept."""
        os.set_blocking(self.port, False)
        while data:
            if not select.select([], [self.port], [], 10)[1]:
                raise AssertionError("the port is not read any more: %d bytes are left" % len(data))
            data = data[os.write(self.port, data[:4096]):]
            self.hear(0)
        os.set_blocking(self.port, True)

    def print_lines(self, lines, first=0):
        """From line `first` (0 is the M110 that goes in front of them) until the last line has its `ok`."""
        lines, at, clear, spoke = ["M110 N0"] + lines, first, True, time.monotonic()
        while at < len(lines) or not clear:
            if not clear and time.monotonic() - spoke > SILENCE_S:
                clear, at = True, min(at, len(lines) - 1)
            if clear and at < len(lines):
                os.write(self.port, checked(at, lines[at]))
                at, clear, spoke = at + 1, False, time.monotonic()
            for line in self.hear(0.05):
                spoke = time.monotonic()
                clear = clear or line.startswith("ok")
                resend = re.match(r"Resend: (\d+)$", line)
                if resend and 0 < int(resend[1]) < len(lines):
                    at = int(resend[1])

    def close(self):
        if self.port is not None:
            os.close(self.port)
        self.port = None


def find_printcore():
    """The class, and why not if there is none."""
    if os.path.isdir(PRINTRUN) and PRINTRUN not in sys.path:
        sys.path.append(PRINTRUN)
    try:
        from printrun import gcoder, printcore
        return (printcore.printcore, gcoder.LightGCode), ""
    except (ImportError, OSError) as error:
        return None, "Debian's printrun is not here: %s" % error


class Printcore:
    """printcore, and the time-out that its user would be: it has none for an `ok` that is lost."""

    def __init__(self, port):
        (core_class, self.gcode_class), _ = find_printcore()
        self.heard_at, self.errors, self.ended = time.monotonic(), 0, threading.Event()
        self.core = core_class()
        self.core.recvcb = self.hear
        self.core.endcb = self.ended.set
        self.core.connect(port, 115200)
        end = time.monotonic() + 30
        while not self.core.online:
            if time.monotonic() > end:
                raise AssertionError("printcore is not online")
            time.sleep(0.05)

    def hear(self, line):
        self.heard_at = time.monotonic()
        self.errors += line.startswith("Error")

    def print_lines(self, lines, timeout_s=180):
        self.ended.clear()
        self.core.startprint(self.gcode_class(lines))
        end = time.monotonic() + timeout_s
        while not self.ended.wait(0.1):
            if time.monotonic() > end:
                raise AssertionError("printcore has not come to its end")
            if time.monotonic() - self.heard_at > SILENCE_S:
                self.heard_at, self.core.clear = time.monotonic(), True

    def close(self):
        self.core.disconnect()
