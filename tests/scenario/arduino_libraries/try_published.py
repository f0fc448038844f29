#!/usr/bin/env python3
"""Tries published libraries: builds their examples with arduino-builder and with qduino, and runs each for ten virtual seconds with nothing wired to it. Run by hand.

    try_published.py QDUINO LIBRARIES… [--examples N] [--write]

Each of LIBRARIES is a folder with a library in each folder, as people install them. Of each, at most N examples (6) are taken, evenly spaced. It prints
a table, a library in each row: how many examples were tried, built by Debian's arduino-builder, built by qduino, ran and ended, and what the first that
did not was lacking. --write puts it into docs/arduino-libraries.md. The libraries stay where they are; nothing of them belongs into this tree.
"""
import argparse
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "e2e" / "qduino"))
from ide_builder import IdeBuilder, builder_place, clean_environment  # noqa: E402
from run_builder import build_one  # noqa: E402

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


def version_of(library):
    """As library.properties says; nothing where it does not."""
    properties = library / "library.properties"
    found = re.search(r"^version=(\S+)", properties.read_text(encoding="utf-8", errors="replace"), re.M) if properties.exists() else None
    return found[1] if found else ""


def row(builder, library, most, folders):
    examples = examples_of(library, most)
    by_builder = [build_one(builder, ino, folders) for ino in examples]
    results = [try_example(builder.qduino, ino, builder.environment) for ino in examples]
    counts = (len(results), by_builder.count(""), sum(how != "failed" for how, _ in results), sum(how == "ran" for how, _ in results))
    lacks = [f"{ino.stem}: {what or wrong}" for ino, (_, what), wrong in zip(examples, results, by_builder) if what or wrong]
    for lack in lacks:
        print(f"  {lack}", file=sys.stderr, flush=True)
    return "| " + " | ".join([library.name, version_of(library), *map(str, counts), lacks[0] if lacks else ""]) + " |", counts


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
    if not builder_place():
        sys.exit("there is no arduino-builder: apt-get install arduino-builder, or ./test, which unpacks it")
    totals = [0, 0, 0, 0]
    lines = ["| library | version | examples | built by `arduino-builder` | by `qduino` | run 10 s and end | the first that does not |",
             "|---|---|---|---|---|---|---|"]
    print(*lines, sep="\n")
    with tempfile.TemporaryDirectory() as cache:
        environment = dict(clean_environment(pathlib.Path(cache)), QDUINO_LIBRARIES=":".join(map(str, folders)))
        builder = IdeBuilder(arguments.qduino.resolve(), pathlib.Path(cache) / "Arduino", environment)
        builder.install()
        for library in libraries:
            line, counts = row(builder, library, arguments.examples, folders)
            print(line, flush=True)
            lines.append(line)
            totals = [a + b for a, b in zip(totals, counts)]
    lines.append("| all | | " + " | ".join(map(str, totals)) + " | |")
    print(lines[-1])
    if arguments.write:
        write("".join(f"{line}\n" for line in lines))


if __name__ == "__main__":
    main()
