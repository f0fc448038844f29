#!/usr/bin/env python3
"""Builds every sketch there is with Debian's arduino-builder, and checks that qduino's verdict came. Run by hand: it takes minutes.

    run_builder.py QDUINO [--write] [FOLDER…]     FOLDERs of further libraries, whose examples are built

With --write it writes the table of docs/arduino-ide.md. The sketches: the official examples, our
own, one for each class of library (tests/scenario/arduino_libraries), and the examples of the libraries in FOLDERs.
"""
import concurrent.futures
import pathlib
import re
import sys
import tempfile
from collections import Counter

from ide_builder import ROOT, IdeBuilder, builder_place, clean_environment

PAGE = ROOT / "docs" / "arduino-ide.md"
BEGIN, END = "<!-- made by tests/e2e/qduino/run_builder.py --write -->\n", "<!-- end -->\n"
OFFICIAL = [pathlib.Path("/usr/share/arduino/examples"), ROOT / "build/arduino/usr/share/arduino/examples"]
CLASSES = ROOT / "tests/scenario/arduino_libraries"
# `web_light` and `printer` have sources of their own in a CMake tree.
OURS = ("blink", "listing_2", "pulse_train", "pulse_train_absolute", "web_light")


def sketches(folders):
    """(group, .ino) of each."""
    official = next((place for place in OFFICIAL if place.is_dir()), None)
    for group in sorted(official.glob("[01]*")) if official else []:
        yield from ((group.name, ino) for ino in mains(group))
    yield from (("sketches of this project", ROOT / "sketches" / name / f"{name}.ino") for name in OURS)
    yield from (("classes of libraries", ino) for ino in mains(CLASSES / "sketches"))
    for folder in folders:
        for library in sorted(path for path in folder.iterdir() if path.is_dir()):
            yield from ((f"examples of {library.name}", ino) for ino in mains(library / "examples"))


def mains(folder):
    return sorted(ino for ino in folder.rglob("*.ino") if ino.stem == ino.parent.name)


def build_one(builder, ino, folders):
    """'' when it was built and judged; else the first error."""
    with tempfile.TemporaryDirectory() as build:
        done = builder.build(ino, pathlib.Path(build), [CLASSES / "libraries", *folders])
        if done.returncode == 0 and re.search(r"^Verdict: ", done.stderr, re.M):
            return ""
    errors = re.findall(r"^.*error:.*$", done.stderr, re.M) or done.stderr.splitlines()[-1:]
    return errors[0] if errors else f"status {done.returncode}"


def table(results):
    built, whole = Counter(), Counter()
    for group, _, wrong in results:
        whole[group] += 1
        built[group] += not wrong
    lines = ["| Sketches | built and judged | of |\n", "|---|---|---|\n"]
    lines += [f"| {group} | {built[group]} | {count} |\n" for group, count in whole.items()]
    return "".join(lines) + f"| **together** | **{built.total()}** | **{whole.total()}** |\n"


def main():
    qduino = sys.argv[1]
    folders = [pathlib.Path(word).resolve() for word in sys.argv[2:] if word != "--write"]
    if not builder_place():
        sys.exit("there is no arduino-builder: apt-get install arduino-builder, or ./test, which unpacks it")
    with tempfile.TemporaryDirectory() as place, concurrent.futures.ThreadPoolExecutor(2) as workers:
        builder = IdeBuilder(qduino, pathlib.Path(place) / "Arduino", clean_environment(pathlib.Path(place) / "cache"))
        builder.install()
        waiting = [(group, ino, workers.submit(build_one, builder, ino, folders)) for group, ino in sketches(folders)]
        results = []
        for group, ino, done in waiting:
            results.append((group, ino, done.result()))
            print(f"{group}/{ino.stem}: {results[-1][2] or 'ok'}", flush=True)
    made = table(results)
    print(made)
    if "--write" in sys.argv:
        page = PAGE.read_text(encoding="utf-8")
        PAGE.write_text(page.split(BEGIN)[0] + BEGIN + made + END + page.split(END)[1], encoding="utf-8")
    sys.exit(any(wrong for _, _, wrong in results))


if __name__ == "__main__":
    main()
