#!/usr/bin/env python3
"""Tries published libraries: builds their examples with qduino, and runs each for ten virtual seconds with nothing wired to it. Run by hand.

    try_published.py QDUINO LIBRARIES [--examples N]

LIBRARIES is a folder with a library in each folder, as people install them. Of each, at most N examples (6) are taken, evenly spaced. It prints
a table, a library in each row: how many examples were tried, built, ran and ended, and what the first that did not was lacking. The libraries stay where they are;
nothing of them belongs into this tree.
"""
import argparse
import os
import pathlib
import re
import subprocess
import sys
import tempfile

MOST_SECONDS = 300


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
    results = [try_example(qduino, ino, environment) for ino in examples_of(library, most)]
    built = sum(how != "failed" for how, _ in results)
    ran = sum(how == "ran" for how, _ in results)
    lacks = next((what for _, what in results if what), "")
    return f"| {library.name} | {len(results)} | {built} | {ran} | {lacks} |", (len(results), built, ran)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("qduino", type=pathlib.Path)
    parser.add_argument("libraries", type=pathlib.Path)
    parser.add_argument("--examples", type=int, default=6)
    arguments = parser.parse_args()
    libraries = sorted(folder for folder in arguments.libraries.resolve().iterdir() if folder.is_dir())
    if not libraries:
        sys.exit(f"no library in {arguments.libraries}")
    totals = [0, 0, 0]
    print("| library | examples | build | run 10 s and end | the first that does not |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as cache:
        environment = dict(os.environ, XDG_CACHE_HOME=cache, XDG_STATE_HOME=cache, QDUINO_LIBRARIES=str(arguments.libraries.resolve()),
                           LC_ALL="C.UTF-8")
        for library in libraries:
            line, counts = row(arguments.qduino.resolve(), library, arguments.examples, environment)
            print(line, flush=True)
            totals = [a + b for a, b in zip(totals, counts)]
    print(f"| all | {totals[0]} | {totals[1]} | {totals[2]} | |")


if __name__ == "__main__":
    main()
