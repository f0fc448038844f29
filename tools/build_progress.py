"""One line of progress for a build that takes minutes.

    … 2>&1 | tee LOG | python3 build_progress.py

Reads ninja's lines ("[83/171] Building …") and lines that begin with "== " (what is done meanwhile, in words). On a terminal one line is
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


def in_words(seconds):
    """"40 s", "5 min 31 s"."""
    seconds = int(seconds)
    return "%d s" % seconds if seconds < 60 else "%d min %d s" % divmod(seconds, 60)


def left_in_words(seconds):
    """Rounded up: nobody minds a build that ends early."""
    if seconds >= 90:
        return "about %d min left" % -(-seconds // 60)
    return "about %d s left" % max(5, -(-seconds // 5) * 5)


class Progress:
    """What is known of a build; reads no clock."""

    def __init__(self, now):
        self.began = self.counted_from = now
        self.done = self.total = self.most = 0
        self.phase = ""

    def take(self, line, now):
        """A line of the build. True: there is something new to show."""
        if line.startswith("== "):
            self.phase, self.total = line[3:].strip(), 0
            return True
        step = STEP.match(line)
        if not step:
            return False
        done, total = int(step[1]), int(step[2])
        if total != self.total or done < self.done:  # another run of ninja: after cmake ran, it counts anew
            self.counted_from = now
        self.done, self.total, self.most = done, total, max(self.most, total)
        return True

    def left_s(self, now):
        """As long again for each step as for those that are done; None: too early to say."""
        took = now - self.counted_from
        return took * (self.total - self.done) / self.done if self.done >= 5 and took >= 5 else None

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
