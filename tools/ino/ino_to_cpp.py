#!/usr/bin/env python3
"""Makes the .cpp of an Arduino sketch from its .ino tabs, as the Arduino IDE does.

    ino_to_cpp.py FOLDER|FILE.ino… [-o OUTPUT.cpp]

What the output has that the sketch has not:
  - `#include <Arduino.h>` before everything;
  - the tabs one after the other: the one that is named as its folder first, the others by name;
  - a prototype of every function, before the first function, so that a function may be used before it is written; behind the types of
    the sketch that it names, where these come later;
  - `#line` directives, so that an error of the compiler points into the .ino;
  - at the end, the registration of setup(), and of loop() and serialEvent() where there are.

Which functions get a prototype: those at top level with a return type, also static, inline and template ones. Not those with a
default argument (it would be given twice; that of a template is moved to the prototype) or with a prototype of their own for the same parameters, not operators, members, or what
stands in a namespace, class or extern "C" block. `void loop(id, budget, period [, core])` is QduinoMC's declaration of a VCPU and
gets none. A function within #if … #endif gets its prototype within the same condition; where two branches have two heads for one
body, each head has its own.
"""
import pathlib
import re
import sys
from collections import namedtuple

# Comments are blanked; the ends of strings are kept so that `extern "C"` can be told from `extern`.
TOKEN = re.compile(
    r'''(?P<comment>//(?:\\\n|[^\n])*|/\*.*?(?:\*/|\Z))
      | (?P<raw>(?:u8|[uUL])?R"(?P<tag>[^()\\\s]{0,16})\(.*?\)(?P=tag)")
      | (?P<string>"(?:\\.|[^"\\\n])*")
      | (?P<number>(?<![\w'])\.?\d(?:[eEpP][+-]|'[\w]|[\w.])*)
      | (?P<character>'(?:\\.|[^'\\\n])+')
    ''', re.S | re.X)
DIRECTIVE = re.compile(r'^[ \t]*#(?:\\\n|[^\n])*', re.M)
IDENTIFIER = r'[A-Za-z_]\w*'
NOT_A_FUNCTION = re.compile(r'\b(?:operator|namespace|using|typedef)\b')
# `struct Spot f(int x)`: a type of the sketch's, by its full name.
NAMED_TYPE = re.compile(rf'\b(?:class|struct|union|enum)\s+({IDENTIFIER})')
TYPE_HEAD = re.compile(r'\b(?:class|struct|union|enum)\b')
NOT_A_NAME = {'if', 'for', 'while', 'switch', 'catch', 'return', 'sizeof', 'decltype', 'alignas', '__attribute__',
              '__declspec', 'noexcept', 'defined', 'requires', 'static_assert', 'do', 'else'}
QUALIFIERS = {'const', 'volatile', 'struct', 'class', 'union', 'enum', 'register', 'static'}
WORDS_OF_TYPES = QUALIFIERS | {'void', 'bool', 'char', 'short', 'int', 'long', 'signed', 'unsigned', 'float', 'double', 'auto'}
PREFIX_WITH_PARENTHESES = {'decltype', 'alignas', '__attribute__', '__declspec', 'explicit', 'noexcept'}


# Not dataclasses here, and in the files that include this one: to import these takes as long as to
# read a small sketch.

# prototype: '' when it gets none; start: the offset in the joined text of the statement's first
# character; conditions: the open #if groups, each a list of its directives so far; parameters: a
# tuple of their types, without blanks.
Function = namedtuple('Function', 'name prototype start conditions parameters')
Tab = namedtuple('Tab', 'path text')


class Scan:
    def __init__(self):
        self.functions = []
        self.declared = set()  # (name, parameters) that have a prototype in the sketch
        self.types = {}        # names of types at top level: the offset behind the declaration
        self.defaults = []     # (start, end) of those of templates, which their prototypes have


def blank(match):
    return re.sub(r'[^\n]', ' ', match[0])


def without_comments(text):
    """The same length and lines; comments are spaces."""
    return TOKEN.sub(lambda m: blank(m) if m['comment'] is not None else m[0], text)


