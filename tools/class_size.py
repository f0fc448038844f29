"""How large the classes of a C++ source are: their functions and their data members, counted in the text.

A compiler would have to see all that a file includes; the text alone is enough, because the formatter keeps it in one form.
Counted is what stands in the class itself: functions of every access, constructors and operators too, and data that each object has.
Not counted: what is deleted, static data, friends, and the types within it, which are counted for themselves.
"""
import re

TYPE_HEAD = re.compile(r"(?:template\b.*?)?\b(class|struct)\s+(?:alignas\s*)?([A-Za-z_]\w*(?:::\w+)*)(?:\s+final)?\s*(?::[^:].*)?", re.S)
NO_DATA = re.compile(r"(?:(?:inline|constexpr)\s+)*(?:using|typedef|friend|static_assert|static|enum|union|class|struct|namespace|extern)\b")


def without(text, opening, closing):
    """The text without what stands between brackets, however deep."""
    kept, depth = [], 0
    for c in text:
        depth += c == opening
        if depth == 0:
            kept.append(c)
        depth -= c == closing and depth > 0
    return "".join(kept)


def behind(code, at, opening, closing):
    """The place behind the bracket that closes the one at `at`."""
    depth = 0
    for place in range(at, len(code)):
        depth += (code[place] == opening) - (code[place] == closing)
        if depth == 0:
            return place + 1
    return len(code)


def bare(statement):
    """A statement of a class body without its access, attributes, and what stands between angles."""
    text = re.sub(r"\[\[.*?\]\]|\balignas\s*\([^)]*\)|\b(?:public|private|protected)\s*:(?!:)", " ", statement, flags=re.S).strip()
    if re.search(r"\boperator\b", text):
        return text
    return without(re.sub(r"^template\s*(?=<)", "", text).replace("->", "  "), "<", ">").strip()


def declared(statement):
    """(functions, members) that one statement of a class body declares."""
    text = bare(statement)
    if not text or re.search(r"=\s*delete$", text) or re.match(r"(?:using|typedef|friend|static_assert)\b", text):
        return 0, 0
    if re.search(r"\boperator\b", text) or "(" in re.split(r"=|\{", text, maxsplit=1)[0]:
        return 1, 0
    return 0, 0 if NO_DATA.match(text) else without(without(text, "(", ")"), "{", "}").count(",") + 1


def class_sizes(code, first_line=1, owner=None):
    """(line, "class" or "struct", name, functions, members) of each type in `code`, whose comments and strings are blanked.

    `owner`: (line, kind, name) when `code` is the body of that one.
    """
    code = re.sub(r"(?m)^[ \t]*#(?:.*\\\n)*.*$", lambda found: re.sub(r"[^\n]", " ", found[0]), code)
    functions = members = start = at = 0
    inner = []
    while at < len(code):
        c = code[at]
        if c == "(":
            at = behind(code, at, "(", ")")
        elif c == ";":
            more = declared(code[start:at])
            functions, members = functions + more[0], members + more[1]
            start = at = at + 1
        elif c == "{":
            head, line = bare(code[start:at]), first_line + code.count("\n", 0, at)
            body, at = at + 1, behind(code, at, "{", "}")
            found = TYPE_HEAD.fullmatch(head)
            if found and "(" not in head:
                inner += class_sizes(code[body:at - 1], line, (line, found[1], found[2]))
                named = re.match(r"\s*(\w*)[^;{}]*;", code[at:])  # struct { … } name;
                members += bool(named and named[1])
                start = at = at + (named.end() if named else 0)
            elif owner is None or re.match(r"(?:enum|union)\b", head):
                inner += class_sizes(code[body:at - 1], line)  # a function may hold a class
                start = at
            elif declared(code[start:body - 1])[0] and not re.match(r"\s*[,{]", code[at:]):
                functions += 1
                start = at
        else:
            at += 1
    return ([(*owner, functions, members)] if owner else []) + inner
