#!/usr/bin/env python3
"""What no program reaches, what is declared and has no body, and what comments and pages name although it does not exist.

Run from anywhere: `tools/check_dead.py`. Prints one line per finding, `file:line: what (what to do)`, and exits 1 if any.
tools/dead/ has the parts: source.py reads the tree, reach.py follows names from `main`, names.py compares prose with code.
Needs Debian's universal-ctags; takes some seconds.

What is left on purpose stands in tools/dead/allowed.txt, one line each: KIND PATH NAME  # reason. PATH and NAME may have `*`. NAME may be
several with commas. An entry without a reason is an error, and so is a name that matches nothing any more.

Its limits: names are compared without their types, so a dead function that shares its name with a living one of a living class
passes; what the functions of the Arduino face (arduino/) reach counts as reached; the page's TypeScript is the compiler's.
"""
import fnmatch
import pathlib
import sys

sys.dont_write_bytecode = True

from dead.names import Names  # noqa: E402
from dead.reach import Reach  # noqa: E402
from dead.source import Tree  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parent.parent
ALLOWED = "tools/dead/allowed.txt"

ADVICE = {
    "dead": "no program reaches it: wire or delete it",
    "bodiless": "declared, and no body anywhere: delete the declaration",
    "file": "no such file: say what is meant now",
    "folder": "no such folder: say what is meant now",
    "section": "no such section, and no published source",
    "name": "no code has this name: say what is meant now",
    "flag": "no program takes this flag",
    "endpoint": "no route fits",
}


class Allowed:
    """The allow-list: `text` is its file's."""

    def __init__(self, text):
        self.entries = []
        self.faults = []
        for number, line in enumerate(text.split("\n"), 1):
            if not line.strip() or line.startswith("#"):
                continue
            pattern, _, reason = line.partition("  # ")
            parts = pattern.split()
            if len(parts) != 3 or parts[0] not in ADVICE or not reason.strip():
                self.faults.append((number, "KIND PATH NAME  # reason is the form of an entry"))
                continue
            self.entries += [[number, parts[0], parts[1], name, 0] for name in parts[2].split(",")]

    def allows(self, kind, path, name):
        found = False
        for entry in self.entries:
            _, its_kind, its_path, its_name, _ = entry
            if kind == its_kind and fnmatch.fnmatchcase(path, its_path) and fnmatch.fnmatchcase(name, its_name):
                entry[4] += 1
                found = True
        return found

    def unused(self):
        return [(entry[0], f"nothing is found for '{entry[1]} {entry[2]} {entry[3]}': take the entry out")
                for entry in self.entries if entry[4] == 0]


def findings(tree):
    """(kind, path, line, name) of everything in this tree, allowed or not."""
    reach = Reach(tree)
    yield from (("dead", path, line, name) for path, line, name in reach.dead())
    yield from (("bodiless", path, line, name) for path, line, name in reach.bodiless())
    yield from ((kind, path, line, name) for path, line, kind, name in Names(tree).unknown())


def check(tree, allowed_text):
    """The lines to print: none when all is well."""
    allowed = Allowed(allowed_text)
    lines = [f"{path}:{line}: {name} ({ADVICE[kind]})" for kind, path, line, name in sorted(findings(tree))
             if not allowed.allows(kind, path, name)]
    return lines + [f"{ALLOWED}:{number}: {what}" for number, what in allowed.faults + allowed.unused()]


def main():
    tree = Tree.tracked(ROOT)
    lines = check(tree, tree.text(ALLOWED))
    for line in lines:
        print(line)
    print(f"dead: {len(tree.paths)} files, {len(lines)} findings")
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