def without_literals(text):
    """Besides comments, what stands in strings and characters is spaces too; the quotes stay."""
    def keep_quotes(m):
        if m['comment'] is not None:
            return blank(m)
        if m['number'] is not None:
            return m[0].replace("'", '_')
        inner = re.sub(r'[^\n]', ' ', m[0][1:-1])
        return m[0][0] + inner + m[0][-1]
    return TOKEN.sub(keep_quotes, text)


def matching_parenthesis(text, close):
    """The offset of the '(' that the ')' at `close` ends, or -1."""
    depth = 0
    for i in range(close, -1, -1):
        if text[i] == ')':
            depth += 1
        elif text[i] == '(':
            depth -= 1
            if depth == 0:
                return i
    return -1


def parameter_list(head):
    """(open, close) of a function head's parameter list: the first parentheses after a name that may be a function's."""
    depth_angle = 0
    for i, c in enumerate(head):
        if c == '<':
            depth_angle += 1
        elif c == '>' and head[i - 1:i] != '-':
            depth_angle = max(0, depth_angle - 1)
        elif c == '(' and depth_angle == 0:
            name = re.search(rf'({IDENTIFIER})\s*$', head[:i])
            if not name or name[1] in NOT_A_NAME:
                continue
            before = head[:name.start()].rstrip()
            if not before:
                continue  # a macro's call; the head may go on after it
            depth = 0
            for j in range(i, len(head)):
                depth += {'(': 1, ')': -1}.get(head[j], 0)
                if depth == 0:
                    return i, j
    return None


def strip_leading_macro(head, source):
    """`MACRO(x) void f()` is `void f()` with a macro's call before it: cuts the call off both texts."""
    while True:
        call = re.match(rf'\s*({IDENTIFIER})\s*\(', head)
        if not call or call[1] in PREFIX_WITH_PARENTHESES:
            return head, source
        depth = 0
        for i in range(call.end() - 1, len(head)):
            depth += {'(': 1, ')': -1}.get(head[i], 0)
            if depth == 0:
                break
        if not head[i + 1:].strip():
            return head, source
        head, source = ' ' * (i + 1) + head[i + 1:], ' ' * (i + 1) + source[i + 1:]


def function_of(head, source):
    """(name, prototype or '', types of its parameters) of the function that this head, standing before '{' or ';', declares; else None.

    `head` has its literals blanked, `source` has them; both are without comments and directives.
    """
    head, source = strip_leading_macro(head, source)
    found = parameter_list(head)
    if not found:
        return None
    opening, closing = found
    name = re.search(rf'({IDENTIFIER})\s*$', head[:opening])
    before = head[:name.start()]
    after = head[closing + 1:]
    parameters = head[opening + 1:closing].strip()
    template = re.match(r'\s*template\s*<[^()]*>', before)
    returned = NAMED_TYPE.sub(r'\1', before[template.end():] if template else before)
    if NOT_A_FUNCTION.search(returned) or TYPE_HEAD.search(returned) or returned.rstrip().endswith(('::', '~', '.', '->')):
        return None
    if not declares_parameters(parameters) and NAMED_TYPE.search(before):
        return None  # struct Packed ALIGNED(4) { … };
    if '=' in returned or not re.fullmatch(
            r'\s*(?:(?:const|noexcept|override|final|volatile|try)\b\s*(?:\([^()]*\)\s*)?|&+\s*|\[\[.*?\]\]\s*|->\s*[^{;]+)*', after, re.S):
        return None
    types = parameter_types(parameters)
    if name[1] == 'loop' and parameters not in ('', 'void'):
        return name[1], '', types  # loop(id, budget, period, core)
    if '=' in parameters:
        return name[1], '', types
    return name[1], ' '.join(source.split()) + ';', types


def parameter_types(parameters):
    """The types of a parameter list, names and default values left out, to tell one overload from another."""
    types = []
    for parameter in cut_at_top(parameters, ','):
        words = re.findall(rf'{IDENTIFIER}|[^\s\w]|\d+', cut_at_top(parameter, '=')[0])
        named = len(words) - next((i for i, word in enumerate(reversed(words)) if word not in '[]0123456789'), 0) - 1
        if named > 0 and re.fullmatch(IDENTIFIER, words[named]) and words[named] not in WORDS_OF_TYPES and any(
                word not in QUALIFIERS for word in words[:named] if re.fullmatch(IDENTIFIER, word)):
            del words[named]
        # const of a value is the function's own affair.
        types.append(' '.join(word for word in words if word != 'const' or {'*', '&'} & set(words)))
    return () if types in ([''], ['void']) else tuple(types)


