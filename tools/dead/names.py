"""Names in comments and pages that name nothing: files, sections, functions, flags, endpoints.

    // … the heater watch (heat/watch.h)     no file's path has this end
    // On the limits see DESIGN §6.           no page of that name, or none of its headings begins with 6
    /// `set_gains()` changes them.           no code has that word
    | `printd --quiet` |                      no program, script or build file has that flag
    | `POST /api/v1/reboot` |                 no row of the routes fits

Comments of C++ and all Markdown are read. A word is known when any file of the tree but a page has it outside of comments,
in a string too (fields of JSON, units): so a name that only a test still has is not found here.
"""
import functools
import re

from dead.source import CPP, IDENTIFIER, comments_of, without_comments, is_ours

FILE = re.compile(r"(?<![\w/.*<-])((?:[\w.-]+/)*[\w-]+\.(?:h|cpp|ino|py|sh|mjs|tsx?|md|cmake))(?![\w*/(])")
FOLDER = re.compile(r"^[\w.-]+(?:/[\w.-]+)*/?$")
SECTION = re.compile(r"([\w.]+)(?:,| of)?\s+§+\s*([\w.]+)")
# What has sections and is not ours.
PUBLISHED = re.compile(r"RFC \d+|psABI|AAPCS64|RTAS 20\d\d|ECRTS 20\d\d")
QUOTED = re.compile(r"`([^`\n]+)`")
NAME = re.compile(r"^~?[A-Za-z_]\w*(?:(?:::|\.|->)~?\w+)*(?:\(\))?$")
CALL = re.compile(r"(?<![\w:.])((?:\w+::)*~?[A-Za-z_]\w*)\(\)|\b((?:[A-Za-z_]\w*::)+[A-Za-z_]\w*)")
FLAG = re.compile(r"(?<![\w-])(--[a-z][a-z0-9]*(?:-[a-z0-9]+)*)(?![\w])")
ENDPOINT = re.compile(r"\b(GET|POST|PUT|PATCH|DELETE) (/[^\s`?,;:)|]*)")
NOT_NAMING = (".md", ".json", ".svg", ".lock", "LICENSE")  # a word in these proves nothing
OURS = ("tools/dead/", "tools/check_dead.py", "tests/static/")  # nor in these: they name what does not exist, for examples


class Names:
    def __init__(self, tree):
        self.tree = tree

    @functools.cached_property
    def words(self):
        found = set()
        for path in self.tree.paths:
            if not path.endswith(NOT_NAMING) and not path.startswith(OURS):
                found |= set(IDENTIFIER.findall(self.naming_text(path)))
        return found

    def naming_text(self, path):
        text = self.tree.text(path)
        return without_comments(text) if path.endswith(CPP) else text

    @functools.cached_property
    def flags(self):
        """All that programs, scripts and build files take or pass on; what only a test passes is not known."""
        found = set()
        for path in self.tree.paths:
            if not path.endswith(NOT_NAMING) and not path.startswith(("tests/", *OURS)):
                found |= set(FLAG.findall(re.sub(r"[!{]--", " --", self.naming_text(path))))
        return found

    @functools.cached_property
    def routes(self):
        found = set()
        for path in self.tree.paths:
            if path.startswith("web/") and path.endswith(CPP):
                found |= set(re.findall(r'"(/[^"\s]*)"', self.naming_text(path)))
        return found

    @functools.cached_property
    def folders(self):
        found = set()
        for path in self.tree.paths:
            parts = path.split("/")[:-1]
            for begin in range(len(parts)):
                for end in range(begin + 1, len(parts) + 1):
                    found.add("/".join(parts[begin:end]))
        return found

    # ---- what is asked of each kind --------------------------------------------------------------

    def has_file(self, name):
        return any(path == name or path.endswith("/" + name) for path in self.tree.paths)

    def has_section(self, page, number):
        name = page if page.endswith(".md") else page + ".md"
        pages = [p for p in self.tree.paths if p.lower() == name.lower() or p.lower() == "docs/" + name.lower()]
        return any(re.search(r"^#+ *" + re.escape(number) + r"\b", self.tree.text(p), re.M) for p in pages)

    def has_route(self, path):
        """`ID` and `NAME.gcode` stand for anything; a route's `*` is one piece, a last `**` all that are left."""
        given = [None if re.match(r"^[A-Z]", piece) else piece for piece in path.strip("/").split("/")]

        def fits(route):
            known = route.strip("/").split("/")
            if known[-1] == "**" and len(known) <= len(given):
                return known[:-1] == given[:len(known) - 1]
            return len(known) == len(given) and all(k in ("*", g) or (g is None and "*" in k) for k, g in zip(known, given))
        return any(fits(route) for route in self.routes)

    def knows(self, name):
        return all(word in self.words for word in IDENTIFIER.findall(name))

    # ---- the pages and comments ------------------------------------------------------------------

    def unknown(self):
        """(path, line, kind, name) of each name that names nothing."""
        for path in self.tree.paths:
            if is_ours(path):
                yield from self.in_text(path, comments_of(self.tree.text(path)), is_page=False)
            elif path.endswith(".md") and "/third_party/" not in path:
                yield from self.in_text(path, self.tree.text(path), is_page=True)

    def in_text(self, path, text, is_page):
        before = ""
        for number, line in enumerate(text.split("\n"), 1):
            if line.strip():
                for kind, name in self.in_line(path, line, before, is_page):
                    yield path, number, kind, name
            before = line

    def in_line(self, path, line, before, is_page):
        for name in FILE.findall(line):
            here = "/".join(path.split("/")[:-1] + [name])
            if not self.has_file(name) and here not in self.tree.paths:
                yield "file", name
        for found in SECTION.finditer(line):
            cited = PUBLISHED.search(before + line[:found.end()])
            if not cited and not self.has_section(found[1], found[2]):
                yield "section", f"{found[1]} §{found[2]}"
        for flag in FLAG.findall(line):
            if flag not in self.flags:
                yield "flag", flag
        for method, route in ENDPOINT.findall(line):
            if not self.has_route(route):
                yield "endpoint", f"{method} {route}"
        yield from self.code_in_line(line, is_page)

    def code_in_line(self, line, is_page):
        for name in QUOTED.findall(line):
            if FOLDER.match(name) and "/" in name and name.split("/")[0] in self.folders and not FILE.search(name):
                if name.strip("/") not in self.folders and not self.has_file(name):
                    yield "folder", name
            elif NAME.match(name) and not FILE.search(name) and not self.knows(name):
                yield "name", name
        if is_page:
            return
        for called, scoped in CALL.findall(QUOTED.sub(" ", line)):
            name = called or scoped
            if not name.startswith("std::") and not self.knows(name):
                yield "name", name + ("()" if called else "")
