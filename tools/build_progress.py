"""One line of progress for a build that takes minutes.

    … 2>&1 | tee LOG | python3 build_progress.py

Reads ninja's lines ("[83/171] Building …") and lines that begin with "== " (what is done meanwhile, in words). Steps differ: a file that joins
others takes a hundred times as long as a library, and small ones may come first. So lines that begin with "plan " are taken before: the commands of
all steps (ninja -t commands). What is left is counted in the costs of those. On a terminal one line is
written over and over, each second at least, and is gone at the end; anywhere else there is a plain line every 30 s. All of it goes to
standard error, at once: a line that waits in a buffer is no progress.
"""

import os
import re
import select
import signal
import sys
import time

EVERY_S = 30  # where no terminal is
AGAIN_S = 1  # on one
COLUMNS = 80
BAR = 20
STEP = re.compile(r"^\[(\d+)/(\d+)\]")
COMPILES = re.compile(r"Building CXX| -c \S+\.cxx$| -c \S+\.cpp$")
# Seconds of a step on one core, the mean of three builds by g++ 12.
JOINED_S, FILE_S, OTHER_S = 22, 4.5, 0.2
EARLIEST = 0.05  # of all costs: from less nothing is guessed


def in_words(seconds):
    """"40 s", "5 min 31 s"."""
    seconds = int(seconds)
    return "%d s" % seconds if seconds < 60 else "%d min %d s" % divmod(seconds, 60)


def left_in_words(seconds):
    """Rounded up: nobody minds a build that ends early."""
    if seconds >= 90:
        return "about %d min left" % -(-seconds // 60)
    return "about %d s left" % max(5, -(-seconds // 5) * 5)


def cost(step):
    """The cost of a step by ninja's line for it, or by its command."""
    if not COMPILES.search(step):
        return OTHER_S
    return JOINED_S if "/Unity/" in step else FILE_S


class Progress:
    """What is known of a build; reads no clock."""

    def __init__(self, now):
        self.began = self.counted_from = now
        self.done = self.total = self.most = 0
        self.phase = ""
        self.planned, self.planned_cost, self.cost_done = 0, 0.0, 0.0

    def take(self, line, now):
        """A line of the build. True: there is something new to show."""
        if line.startswith("== "):
            self.phase, self.total = line[3:].strip(), 0
            return True
        if line.startswith("plan "):
            self.planned, self.planned_cost = self.planned + 1, self.planned_cost + cost(line)
            return False
        step = STEP.match(line)
        if not step:
            return False
        done, total = int(step[1]), int(step[2])
        if total != self.total or done < self.done:  # another run of ninja: after cmake ran, it counts anew
            self.counted_from, self.cost_done = now, 0.0
        self.cost_done += cost(line)
        self.done, self.total, self.most = done, total, max(self.most, total)
        return True

    def left_s(self, now):
        """As long again for what is left as for what is done, by its costs; None: too early to say."""
        took = now - self.counted_from
        known = self.planned > 0 and abs(self.planned - self.total) <= 0.1 * self.total
        done, total = (self.cost_done, self.planned_cost) if known else (self.done, self.total)
        early = took < 5 or self.done < 5 or done < EARLIEST * total
        return None if early else took * max(0, total - done) / done

    def line(self, now):
        if self.total == 0:
            return "Building: %s ..." % (self.phase or "it begins")
        full = BAR * self.done // self.total
        left = self.left_s(now) if self.done < self.total else None
        return "Building once  [%s%s]  %d of %d%s" % ("#" * full, "-" * (BAR - full), self.done, self.total,
                                                      "  " + left_in_words(left) if left is not None else "")

    def plain(self, now):
        after = " after " + in_words(now - self.began)
        if self.total == 0:
            return "Building: %s,%s" % (self.phase or "it begins", after)
        left = self.left_s(now)
        return "Building: %d of %d%s%s" % (self.done, self.total, after, ", " + left_in_words(left) if left is not None else "")

    def end(self, now):
        return "Built in %s." % in_words(now - self.began) if self.most > 1 else ""


class Screen:
    """Where it is written; `terminal`: with a line that is written over."""

    def __init__(self, out, terminal, now):
        self.out, self.terminal, self.last = out, terminal, now

    def write(self, text):
        self.out.write(text)
        self.out.flush()

    def show(self, progress, now, changed):
        if self.terminal and (changed or now - self.last >= AGAIN_S):
            self.write("\r%s\033[K" % progress.line(now)[:COLUMNS - 1])
            self.last = now
        elif not self.terminal and now - self.last >= EVERY_S:
            self.write(progress.plain(now) + "\n")
            self.last = now

    def end(self, progress, now):
        said = progress.end(now)
        self.write(("\r\033[K" if self.terminal else "") + (said + "\n" if said else ""))


def follow(descriptor, screen, clock):
    progress, rest = Progress(clock()), b""
    while True:
        changed = False
        if select.select([descriptor], [], [], AGAIN_S)[0]:
            piece = os.read(descriptor, 65536)
            if not piece:
                break
            *lines, rest = (rest + piece).split(b"\n")
            for line in lines:
                changed = progress.take(line.decode(errors="replace"), clock()) or changed
        screen.show(progress, clock(), changed)
    screen.end(progress, clock())


def main():
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    follow(sys.stdin.fileno(), Screen(sys.stderr, sys.stderr.isatty(), time.monotonic()), time.monotonic)


if __name__ == "__main__":
    main()
