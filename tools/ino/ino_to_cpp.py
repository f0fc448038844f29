#!/usr/bin/env python3
"""Makes the .cpp of an Arduino sketch from its .ino tabs, as the Arduino IDE does.

    ino_to_cpp.py FOLDER|FILE.ino… [-o OUTPUT.cpp]

What the output has that the sketch has not:
  - `#include <Arduino.h>` before everything;
  - the tabs one after the other: the one that is named as its folder first, the others by name;
  - a prototype of every function, before the first function, so that a function may be used before it is written;
  - `#line` directives, so that an error of the compiler points into the .ino;
  - at the end, the registration of setup(), and of loop() and serialEvent() where there are;
  - another name for what the sketch calls like something of the C library: `uint8_t clock[8];` is clock_of_sketch.
    An AVR's C library has no clock(), pipe() or pause(); here the two would not compile together.

Which functions get a prototype: those at top level with a return type, also static, inline and template ones. Not those with a
default argument (it would be given twice) or with a prototype of their own, not operators, members, or what stands in a
namespace, class or extern "C" block. `void loop(id, budget, period [, core])` is QduinoMC's declaration of a VCPU and
gets none. A function within #if … #endif gets its prototype within the same condition.
"""
import argparse
import pathlib
import re
import sys
from dataclasses import dataclass, field

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
NOT_A_FUNCTION = re.compile(r'\b(?:operator|class|struct|union|enum|namespace|using|typedef)\b(?![^()]*\()')
NOT_A_NAME = {'if', 'for', 'while', 'switch', 'catch', 'return', 'sizeof', 'decltype', 'alignas', '__attribute__',
              '__declspec', 'noexcept', 'defined', 'requires', 'static_assert', 'do', 'else'}
PREFIX_WITH_PARENTHESES = {'decltype', 'alignas', '__attribute__', '__declspec', 'explicit', 'noexcept'}

# Words of the C library here that Arduino.h brings in, and that a person may choose for a global
# variable.
LIBC_WORDS = frozenset("""
    abort abs access acct alarm alloca asctime atexit basename bcmp bcopy brk bsearch bzero calloc ceil chdir chown chroot clock clone
    close confstr cos crypt ctime daemon daylight difftime div drem dup dup2 encrypt environ erf execl execv exit exp exp2 fabs fclose
    feof ferror fflush ffs fgetc fgets fileno floor fma fmax fmin fmod fopen fork fputs fread free fseek fsync ftell fwrite gamma getc
    getchar getenv getline getopt getpid getuid gets getw gmtime hypot index ioctl isatty j0 j1 jn kill labs lchown ldexp ldiv lfind
    lgamma link localtime log log10 log2 logb lround lseek malloc memcpy memmem memset mktime nan nanosleep nice optarg opterr optind
    optopt pause pclose perror pipe pipe2 popen pow pread printf puts putw qsort rand random read readlink realloc remainder remove
    remquo rename revoke rewind rindex rint rmdir round sbrk scalb scanf seed48 select setenv setsid setuid signgam significand sin
    sincos sinh sleep sqrt srand stderr stdin stdout stime strdup strlen swab symlink sync syscall sysconf system tan tanh tempnam time
    timegm times timezone trunc truncate ttyname tzname tzset umask ungetc unlink usleep vfork wait write y0 y1 yn""".split())
# Functions of the C library without arguments, and with one int: a function of the sketch that
# takes the same is in their way.
LIBC_WITHOUT_ARGUMENTS = frozenset("abort clock fork getchar getpid getuid pause rand setsid sync tzset vfork".split())
LIBC_WITH_AN_INT = frozenset("abs close daemon dup exit fsync isatty nice putw raise system".split())


@dataclass
class Function:
    name: str
    prototype: str        # '' when it gets none
    start: int            # offset in the joined text of the statement's first character
    conditions: list      # the open #if groups, each a list of its directives so far


@dataclass
class Tab:
    path: pathlib.Path
    text: str