def template_defaults(head):
    """(start, end) of each `= T` in the parameters of a template."""
    template = re.match(r'\s*template\s*<', head)
    depth, begin = 1, None
    for i in range(template.end() if template else len(head), len(head)):
        c = head[i]
        if c in ',>' and depth == 1 and begin is not None:
            yield begin, i
            begin = None
        elif c == '=' and depth == 1:
            begin = i
        depth += {'(': 1, '<': 1, '[': 1, '{': 1, ')': -1, '>': -1, ']': -1, '}': -1}.get(c, 0)
        if depth == 0:
            return


def declares_parameters(parameters):
    """The text between parentheses may be a parameter list: it is empty, or begins with a word."""
    return re.match(rf'\s*(?:$|{IDENTIFIER}|\[\[)', parameters)


def cut_at_top(text, separator):
    """The parts of `text` between separators that stand in no parentheses, brackets, braces or angle brackets."""
    parts, depth = [''], 0
    for c in text:
        depth += {'(': 1, '[': 1, '{': 1, '<': 1, ')': -1, ']': -1, '}': -1, '>': -1}.get(c, 0)
        if c == separator and depth == 0:
            parts.append('')
        else:
            parts[-1] += c
    return parts


class Head:
    """What stands of a statement so far, on one way through the #if groups in it."""

    def __init__(self, offsets=(), start=None, conditions=None):
        self.offsets = list(offsets)  # of its characters, directives left out
        self.start = start
        self.conditions = conditions  # None: those that are open where it ends

    def copy(self):
        return Head(self.offsets, self.start, self.conditions)


class Group:
    """An #if that is open: the state before it, and the states behind its branches."""

    def __init__(self, heads, depth):
        self.heads = heads
        self.depth = depth
        self.branches = []  # (heads, depth, directives so far)
        self.has_else = False


