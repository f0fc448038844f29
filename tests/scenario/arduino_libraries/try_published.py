#!/usr/bin/env python3
"""Tries published libraries: builds their examples with qduino, and runs each for ten virtual seconds with nothing wired to it. Run by hand.

    try_published.py QDUINO LIBRARIES… [--examples N] [--write]

Each of LIBRARIES is a folder with a library in each folder, as people install them. Of each, at most N examples (6) are taken, evenly spaced. It prints
a table, a library in each row: how many examples were tried, built, ran and ended, and what the first that did not was lacking. --write puts it into
docs/arduino-libraries.md. The libraries stay where they are; nothing of them belongs into this tree.
"""
import argparse
import os
import pathlib
import re
import subprocess
import sys
import tempfile

MOST_SECONDS = 300
PAGE = pathlib.Path(__file__).resolve().parents[3] / "docs" / "arduino-libraries.md"
BEGIN, END = "<!-- made by tests/scenario/arduino_libraries/try_published.py --write -->\n", "<!-- end of published -->\n"


def examples_of(library, most):
    """At most so many of its sketches, evenly spaced."""
    found = sorted(ino for ino in library.rglob("*.ino") if ino.stem == ino.parent.name)
    return [found[i * len(found) // most] for i in range(most)] if len(found) > most else found


def reason(log):
    """What a build or a run that failed says first."""
    found = re.search(r"no library here has \S+|(?:fatal )?error: .*|Verdict: .*", log)
    return found[0].strip().replace("|", "\\|")[:100] if found else "nothing said"


def try_example(qduino, ino, environment):
    """('ran' | 'built' | 'failed', what it lacks)."""
    command = [qduino, "sim", ino.parent, "--for", "10"]
    try:
        done = subprocess.run(command, env=environment, stdin=subprocess.DEVNULL, capture_output=True, timeout=MOST_SECONDS, check=False)
    except subprocess.TimeoutExpired:
        return "built", f"did not end in {MOST_SECONDS} s"
    log = done.stderr.decode("utf-8", "replace")
    if done.returncode == 0:
        return "ran", ""
    return ("failed" if "error:" in log or "no library here" in log else "built"), reason(log)


def row(qduino, library, most, environment):
    examples = examples_of(library, most)
    results = [try_example(qduino, ino, environment) for ino in examples]
    built = sum(how != "failed" for how, _ in results)
    ran = sum(how == "ran" for how, _ in results)
    lacks = next((f"{ino.stem}: {what}" for ino, (_, what) in zip(examples, results) if what), "")
    return f"| {library.name} | {len(results)} | {built} | {ran} | {lacks} |", (len(results), built, ran)


def write(table):
    """Puts the table into the page."""
    before, rest = PAGE.read_text(encoding="utf-8").split(BEGIN)
    PAGE.write_text(before + BEGIN + table + END + rest.split(END)[1], encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("qduino", type=pathlib.Path)
    parser.add_argument("libraries", type=pathlib.Path, nargs="+")
    parser.add_argument("--examples", type=int, default=6)
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_args()
    folders = [folder.resolve() for folder in arguments.libraries]
    libraries = sorted((library for folder in folders for library in folder.iterdir() if any(library.rglob("*.ino"))), key=lambda path: path.name)
    if not libraries:
        sys.exit(f"no library with an example in {', '.join(map(str, folders))}")
    totals = [0, 0, 0]
    lines = ["| library | examples | build | run 10 s and end | the first that does not |", "|---|---|---|---|---|"]
    print(*lines, sep="\n")
    with tempfile.TemporaryDirectory() as cache:
        environment = dict(os.environ, XDG_CACHE_HOME=cache, XDG_STATE_HOME=cache, QDUINO_LIBRARIES=":".join(map(str, folders)),
                           LC_ALL="C.UTF-8")
        for library in libraries:
            line, counts = row(arguments.qduino.resolve(), library, arguments.examples, environment)
            print(line, flush=True)
            lines.append(line)
            totals = [a + b for a, b in zip(totals, counts)]
    lines.append(f"| all | {totals[0]} | {totals[1]} | {totals[2]} | |")
    print(lines[-1])
    if arguments.write:
        write("".join(f"{line}\n" for line in lines))


if __name__ == "__main__":
    main()
