"""Does a fuzz see what it is there for? Plants one mistake at a time in the sources, builds, and asks the fuzz. By hand, in a copy of
the sources that nobody else uses.

A mutant is (name, file, changes): each change is a text that stands once in the file, and what stands there instead.
"""

import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]
SHOWN_LINES = 25


def planted(text, changes):
    for each, instead in changes:
        if text.count(each) != 1:
            raise SystemExit("%r stands %d times in the file, and not once" % (each, text.count(each)))
        text = text.replace(each, instead)
    return text


def build(command):
    if command:
        subprocess.run(command, shell=True, check=True, stdout=subprocess.DEVNULL, cwd=ROOT)


def unseen_of(mutants, build_command, fuzz_command, only=""):
    """The names of the mutants that the fuzz ends with 0 on; prints what it says of each."""
    unseen = []
    for name, file, changes in mutants:
        if only not in name:
            continue
        path = ROOT / file
        right = path.read_text(encoding="utf-8")
        try:
            path.write_text(planted(right, changes), encoding="utf-8")
            build(build_command)
            ran = subprocess.run([str(each) for each in fuzz_command], capture_output=True, text=True, check=False)
        finally:
            path.write_text(right, encoding="utf-8")
        lines = ran.stdout.strip().splitlines()
        print("%s\n  %s" % (name, "\n  ".join(lines if len(lines) < SHOWN_LINES else lines[:SHOWN_LINES] + ["…", lines[-1]])), flush=True)
        if ran.returncode == 0:
            unseen.append(name)
    build(build_command)
    print("not seen: %s" % (", ".join(unseen) or "none"))
    return unseen
