"""Which definitions a program reaches, and which declarations have no body.

A definition is a node: a function, a class, an enumerator, a constant, a member. Its text names others. A node lives when
living text names it, and its class lives; what stands outside of all nodes (registrations, tables that are not constexpr), `main`,
the sketches and everything that a sketch may call (arduino/) lives from the start. So does what an assembly file calls.

    main ──names──► Printer ──names──► plan() ──names──► Planner, append()      living
    only a test ──names──► Endstop ──names──► steady_                           dead: nothing living names it

Names are compared, types are not known, but files are: a name can only mean what one translation unit sees together with it. So a dead
`clear()` is missed while another `clear()` is called near it; nothing that is called is blamed. What only a macro puts together (`a ## b`)
is taken for dead.
"""
import collections
import re

from dead.source import IDENTIFIER

CLASSES = {"class", "struct", "union", "enum"}
ALWAYS = ("arduino/", "sketches/")

# The language, the standard library, nlohmann's JSON and Boost.Asio ask for these by name.
PROTOCOL = {"main", "begin", "end", "what", "value_type", "get_executor", "executor_type", "next_layer", "next_layer_type",
            "async_read_some", "async_write_some", "async_teardown", "iterator_category", "difference_type", "pointer", "reference",
            "iterator_concept", "rep", "period", "is_steady", "setup", "loop"}


class Node:
    """All definitions and declarations of one name in one class (or outside of all)."""

    def __init__(self, owner, name):
        self.owner, self.name = owner, name
        self.places = []    # (path, line)
        self.names = set()  # what its text names: (name, path of the text)
        self.always = False
        self.overrides = False  # called through its base, from wherever that is known


