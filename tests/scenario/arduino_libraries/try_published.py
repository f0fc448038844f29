#!/usr/bin/env python3
"""Tries published libraries: builds their examples for a Mega and with qduino, and runs each for ten virtual seconds with nothing wired to it. Run by hand.

    try_published.py QDUINO LIBRARIES… [--examples N] [--keep FILE] [--most SECONDS] [--write]

Each of LIBRARIES is a folder with a library in each folder, as people install them. From each, at most N examples (6; 0: all) are taken, evenly spaced:
first one of each library, then the second of each, and so on. An example that Debian's arduino-builder does not build for a Mega is not tried here.

It prints a table, a library in each row: how many examples were tried, built for a Mega, built by qduino, ran and ended; then the reason of each one that
a Mega builds and that failed here. --keep has all results in FILE: a survey that was interrupted, or ended by --most, goes on where it was; take lines out
of FILE to try them again. --write puts table and reasons into docs/arduino-libraries.md. The libraries stay where they are; nothing of them belongs into
this tree.
"""
import argparse
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import textwrap
import time

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "tests" / "e2e" / "qduino"), str(ROOT / "tests" / "oracle" / "sketch")]
import boards  # noqa: E402
from ide_builder import clean_environment  # noqa: E402

MOST_SECONDS = 900  # of a build or a run
PAGE = ROOT / "docs" / "arduino-libraries.md"
BEGIN, END = "<!-- made by tests/scenario/arduino_libraries/try_published.py --write -->\n", "<!-- end of published -->\n"


def examples_of(library, most):
    """At most so many of its sketches, evenly spaced. Old ones are .pde files, and so are Processing's sketches, which no Mega builds."""
    sketches = [path for ending in ("ino", "pde") for path in library.rglob(f"*.{ending}")]
    found = sorted(path for path in sketches if path.stem == path.parent.name)
    return [found[i * len(found) // most] for i in range(most)] if 0 < most < len(found) else found


def reason(log):
    """What a build or a run that failed says first."""
    found = re.search(r"no library here has \S+|(?:fatal )?error: .*|Verdict: .*", log)
    return found[0].strip()[:160] if found else "nothing said"


class Trial:
    """What each example did, by its library and name: 'a Mega refuses it', 'failed', 'built' or 'ran', and why."""

    def __init__(self, arguments, folder):
        self.qduino, self.keep = arguments.qduino.resolve(), arguments.keep
        self.folders = [each.resolve() for each in arguments.libraries]
        self.mega = boards.Mega(folder)
        self.environment = dict(clean_environment(folder), QDUINO_LIBRARIES=":".join(map(str, self.folders)))
        self.results = {}
        if self.keep and self.keep.exists():
            self.results = dict(json.loads(line) for line in self.keep.read_text(encoding="utf-8").splitlines())

    def result_of(self, library, ino):
        return self.results.get(f"{library.name}/{ino.stem}")

    def take(self, library, ino):
        name = f"{library.name}/{ino.stem}"
        self.results[name] = self.tried(ino)
        print(f"{name}: {': '.join(self.results[name])}", file=sys.stderr, flush=True)
        if self.keep:
            with self.keep.open("a", encoding="utf-8") as lines:
                lines.write(json.dumps([name, self.results[name]]) + "\n")

    def tried(self, ino):
        try:
            if self.mega.build(ino, self.folders, MOST_SECONDS).returncode:
                return "a Mega refuses it", ""
            built = self.ours("build", ino.parent, "--only", "sim")
            if built.returncode:
                return "failed", reason(built.stderr)
            ran = self.ours("sim", ino.parent, "--for", "10")
        except subprocess.TimeoutExpired as late:
            return "built", f"{late.cmd[1]} did not end in {MOST_SECONDS} s"
        return ("ran", "") if ran.returncode == 0 else ("built", reason(ran.stderr))

    def ours(self, *words):
        return subprocess.run([self.qduino, *words], env=self.environment, stdin=subprocess.DEVNULL, capture_output=True, text=True,
                              errors="replace", timeout=MOST_SECONDS, check=False)


def version_of(library):
    """As library.properties says; nothing where it does not."""
    properties = library / "library.properties"
    found = re.search(r"^version=(\S+)", properties.read_text(encoding="utf-8", errors="replace"), re.M) if properties.exists() else None
    return found[1] if found else ""


def table(trial, chosen):
    lines = ["| library | version | examples | tried | built for a Mega | of these by `qduino` | run 10 s and end |", "|---|---|---|---|---|---|---|"]
    totals, reasons = [0] * 5, []
    for library, examples in chosen.items():
        results = {ino.stem: result for ino in examples if (result := trial.result_of(library, ino))}
        how = [each for each, _ in results.values()]
        there = len(how) - how.count("a Mega refuses it")
        counts = [len(examples_of(library, 0)), len(how), there, there - how.count("failed"), how.count("ran")]
        lines.append(f"| {library.name} | {version_of(library)} | " + " | ".join(map(str, counts)) + " |")
        totals = [a + b for a, b in zip(totals, counts)]
        reasons += ["\n".join(textwrap.wrap(f"- {library.name}: {name}: {why.replace('.ino:', ', line ')}", 100, subsequent_indent="  "))
                    for name, (what, why) in results.items() if what in ("failed", "built")]
    lines.append("| all | | " + " | ".join(map(str, totals)) + " |")
    # A compiler's words are no Markdown.
    return "".join(f"{line}\n" for line in lines), "".join(f"{line.replace('<', '&lt;').replace('|', chr(92) + '|')}\n" for line in reasons)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("qduino", type=pathlib.Path)
    parser.add_argument("libraries", type=pathlib.Path, nargs="+")
    parser.add_argument("--examples", type=int, default=6)
    parser.add_argument("--keep", type=pathlib.Path)
    parser.add_argument("--most", type=float, default=float("inf"))
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_args()
    libraries = sorted((path for folder in arguments.libraries for path in folder.iterdir() if examples_of(path, 0)), key=lambda path: path.name)
    if not libraries:
        sys.exit(f"no library with an example in {', '.join(map(str, arguments.libraries))}")
    if missing := [each for each in boards.Mega.missing() if each != "simavr"]:
        sys.exit(f"not installed: {', '.join(missing)}")
    chosen = {library: examples_of(library, arguments.examples) for library in libraries}
    until = time.monotonic() + arguments.most
    with tempfile.TemporaryDirectory() as folder:
        trial = Trial(arguments, pathlib.Path(folder))
        rounds = max(map(len, chosen.values()))
        for library, ino in ((library, examples[i]) for i in range(rounds) for library, examples in chosen.items() if i < len(examples)):
            if not trial.result_of(library, ino) and time.monotonic() < until:
                trial.take(library, ino)
        made, reasons = table(trial, chosen)
    print(made + "\n" + reasons)
    if arguments.write:
        before, rest = PAGE.read_text(encoding="utf-8").split(BEGIN)
        PAGE.write_text(before + BEGIN + made + "\nThese failed, though a Mega builds them:\n\n" + reasons + END + rest.split(END)[1], encoding="utf-8")


if __name__ == "__main__":
    main()
