"""The tree as check_dead reads it: the tracked files, their code without comments and strings, their comments without code."""
import functools
import json
import pathlib
import re
import subprocess

CPP = (".h", ".cpp", ".ino")
IDENTIFIER = re.compile(r"[A-Za-z_]\w*")

# One pass over C++: a digit separator is no quote, a quote in a comment no string, a slash in a
# string no comment.
PIECES = re.compile(r'(?P<string>R"(?P<mark>[^\s()]*)\(.*?\)(?P=mark)"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\')'
                    r"|(?P<comment>//[^\n]*|/\*.*?\*/)|(?P<number>\b\d[\w']*)|#[ \t]*include[^\n]*", re.S)


def blank(text):
    """Spaces for everything but the ends of lines: what follows keeps its place."""
    return re.sub(r"[^\n]", " ", text)


def code_of(text):
    """Without comments, strings and includes, each line where it was."""
    return PIECES.sub(lambda found: found[0] if found["number"] else blank(found[0]), text)


def without_comments(text):
    return PIECES.sub(lambda found: blank(found[0]) if found["comment"] else found[0], text)


def comments_of(text):
    """The comments alone, each line where it was."""
    kept, at = [], 0
    for found in PIECES.finditer(text):
        if found["comment"]:
            kept += [blank(text[at:found.start()]), found[0]]
            at = found.end()
    return "".join(kept) + blank(text[at:])


def is_ours(path):
    """Code that is not: it is compared with nothing, and what it names is known."""
    return path.endswith(CPP) and "/third_party/" not in path


class Tree:
    """The files below `root` that `paths` names."""

    def __init__(self, root, paths):
        self.root = pathlib.Path(root)
        self.paths = sorted(paths)

    @staticmethod
    def tracked(root):
        listing = subprocess.run(["git", "ls-files", "-co", "--exclude-standard"], cwd=root, capture_output=True, text=True,
                                 check=True)
        return Tree(root, [p for p in listing.stdout.splitlines() if (pathlib.Path(root) / p).is_file()])

    @functools.lru_cache(maxsize=None)
    def text(self, path):
        return (self.root / path).read_text(encoding="utf-8", errors="replace")

    @functools.lru_cache(maxsize=None)
    def code(self, path):
        return code_of(self.text(path))

    def cpp(self, without=("tests/",)):
        return [p for p in self.paths if is_ours(p) and not p.startswith(without)]

    def tags(self, paths):
        """What ctags says of these files: one dictionary a definition or declaration."""
        done = subprocess.run(["ctags", "--output-format=json", "--languages=C++", "--langmap=C++:+.ino", "--fields=+neSkt",
                               "--kinds-C++=+px-l", "-L", "-", "-f", "-"], cwd=self.root, input="\n".join(paths),
                              capture_output=True, text=True, check=True)
        tags = [tag for tag in map(json.loads, done.stdout.splitlines()) if tag["_type"] == "tag"]
        macros = {tag["name"] for tag in tags if tag["kind"] == "macro"}
        # A macro that is used looks like a declaration. So do std::f(x) in a requires clause and
        # static_assert(f()).
        return [tag for tag in tags if (tag["kind"] == "macro" or tag["name"] not in macros)
                and f"std::{tag['name']}" not in tag["pattern"] and "static_assert(" not in tag["pattern"]]