class Reach:
    def __init__(self, tree):
        self.tree = tree
        self.paths = tree.cpp()
        self.tags = tree.tags(self.paths)
        self.class_names = {t["name"] for t in self.tags if t["kind"] in CLASSES}
        self.nodes = {}
        self.root_names = set()
        assembly = "\n".join(tree.text(p) for p in tree.paths if p.endswith(".S"))
        self.called_in_assembly = set(re.findall(r"\bcall\s+(\w+)", assembly)) | set(re.findall(r"\$([a-z]\w*)", assembly))
        self.labels = set(re.findall(r"^(\w+):", assembly, re.M))
        self.seen_with = self.read_includes()
        self.virtual = {t["name"] for t in self.tags if t["kind"] in ("prototype", "function") and "virtual" in self.line_of(t)}
        self.read()

    # ---- reading ---------------------------------------------------------------------------------

    def read_includes(self):
        """path → all files that stand with it in a translation unit."""
        ours = set(self.paths)
        by_name = {p.rpartition("/")[2]: p for p in self.paths if re.fullmatch(r"arduino/(libraries/\w+/)?[^/]+", p)}
        included = {p: {i for i in re.findall(r'^\s*#\s*include\s+"([^"]+)"', self.tree.text(p), re.M) if i in ours}
                    | {str(beside) for i in re.findall(r'^\s*#\s*include\s+["<]([^">/]+)[">]', self.tree.text(p), re.M)
                       for beside in (p.rpartition("/")[0] + "/" + i, by_name.get(i)) if beside in ours} for p in self.paths}
        seen_with = collections.defaultdict(set)
        for unit in (p for p in self.paths if not p.endswith(".h")):
            unit_files, waiting = set(), [unit]
            while waiting:
                path = waiting.pop()
                if path not in unit_files:
                    unit_files.add(path)
                    waiting += included[path]
            for path in unit_files:
                seen_with[path] |= unit_files
        return seen_with

    def line_of(self, tag):
        return self.tree.code(tag["path"]).split("\n")[tag["line"] - 1]

    def owner_of(self, tag):
        last = tag.get("scope", "").split("::")[-1]
        return last if last in self.class_names else None

    def read(self):
        by_file = collections.defaultdict(list)
        for tag in self.tags:
            by_file[tag["path"]].append(tag)
        for path in self.paths:
            self.read_file(path, by_file[path])

    def read_file(self, path, tags):
        lines = self.tree.code(path).split("\n")
        owner_of_line = [None] * len(lines)  # the innermost node whose text this is
        own_names = collections.defaultdict(set)
        for tag in sorted(tags, key=lambda t: (t["line"], -self.last_line(t, lines))):
            own_names[tag["line"] - 1].add(tag["name"])
            if tag["kind"] in ("namespace", "externvar"):
                continue
            node = self.note(tag, lines)
            if node is None:
                continue
            for i in range(tag["line"] - 1, min(self.last_line(tag, lines), len(lines))):
                owner_of_line[i] = node
        for i, line in enumerate(lines):
            names = {n for n in IDENTIFIER.findall(line) if n not in own_names[i] or self.calls(line, n)}
            if re.match(r"\s*(class|struct|enum class)\s+\w+\s*;", line) or re.match(r"\s*friend\b", line):
                continue
            node = owner_of_line[i]
            if node is None or path.startswith(ALWAYS):
                self.root_names |= {(name, path) for name in names}
            else:
                node.names |= {(name, path) for name in names}

    @staticmethod
    def calls(line, name):
        """Named a second time on the line that declares it: `int depth() { return stack.depth(); }`."""
        return len(re.findall(r"[.>]\s*" + name + r"\b", line)) > 0

    @staticmethod
    def last_line(tag, lines):
        if tag["kind"] == "prototype":
            i = tag["line"] - 1
            while i < len(lines) - 1 and ";" not in lines[i]:
                i += 1
            return i + 1
        if tag["kind"] == "macro":
            i = tag["line"] - 1
            while lines[i].rstrip().endswith("\\"):
                i += 1
            return i + 1
        return tag.get("end", tag["line"])

    def note(self, tag, lines):
        """The node of this tag, whose text it is; None when its text is not its own (a member's is its class')."""
        owner, name, kind = self.owner_of(tag), tag["name"], tag["kind"]
        if name.startswith("__anon"):
            return None
        if kind in ("function", "prototype") and (name == owner or name.startswith("~")):
            return self.node(None, owner)
        if kind in CLASSES:
            owner = None  # nested or not: its members know it by its last name
        line = lines[tag["line"] - 1]
        node = self.node(owner, name)
        node.places.append((tag["path"], tag["line"]))
        if (owner is None and name in self.called_in_assembly) or name.startswith("operator") or name in PROTOCOL or tag["path"].startswith(ALWAYS):
            node.always = True
        if kind in ("function", "prototype") and re.search(r"\boverride\b", self.head_of(tag, lines)):
            node.overrides = True
            node.always |= name not in self.virtual  # somebody else's class calls it
        if kind in ("member", "enumerator"):
            return self.node(None, owner) if owner and not owner.startswith("__anon") else None
        if kind == "variable" and "constexpr" not in line:
            node.always = True  # its constructor may do something: enter a loop into a table, say
            return None
        return node

    def head_of(self, tag, lines):
        return " ".join(lines[tag["line"] - 1:tag["line"] + 3]).split("{")[0].split(";")[0]

    def node(self, owner, name):
        return self.nodes.setdefault((owner, name), Node(owner, name))

    # ---- who lives -------------------------------------------------------------------------------

    def dead(self):
        """(path, line, name) of each definition that no program reaches."""
        named = collections.defaultdict(set)  # name → the files that name it
        for name, path in self.root_names:
            named[name].add(path)
        living = set()
        waiting = dict(self.nodes)
        while True:
            born = [key for key, node in waiting.items() if self.lives(node, named, living)]
            if not born:
                break
            for key in born:
                for name, path in waiting.pop(key).names:
                    named[name].add(path)
                living.add(key)
        for node in waiting.values():
            if not node.places or (None, node.owner) in waiting:
                continue  # the class is blamed once
            path, line = min(node.places)
            yield path, line, f"{node.owner}::{node.name}" if node.owner else node.name

    def lives(self, node, named, living):
        owner = self.nodes.get((None, node.owner)) if node.owner else None
        if owner and owner.places and (None, node.owner) not in living:
            return False
        if node.always or (node.overrides and named[node.name]):
            return True
        return not node.places or any(named[node.name] & self.seen_with[path] for path, _ in node.places)

    # ---- declarations without a body -------------------------------------------------------------

    def bodiless(self):
        everywhere = self.tree.tags(self.tree.cpp(without=()))
        bodies = {(self.owner_of(t), t["name"], parameters(t)) for t in everywhere
                  if t["kind"] == "function" or re.search(r"\w::~?\w+\(.*=\s*default", self.line_of(t))}
        macros = " ".join(self.macro_text(t) for t in self.tags if t["kind"] == "macro")
        in_macros = set(IDENTIFIER.findall(macros))
        for tag in self.tags:
            if tag["kind"] != "prototype" or tag["path"].startswith("sketches/"):
                continue
            lines = self.tree.code(tag["path"]).split("\n")
            text = " ".join(lines[tag["line"] - 1:self.last_line(tag, lines)])
            in_assembly = tag["name"] + ":" in self.tree.text(tag["path"])
            if re.search(r"=\s*(0|default|delete)\s*;|\bfriend\b", text) or tag["name"] in in_macros | self.labels or in_assembly:
                continue
            owner = self.owner_of(tag)
            if (owner, tag["name"], parameters(tag)) not in bodies:
                whole = f"{owner}::{tag['name']}" if owner else tag["name"]
                yield tag["path"], tag["line"], whole

    def macro_text(self, tag):
        lines = self.tree.code(tag["path"]).split("\n")
        return " ".join(lines[tag["line"] - 1:self.last_line(tag, lines)])


def parameters(tag):
    """How many there are: their types are written in too many ways to compare."""
    depth, count, text = 0, 0, tag.get("signature", "()")
    inside = text[1:text.rfind(")")]
    for c in inside:
        depth += (c in "(<{[") - (c in ")>}]")
        count += c == "," and depth == 0
    return count + 1 if inside.strip() and inside.strip() != "void" else 0
