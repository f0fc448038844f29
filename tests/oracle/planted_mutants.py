"""Does a fuzz see what it is there for? Plants one mistake at a time in the sources, builds, and asks the fuzz. By hand, in a copy of
the sources that nobody else uses.

A mutant is (name, file, changes): each change is a text that stands once in the file, and what stands there instead.
"""

import pathlib
import shutil
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]
SHOWN_LINES = 25


def planted(text, changes):
    for each, instead in changes:
        if text.count(each) != 1:
            raise SystemExit("%r stands %d times in the file, and not once" % (each, text.count(each)))
        text = text.replace(each, instead)
    return text


def copy_sources(folder):
    """What git knows of, as it stands. What is the same is not touched, so that a build there goes on from where it was."""
    names = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True).stdout.split("\0")
    for name in filter(None, names):
        source, place = ROOT / name, folder / name
        if not source.exists() or (place.exists() and place.read_bytes() == source.read_bytes()):
            continue
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(source, place)


def build(command, root):
    if not command:
        return
    done = subprocess.run(command, shell=True, stdout=subprocess.PIPE, text=True, cwd=root, check=False)
    if done.returncode != 0:
        raise SystemExit("it cannot be built:\n%s" % done.stdout[-2000:])


def unseen_of(mutants, build_command, fuzz_command, only="", root=ROOT):
    """The names of the mutants that the fuzz ends with 0 on; prints what it says of each. The fuzz command may be a function of the name."""
    unseen = []
    for name, file, changes in mutants:
        if only not in name:
            continue
        path = root / file
        command = fuzz_command(name) if callable(fuzz_command) else fuzz_command
        right = path.read_text(encoding="utf-8")
        try:
            path.write_text(planted(right, changes), encoding="utf-8")
            build(build_command, root)
            ran = subprocess.run([str(each) for each in command], capture_output=True, text=True, check=False)
        finally:
            path.write_text(right, encoding="utf-8")
        lines = ran.stdout.strip().splitlines()
        print("%s\n  %s" % (name, "\n  ".join(lines if len(lines) < SHOWN_LINES else lines[:SHOWN_LINES] + ["…", lines[-1]])), flush=True)
        if ran.returncode == 0:
            unseen.append(name)
    build(build_command, root)
    print("not seen: %s" % (", ".join(unseen) or "none"))
    return unseen
