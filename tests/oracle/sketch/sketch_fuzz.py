"""Runs random sketches on an Arduino Mega (avr-gcc, in simavr) and here, and compares what they print.

    sketch_fuzz.py QDUINO [--seconds S | --count N] [--probes P] [--seed K] [--keep FOLDER] [--without KINDS] [--first]

A sketch holds P probes: expressions, formats, scans, overloads, declarations, names (probes.py). What the Mega's compiler refuses is left
out, and counted. Then each probe has to build here and print the same. One paragraph per difference; a seed and a number make the probe
again. It ends with 0 only when there was none, and with 77 where the Mega's tools are missing.
"""

import argparse
import collections
import pathlib
import re
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import boards  # noqa: E402
import campaign  # noqa: E402
import probes  # noqa: E402

END = """
#ifdef __AVR__
#include <avr/sleep.h>
static void end_here() { Serial.flush(); cli(); sleep_enable(); sleep_cpu(); }
#else
static void end_here() { Serial.flush(); }
#endif
"""
# Their early part holds functions. The Mega's builder writes prototypes before the first function,
# so all types stand before it.
LATE = ("a format through a template", "an overload", "a template")


class Sketch:
    """Some probes as one .ino, and whose each line is."""

    def __init__(self, chosen):
        self.lines, self.owner = [], {}
        self.add(None, "#include <stdarg.h>")
        ordered = sorted(chosen.items(), key=lambda item: item[1].kind in LATE)
        for number, probe in ordered:
            self.add(number, probe.before)
        self.add(None, END)
        for number, probe in chosen.items():
            self.add(number, "void probe_%d() {\n%s\n}" % (number, probe.body))
        calls = "".join('  Serial.println(F("#%d")); probe_%d();\n' % (number, number) for number in chosen)
        self.add(None, "void setup() {\n  Serial.begin(1000000);\n%s  Serial.println(F(\"#end\"));\n  end_here();\n}\nvoid loop() { delay(1000); }" % calls)
        for number, probe in chosen.items():
            self.add(number, probe.after)
        self.text = "\n".join(self.lines) + "\n"

    def add(self, number, text):
        for line in text.split("\n"):
            self.lines.append(line)
            self.owner[len(self.lines)] = number

    def owners(self, lines):
        return {self.owner.get(line) for line in lines} - {None}


def parts(text):
    """{number: what its probe printed}."""
    found = {}
    for part in re.split(r"(?m)^#(?=\d+$|end$)", text)[1:]:
        head, _, rest = part.partition("\n")
        if head != "end":
            found[int(head)] = rest.strip("\n").rstrip()
    return found


def build_what_can_be(board, chosen, sketch_file):
    """(outcome, {number: why it was refused, or ended the run}); takes these probes out of `chosen`."""
    out = {}
    while chosen:
        sketch = Sketch(chosen)
        sketch_file.write_text(sketch.text, encoding="utf-8")
        outcome = board.run(sketch_file)
        if is_whole(outcome):
            return outcome, out
        bad = sketch.owners(outcome.refused_lines) & set(chosen)
        if outcome.is_built and parts(outcome.text):
            bad = {list(parts(outcome.text))[-1]}  # it ended within this probe
        if not bad:  # the error is at no probe's own line, or nothing was printed: the half that runs is kept
            bad = blamed_half(board, chosen, sketch_file) if len(chosen) > 1 else set(chosen)
        for number in bad:
            out[number] = outcome.said
            del chosen[number]
    return None, out


def blamed_half(board, chosen, sketch_file):
    half = dict(list(chosen.items())[:len(chosen) // 2])
    sketch_file.write_text(Sketch(half).text, encoding="utf-8")
    if not is_whole(board.run(sketch_file)):
        return blamed_half(board, half, sketch_file) if len(half) > 1 else set(half)
    rest = {number: probe for number, probe in chosen.items() if number not in half}
    return blamed_half(board, rest, sketch_file) if len(rest) > 1 else set(rest)


def is_whole(outcome):
    """The sketch was built, and came to its end."""
    return outcome.is_built and "#end" in outcome.text


class Fuzz:
    def __init__(self, options, folder):
        self.options = options
        self.mega = boards.Mega(folder)
        self.ours = boards.Ours(options.qduino)
        self.file = folder / "sketch" / "sketch.ino"
        self.file.parent.mkdir()
        self.used, self.not_for_a_mega = collections.Counter(), 0
        self.sketches = self.differences = 0

    def difference(self, seed, number, probe, mega, ours):
        self.differences += 1
        text = "seed %d, probe %d: %s\n%s%s\n%s  Mega: %r\n  here: %r\n" % (seed, number, probe.kind, probe.before, probe.body, probe.after, mega, ours)
        print(text, flush=True)
        if self.options.keep:
            self.options.keep.mkdir(parents=True, exist_ok=True)
            (self.options.keep / ("%d-%d.txt" % (seed, number))).write_text(text + "\n" + Sketch({number: probe}).text, encoding="utf-8")

    def one(self, seed):
        made = {number: probes.make(seed, number) for number in range(self.options.probes)}
        chosen = {number: probe for number, probe in made.items() if not re.search(self.options.without, probe.kind)}
        self.sketches += 1
        on_mega, refused_there = build_what_can_be(self.mega, chosen, self.file)
        self.not_for_a_mega += len(refused_there)
        if not on_mega:
            return
        meant = parts(on_mega.text)
        everything = dict(chosen)
        here, refused_here = build_what_can_be(self.ours, chosen, self.file)
        said = parts(here.text) if here else {}
        for number, probe in everything.items():
            self.used[probe.kind] += 1
            if number not in meant:
                print("seed %d: the Mega stopped before probe %d (%s)" % (seed, number, probe.kind), flush=True)
                self.not_for_a_mega += 1
            elif number in refused_here:
                errors = [line for line in refused_here[number].splitlines() if "error" in line]
                why = "does not build: " + "; ".join(errors)[:300] if errors else "ends the run: " + refused_here[number][-300:]
                self.difference(seed, number, probe, meant[number], why)
            elif said.get(number) != meant[number]:
                self.difference(seed, number, probe, meant[number], said.get(number))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("qduino")
    campaign.add_options(parser, count=3)
    parser.add_argument("--probes", type=int, default=60)
    parser.add_argument("--without", default="(?!)", help="a pattern of the kinds of probes that are left out")
    options = parser.parse_args()
    missing = boards.Mega.missing()
    if missing:
        print("not installed: " + ", ".join(missing))
        return 77
    with tempfile.TemporaryDirectory() as folder:
        fuzz = Fuzz(options, pathlib.Path(folder))
        for seed in campaign.seeds(options):
            fuzz.one(seed)
            if options.first and fuzz.differences:
                break
    print("%d sketches, %d probes, %d that a Mega does not build or run, %d differences; %s" % (
        fuzz.sketches, sum(fuzz.used.values()), fuzz.not_for_a_mega, fuzz.differences,
        ", ".join("%s %d" % each for each in sorted(fuzz.used.items()))))
    return 1 if fuzz.differences or not fuzz.used else 0


if __name__ == "__main__":
    sys.exit(main())