class Scanner:
    """Walks the joined tabs and finds the functions at top level. Each branch of an #if is read as if it were the one that is taken."""

    HEADS_MAX = 8  # ways through one head; of more, the first ones count

    def __init__(self, text):
        self.source = without_comments(text)
        self.code = without_literals(text)
        self.conditions = []
        self.groups = []
        self.heads = [Head()]
        self.depth = 0
        self.types_open = []    # names of the types whose body has begun
        self.types_waiting = []  # of those that are declared within an open #if
        self.found = Scan()

    def scan(self):
        directives = {m.start(): m.end() for m in DIRECTIVE.finditer(self.code)}
        i = 0
        while i < len(self.code):
            if i in directives:
                self.directive(self.source[i:directives[i]], directives[i])
                i = directives[i]
                continue
            self.character(i, self.code[i])
            i += 1
        self.end_types(len(self.code))
        return self.found

    def character(self, i, c):
        if self.depth == 0:
            if c in ';{}':
                for head in self.heads:
                    if head.offsets:
                        self.statement(head, c)
                if c == ';':
                    self.end_of_types(i + 1)
                self.heads = [Head()]
            else:
                for head in self.heads:
                    if head.start is not None or not c.isspace():
                        head.start = i if head.start is None else head.start
                        head.offsets.append(i)
        self.depth = max(0, self.depth + {'{': 1, '}': -1}.get(c, 0))

    def directive(self, text, end):
        word = re.match(r'\s*#\s*(\w*)', text)[1]
        text = ' '.join(text.replace('\\\n', ' ').split())
        if word in ('if', 'ifdef', 'ifndef'):
            self.conditions.append([text])
            self.groups.append(Group([head.copy() for head in self.heads], self.depth))
        elif word in ('elif', 'else') and self.groups:
            self.end_branch()
            self.conditions[-1].append(text)
            group = self.groups[-1]
            group.has_else |= word == 'else'
            self.heads, self.depth = [head.copy() for head in group.heads], group.depth
        elif word == 'endif' and self.groups:
            self.end_branch()
            self.end_group(self.groups.pop())
            self.conditions.pop()
            if not self.conditions:
                self.end_types(end)

    def end_branch(self):
        self.groups[-1].branches.append((self.heads, self.depth, [list(group) for group in self.conditions]))

    def end_group(self, group):
        """The braces are those of the first branch that is not `#if 0`; of the heads each branch has its own."""
        if not group.has_else:
            without = [list(each) for each in self.conditions]
            without[-1].append('#else')
            group.branches.append((group.heads, group.depth, without))
        never = re.fullmatch(r'#\s*if\s+(?:0|false)', self.conditions[-1][0])
        branches = group.branches[1:] if never else group.branches
        self.depth = branches[0][1]
        branches = [branch for branch in branches if branch[1] == self.depth]
        different = any([head.offsets for head in branch[0]] != [head.offsets for head in branches[0][0]] for branch in branches)
        self.heads = []
        for heads, _, conditions in branches if different else branches[:1]:
            for head in heads:
                if different and head.conditions is None:
                    head.conditions = conditions
                self.heads.append(head)
        del self.heads[self.HEADS_MAX:]

    def statement(self, head, end):
        code = ''.join(self.code[i] for i in head.offsets)
        function = function_of(code, ''.join(self.source[i] for i in head.offsets))
        if not function:
            self.note_type(code, end)
            return
        name, prototype, parameters = function
        if end == ';':
            self.found.declared.add((name, parameters))
        elif end == '{':
            conditions = self.conditions if head.conditions is None else head.conditions
            if prototype:
                self.found.defaults += [(head.offsets[a], head.offsets[b - 1] + 1) for a, b in template_defaults(code)]
            self.found.functions.append(Function(name, prototype, head.start, [list(group) for group in conditions], parameters))

    def note_type(self, code, end):
        """`code` may begin a type, or be all of its declaration."""
        words = re.findall(IDENTIFIER, code.split(':')[0])
        if TYPE_HEAD.search(code) and '=' not in code and (end == '{' or len(words) == 2):
            self.types_open += [word for word in words[-2:] if word != 'final']
        elif re.match(r'\s*(?:template\b.*)?using\b', code) and '=' in code:
            self.types_open.append(re.findall(IDENTIFIER, code.split('=')[0])[-1])
        elif re.match(r'\s*typedef\b', code) or self.types_open:
            self.types_open += words[-1:]  # typedef int Steps; also what stands behind the brace of a struct

    def end_of_types(self, offset):
        for name in self.types_open:
            if name not in self.found.types:
                self.found.types[name] = (offset, offset)
                if self.conditions:
                    self.types_waiting.append(name)
        self.types_open = []

    def end_types(self, offset):
        """The outermost #if has ended: another branch of it may have the same types."""
        for name in self.types_waiting:
            self.found.types[name] = (self.found.types[name][0], offset)
        self.types_waiting = []


def line_directive(line, path):
    escaped = str(path).replace('\\', '\\\\').replace('"', '\\"')
    return f'#line {line} "{escaped}"\n'


def insertion_point(text, functions):
    """Where the prototypes go: at the first function, or at the outermost #if that it stands in."""
    first = min(f.start for f in functions)
    level = 0
    outermost = first
    code = without_literals(text)
    for m in DIRECTIVE.finditer(code):
        if m.start() > first:
            break
        word = re.match(r'\s*#\s*(\w*)', m[0])[1]
        if word in ('if', 'ifdef', 'ifndef'):
            outermost = m.start() if level == 0 else outermost
            level += 1
        elif word == 'endif':
            level = max(0, level - 1)
    return outermost if level > 0 else first


class Joined:
    """The tabs as one text, and where each of its offsets stands in which tab."""

    def __init__(self, tabs):
        self.tabs = tabs
        self.text = ''
        self.starts = []
        for tab in tabs:
            self.starts.append(len(self.text))
            self.text += tab.text if tab.text.endswith('\n') else tab.text + '\n'

    def place(self, offset):
        index = max(i for i, s in enumerate(self.starts) if s <= offset)
        line = self.text.count('\n', self.starts[index], offset) + 1
        return line, self.tabs[index].path

    def part(self, begin, end):
        """The text from begin to end, with a #line where it begins and at each tab."""
        out = ''
        bounds = [begin] + [s for s in self.starts if begin < s < end] + [end]
        for a, b in zip(bounds, bounds[1:]):
            if a < b:
                out += line_directive(*self.place(a)) + self.text[a:b]
                if not out.endswith('\n'):
                    out += '\n'
        return out