@dataclass
class Scan:
    functions: list = field(default_factory=list)
    declared: set = field(default_factory=set)  # names that have a prototype in the sketch
    clashes: set = field(default_factory=set)   # names of the C library that the sketch gives to something of its own


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
    """(name, prototype or '') of the function that this head, standing before '{' or ';', declares; else None.

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
    if NOT_A_FUNCTION.search(re.sub(r'template\s*<[^()]*>', '', before)) or before.rstrip().endswith(('::', '~', '.', '->')):
        return None
    if '=' in re.sub(r'template\s*<[^()]*>', '', before) or not re.fullmatch(
            r'\s*(?:(?:const|noexcept|override|final|volatile|try)\b\s*(?:\([^()]*\)\s*)?|&+\s*|\[\[.*?\]\]\s*|->\s*[^{;]+)*', after, re.S):
        return None
    if name[1] == 'loop' and parameters not in ('', 'void'):
        return name[1], ''  # loop(id, budget, period, core)
    if '=' in parameters:
        return name[1], ''
    return name[1], ' '.join(source.split()) + ';'


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


def clashes_in(head):
    """The names of the C library that this statement at top level, which stands before ';' or '{', gives to the sketch's own."""
    function = function_of(head, head)
    if function:
        name = function[0]
        opening, closing = parameter_list(head)
        arguments = head[opening + 1:closing].strip()
        an_int = re.fullmatch(rf'(?:const\s+)?int(?:\s+{IDENTIFIER})?', arguments)
        object_made = re.match(r'[\d"&-]', arguments)  # Button index(3);
        found = (name in LIBC_WITHOUT_ARGUMENTS and arguments in ('', 'void') or name in LIBC_WITH_AN_INT and an_int
                 or name in LIBC_WORDS and object_made)
        return {name} if found else set()
    kind = r'(?:class|struct|union|enum)'
    if re.match(r'\s*(?:typedef|using|extern|namespace|template)\b', head) or re.match(rf'\s*{kind}\s+{IDENTIFIER}\s*(?:$|:)', head):
        return set()
    names = set()
    for i, declarator in enumerate(cut_at_top(head, ',')):
        declarator = re.sub(r'(?:\s*\[[^\]]*\])+\s*$', '', cut_at_top(declarator, '=')[0].rstrip()).rstrip()
        name = re.search(rf'({IDENTIFIER})\s*$', declarator)
        if name and name[1] in LIBC_WORDS and (i > 0 or declarator[:name.start()].strip()):
            names.add(name[1])
    return names


def renamed(text, names):
    """`text` with another name for these words: in code alone, not behind `.`, `->` or `::`, not as a member of a class, and not in
    #include lines."""
    if not names:
        return text
    code = without_literals(text)
    word = re.compile(r'(?<![\w.])(?:' + '|'.join(map(re.escape, sorted(names))) + r')\b')
    out, last = '', 0
    for m in word.finditer(code):
        before = code[:m.start()].rstrip()
        line = code[code.rfind('\n', 0, m.start()) + 1:m.start()]
        if before.endswith(('.', '->', '::')) or re.match(r'\s*#\s*include', line) or is_member(code, m.start(), m[0]):
            continue
        out += text[last:m.end()] + '_of_sketch'
        last = m.end()
    return out + text[last:]


def direct_text(code, opening):
    """What stands in the brace at `opening`, without what stands in braces within it."""
    depth, out = 0, ''
    for c in code[opening:]:
        depth += {'{': 1, '}': -1}.get(c, 0)
        if depth == 0:
            return out
        out += c if depth == 1 else ' '
    return out


def is_member(code, at, word):
    """True when this place is in a class, struct, union or enum that has a member of this name: its functions mean that one."""
    depth = 0
    innermost = True
    for i in range(at - 1, -1, -1):
        depth += {'}': 1, '{': -1}.get(code[i], 0)
        if depth >= 0:
            continue
        depth = 0
        head = re.split(r'[;{}]', code[:i])[-1]
        if re.search(r'\b(?:class|struct|union|enum)\b[^()=]*$', head):
            if innermost or re.search(rf'\b{re.escape(word)}\b', direct_text(code, i)):
                return True
        innermost = False
    return False