def place_of_prototype(function, types, first):
    """Behind the types that it names, and not before `first`."""
    place = first
    for name in re.findall(IDENTIFIER, function.prototype):
        behind, behind_condition = types.get(name, (0, 0))
        place = max(place, behind_condition if behind_condition <= function.start else behind)
    return place


def prototypes(joined, found, first):
    """{offset: the prototypes that go there}."""
    places = {first: ''}
    written = set()
    for f in found.functions:
        if not f.prototype or (f.name, f.parameters) in found.declared or f.prototype in written:
            continue
        if not f.conditions:
            written.add(f.prototype)
        out = ''.join(d + '\n' for group in f.conditions for d in group)
        out += line_directive(*joined.place(f.start)) + f.prototype + '\n'
        out += '#endif\n' * len(f.conditions)
        place = place_of_prototype(f, found.types, first)
        places[place] = places.get(place, '') + out
    return places


def registration(found, path):
    """Only the main file of a program is a sketch with a setup(); the linker says so when it is missing."""
    names = {f.name for f in found.functions if f.prototype or f.name != 'loop'}
    classic = any(f.name == 'loop' and f.prototype for f in found.functions)
    entries = ['&setup', '&loop' if classic else 'nullptr', '&serialEvent' if 'serialEvent' in names else 'nullptr']
    escaped = str(path).replace('\\', '\\\\').replace('"', '\\"')
    return ('#undef loop\n[[maybe_unused]] static const ::qduino::arduino::SketchRegistration '
            f'qduino_sketch_registration{{{", ".join(entries)}, "{escaped}"}};\n')


def weak_declarations(found):
    """Declares those that the board calls and that stand within conditions: without them their address is null."""
    def always(name):
        return any(f.name == name and f.prototype and not f.conditions for f in found.functions)
    names = {f.name for f in found.functions if f.prototype and f.name in ('loop', 'serialEvent')}
    return ''.join(f'void ({name})() __attribute__((weak));\n' for name in sorted(names) if not always(name))


def convert(tabs):
    joined = Joined(tabs)
    found = Scanner(joined.text).scan()
    for start, end in found.defaults:
        joined.text = joined.text[:start] + re.sub(r'[^\n]', ' ', joined.text[start:end]) + joined.text[end:]
    out = '#include <Arduino.h>\n' + weak_declarations(found)
    at = 0
    if found.functions:
        for place, text in sorted(prototypes(joined, found, insertion_point(joined.text, found.functions)).items()):
            out += joined.part(at, place) + text
            at = place
    out += joined.part(at, len(joined.text))
    return out + registration(found, tabs[0].path)


def tabs_of(paths):
    """The .ino files, in the order in which they are joined."""
    files = []
    for path in map(pathlib.Path, paths):
        if path.is_dir():
            inside = sorted(p for p in path.iterdir() if p.suffix in ('.ino', '.pde'))
            main = [p for p in inside if p.stem == path.resolve().name]
            if not inside:
                sys.exit(f'{path}: no .ino file in this folder')
            files += main + [p for p in inside if p not in main]
        else:
            files.append(path)
    try:
        return [Tab(p.resolve(), p.read_text(encoding='utf-8', errors='surrogateescape').removeprefix('\ufeff').replace('\r\n', '\n')) for p in files]
    except OSError as error:
        sys.exit(f'{error.filename}: {error.strerror}')


def main():
    import argparse  # here alone: as_arduino.py imports this file for each source
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('sketch', nargs='+', help='the sketch folder, or its .ino files in order')
    parser.add_argument('-o', '--output', help='the .cpp to write (default: standard output)')
    arguments = parser.parse_args()
    text = convert(tabs_of(arguments.sketch))
    if not arguments.output:
        sys.stdout.write(text)
        return
    output = pathlib.Path(arguments.output)
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_text(text, encoding='utf-8', errors='surrogateescape')


if __name__ == '__main__':
    main()