class Scanner:
    """Walks the joined tabs and finds the functions at top level."""

    def __init__(self, text):
        self.source = without_comments(text)
        self.code = without_literals(text)
        self.conditions = []
        self.found = Scan()

    def scan(self):
        self.directives = {m.start(): m for m in DIRECTIVE.finditer(self.code)}
        depth = 0
        start = None
        head = []  # offsets of the statement's characters, directives left out
        i = 0
        while i < len(self.code):
            if i in self.directives:
                self.directive(self.source[i:self.directives[i].end()])
                i = self.directives[i].end()
                continue
            c = self.code[i]
            if depth == 0:
                if c in ';{}':
                    if head:
                        self.statement(head, start, c)
                    head, start = [], None
                elif start is not None or not c.isspace():
                    start = i if start is None else start
                    head.append(i)
            depth = max(0, depth + {'{': 1, '}': -1}.get(c, 0))
            i += 1
        return self.found

    def directive(self, text):
        word = re.match(r'\s*#\s*(\w*)', text)[1]
        text = ' '.join(text.replace('\\\n', ' ').split())
        if word in ('if', 'ifdef', 'ifndef'):
            self.conditions.append([text])
        elif word in ('elif', 'else') and self.conditions:
            self.conditions[-1].append(text)
        elif word == 'endif' and self.conditions:
            self.conditions.pop()

    def statement(self, offsets, start, end):
        self.found.clashes |= clashes_in(''.join(self.code[i] for i in offsets))
        function = function_of(''.join(self.code[i] for i in offsets), ''.join(self.source[i] for i in offsets))
        if not function:
            return
        name, prototype = function
        if end == ';':
            self.found.declared.add(name)
        elif end == '{':
            self.found.functions.append(Function(name, prototype, start, [list(group) for group in self.conditions]))


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


def prototypes(joined, found):
    out = ''
    written = set()
    for f in found.functions:
        if not f.prototype or f.name in found.declared or f.prototype in written:
            continue
        if not f.conditions:
            written.add(f.prototype)
        for group in f.conditions:
            out += ''.join(d + '\n' for d in group)
        out += line_directive(*joined.place(f.start)) + f.prototype + '\n'
        out += '#endif\n' * len(f.conditions)
    return out


def registration(found, path):
    """Only the main file of a program is a sketch with a setup(); the linker says so when it is missing."""
    names = {f.name for f in found.functions if f.prototype or f.name != 'loop'}
    classic = any(f.name == 'loop' and f.prototype for f in found.functions)
    entries = ['&setup', '&loop' if classic else 'nullptr', '&serialEvent' if 'serialEvent' in names else 'nullptr']
    escaped = str(path).replace('\\', '\\\\').replace('"', '\\"')
    return ('#undef loop\n[[maybe_unused]] static const ::qduino::arduino::SketchRegistration '
            f'qduino_sketch_registration{{{", ".join(entries)}, "{escaped}"}};\n')


def convert(tabs):
    clashes = Scanner(Joined(tabs).text).scan().clashes
    joined = Joined([Tab(tab.path, renamed(tab.text, clashes)) for tab in tabs])
    found = Scanner(joined.text).scan()
    out = '#include <Arduino.h>\n'
    if found.functions:
        at = insertion_point(joined.text, found.functions)
        out += joined.part(0, at) + prototypes(joined, found) + joined.part(at, len(joined.text))
    else:
        out += joined.part(0, len(joined.text))
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
        return [Tab(p.resolve(), p.read_text(encoding='utf-8', errors='surrogateescape').replace('\r\n', '\n')) for p in files]
    except OSError as error:
        sys.exit(f'{error.filename}: {error.strerror}')


def main():
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
