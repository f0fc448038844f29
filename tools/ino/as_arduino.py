#!/usr/bin/env python3
"""Compiles a C or C++ file of a sketch or library as an Arduino's compiler would understand it.

    as_arduino.py [--keep FOLDER]… [--long 64] [--prepared FOLDER] [--main refused] -- COMPILER ARGUMENT… -c SOURCE -o OBJECT

On a 64-bit Linux `long` has 64 bits. A library that computes with the 32 of an AVR compiles, and is wrong without a word: `(long)x` of a
24-bit converter does not become negative, and `millis() - then` does not wrap. So the preprocessor runs first, and then each `long` in the
text that came from the sketch and its libraries becomes an `int`. What came from the system's headers and from those below a --keep folder
stays as it is: it describes code that is compiled already. A command without -c is run as it is.

    source ── -E ──► text, with the file that each line is from ── here ──► text ── -c ──► object

What changes for `long`, in its own columns so that the compiler's messages point where they should:
  - `unsigned long`, `long int`, `signed long` … → `unsigned int`, `int`; `long long` and `long double` stay;
  - `1000UL`, `5L` → `1000U`, `5`; a number that needs more than 32 bits is a `long long`, as on an AVR;
  - `%ld`, `%lu` … in the texts of a call of printf, scanf and their family → `%d`, `%u`, so that the compiler's own check of formats is
    right. What a format means when the program runs is arduino/core/formats.h's affair, which is read before everything else;
  - `int64_t` and its like, which the system makes of its own `long` → `int64_q`, a `long long`, as on an AVR;
  - `strtol()`, `atol()`, `labs()` and their like, whose result is a `long` of the system → `strt0l()` …, with a result of 32 bits;
  - `ulong` and `u_long`, which the system has with 64 bits → `ul0ng`, `u_l0ng`, with 32. A library that declares such a name again
    (Keypad does) would contradict the system otherwise.

Where a class has both f(int) and f(long), two functions would become one. The compiler says so; that declaration then takes a type of its
own in the place of `long` (OTHER_LONG), and no call chooses it over the other.

A library may list the types of whole numbers, `is_same<T, int>::value || is_same<T, long>::value || …`, or have a template for each. There
`long` stays the system's, next to an `int` that is a sketch's `long` already: so size_t is in the list, as on an AVR.

What is as wide as a pointer (sizeof, strlen()) is an `unsigned int` on an AVR, and a `long` of the system here. A call that cannot choose
between f(int) and f(unsigned int) for it, or between two meanings of a template's T, is named by the compiler; there it gets the AVR's type.

A name of the sketch's that the board or the C library has, too, gets another (own_names.py).

A loop that only waits, `while (!flag);`, gets an empty assembler statement, which makes no instruction. Without it the compiler may leave
such a loop out, or make one of two; and the line of `while (true);` would be lost, which the simulator names when a sketch spins there.

A --prepared folder has an Arduino.h that the compiler has read before (Arduino.h.gch, of g++). Then a pragma stands in the text for all
that the header says, and the compiler loads what it knew behind it. g++ takes it only as the first header that a source's own file names
(libcpp/files.cc, pch_open_file). A library's source begins with a header of its own, which leads to Arduino.h. So it is read with Arduino.h
before all (-include). That changes nothing if the source comes to Arduino.h itself, and has said nothing by then: no declaration, no macro
that Arduino.h knows. A source of another kind is read again, as it stands. -M, by which libraries are found, is done in the same way.
"""
import os
import pathlib
import re
import subprocess
import sys
from collections import namedtuple

from ino_to_cpp import TOKEN, cut_at_top, matching_parenthesis
from own_names import places_of_own_names

LINE_MARKER = re.compile(r'#\s+(\d+)\s+"((?:[^"\\]|\\.)*)"((?:\s+\d)*)\s*$')
SYSTEM = ('/usr/include/', '/usr/lib/', '/usr/local/include/', '<')
WORD = re.compile(r'[A-Za-z_]\w*|\S')
# The words that may stand together before a declared name, in any order (C++20, [dcl.spec]).
SPECIFIERS = {'unsigned', 'signed', 'long', 'int', 'short', 'double', 'char', 'const', 'volatile', 'static', 'extern', 'register',
              'constexpr', 'mutable', 'inline', 'typedef', 'virtual', '__extension__', '_Complex', '__volatile__', 'thread_local'}
WHOLE_NUMBER = re.compile(r"(?P<digits>0[xX][\da-fA-F']+|0[bB][01']+|\d[\d']*)(?P<suffix>[uU]?[lL]|[lL][uU]|[uU])?$")
# <limits.h> makes LONG_MAX and the like of it.
LONG_MAX_64, LONG_MAX_32 = '0x7fffffffffffffff', '0x7fffffff'
FORMATTED = re.compile(r'printf|scanf')
LONG_FORMAT = re.compile(r'(%[-+ #0\']*(?:\*|\d+)?(?:\.(?:\*|\d*))?)l(?=[diouxXn])')
PREPARED = '#pragma GCC pch_preprocess '
DEFINITION = re.compile(r'#(define|undef)\s+(\w+)')
# Arduino.h has each of them where nobody else has, and uses none of them itself: a library's own
# reader stays, whichever comes first.
READERS_OF_FLASH = re.compile(r'pgm_read_\w+')
# Names of the system for a `long` of its own: what they become, of the same length, and what that
# is.
SYSTEM_LONG = {'ulong': ('ul0ng', 'unsigned int'), 'u_long': ('u_l0ng', 'unsigned int')}
for name in ('int64_t', 'int_least64_t', 'int_fast64_t'):
    SYSTEM_LONG[name] = (name[:-1] + 'q', 'long long')
    SYSTEM_LONG['u' + name] = ('u' + name[:-1] + 'q', 'unsigned long long')
for name in ('int_fast16_t', 'int_fast32_t'):
    SYSTEM_LONG[name] = (name[:-1] + 'q', 'int')
    SYSTEM_LONG['u' + name] = ('u' + name[:-1] + 'q', 'unsigned int')
SYSTEM_LONG_NAME = re.compile(r'\b(?:' + '|'.join(SYSTEM_LONG) + r')\b')
# Functions whose result is a `long`: what they become, of the same length, and how that is
# declared. The ABIs of x86-64 and AArch64 give the low 32 bits of a result in the same register.
SYSTEM_LONG_FUNCTIONS = {
    'strtol': ('strt0l', 'int strt0l(const char*, char**, int) __asm__("qduino_strtol");'),
    'strtoul': ('strt0ul', 'unsigned int strt0ul(const char*, char**, int) __asm__("qduino_strtoul");'),
    'atol': ('at0l', 'int at0l(const char*) __asm__("atol");'),
    'labs': ('l4bs', 'int l4bs(int) __asm__("abs");'),
    'lround': ('lr0und', 'int lr0und(double) __asm__("lround");'),
    'lrint': ('lr1nt', 'int lr1nt(double) __asm__("lrint");'),
}
SYSTEM_LONG_FUNCTION = re.compile(r'\b(?:' + '|'.join(SYSTEM_LONG_FUNCTIONS) + r')\b')
# Found as a system's header, by -isystem: what it says is not the sketch's.
FORMATS_HEADER = 'arduino/core/formats.h'
FORMATS = re.compile(r'\bv?(?:s|sn|f)?printf\b|\bv?[sf]?scanf\b')
TWICE = re.compile(r'cannot be overloaded with|redefinition of')
SYSTEM_LONGS = 'typedef long qduino_system_long;\ntypedef unsigned long qduino_system_unsigned_long;\n'
# An argument of a template that is an `int`, by its sign.
STATEMENT_END = re.compile(r'[;{}]')
LISTED_INT = {sign: re.compile(rf'[<,]\s*(?:const\s+|volatile\s+)*(?:{words})\s*[>,]') for sign, words in (
    (False, r'signed|(?:signed\s+)?int'), (True, r'unsigned(?:\s+int)?'))}
# A call whose arguments have a `long` of the system's.
UNDECIDED = re.compile(r"(?:call of overloaded|no matching function for call to) .*?\((?P<types>[^()]*)\)\W*(?:is ambiguous)?$")
LONG_OF_SYSTEM = re.compile(r'(?:const )?(?:long (?:unsigned )?int|(?:\w+::)*(?:s?size_t|ptrdiff_t|u?intptr_t|size_type))&*')
NARROWER = '''constexpr unsigned int qduino_narrow(unsigned long value) { return static_cast<unsigned int>(value); }
constexpr int qduino_narrow(long value) { return static_cast<int>(value); }
'''
# All the compiler says of a format for a `long` that is given an `int`. Where the format stands in
# the call, it is changed; where it has a name, the board's printf() reads what the sketch means.
FORMAT_OF_A_LONG = re.compile(rb'warning: [^\n]*%[^ ]*l[dioux][^\n]*\blong (?:unsigned )?int\b[^\n]*[^\w ](?:unsigned )?int ?\*?[^\w ][^\n]*-Wformat=')
# "a.ino: In function 'void f()':", "In file included from a.h:1,"
BEFORE_A_WARNING = re.compile(rb'\S.*:(?:\d+[,:])?\s*$|In file included| +from ')
COLOUR = re.compile(rb'\033\[[^@-~]*[@-~]')
ROUNDS = 8  # of asking the compiler which declarations have become the same
OTHER_LONG = '''template <typename T>
struct qduino_other_long {
    T value;
    constexpr qduino_other_long(T v = T()) : value(v) {}
    constexpr operator T() const { return value; }
};
'''


class Run:
    """Neighbouring specifiers with one `long` among them: where each word is."""

    def __init__(self):
        self.words = []

    def names(self):
        return [word for _, word in self.words]

    def start(self):
        return self.words[0][0]

    def end(self):
        return self.words[-1][0] + len(self.words[-1][1])

    def is_unsigned(self):
        return 'unsigned' in self.names()


# ours: of the sketch or a library of it; start: the offset of the line's first character.
Place = namedtuple('Place', 'file line ours start')


def split_lines(text, kept, own):
    """The Place of each line of preprocessed text. A line that is a directive is nobody's."""
    places, offset = [], 0
    file, line, ours = '', 0, False
    for content in text.split('\n'):
        directive = content.startswith('#')
        marker = LINE_MARKER.match(content) if directive else None
        if marker:
            line, file = int(marker[1]) - 1, marker[2]
            ours = is_ours(file, '3' in marker[3].split(), kept, own)
        places.append(Place(file, line, ours and not directive, offset))
        offset += len(content) + 1
        line += 1
    return places


def blank(match):
    return re.sub(r'[^\n]', ' ', match[0])


def depth_in(folders, file):
    """The length of the innermost of `folders` that `file` lies in; 0: it lies in none."""
    return max((len(folder) for folder in folders if file.startswith(folder)), default=0)


def is_ours(file, system, kept, own):
    """Where one folder lies in another, a sketch's libraries below a kept one, the inner one counts."""
    if not system:
        return not file.startswith('<')
    return not file.startswith(SYSTEM) and depth_in(kept, file) <= depth_in(own, file)


def end_of_parentheses(tokens, at):
    """The index of the ')' that ends the '(' at this index; the last one when there is none."""
    depth = 0
    for i in range(at, len(tokens)):
        depth += {'(': 1, ')': -1}.get(tokens[i][1], 0)
        if depth == 0:
            return i
    return len(tokens) - 1


def heads_of_loops(tokens):
    """The indexes of each `while` and `for` that begins a loop: not of the `while` that ends a `do`."""
    braces, bare = [], []  # of '{': is it the body of a do; depths at which a do without braces is open
    closed_do = False
    for i, (_, word) in enumerate(tokens):
        before = tokens[i - 1][1] if i else ''
        if word == '{':
            braces.append(before == 'do')
        elif word == '}':
            closed_do = bool(braces) and braces.pop()
            continue
        elif word == 'do' and tokens[i + 1:i + 2] and tokens[i + 1][1] != '{':
            bare.append(len(braces))
        elif word == 'while' and before == ';' and bare and bare[-1] == len(braces):
            bare.pop()
        elif word == 'for' or (word == 'while' and not closed_do):
            yield i
        closed_do = False


class Text:
    """Preprocessed text, with its tokens replaced in place: no column behind them moves."""

    def __init__(self, text, kept, long_bits=32, own=()):
        self.original = text
        self.places = split_lines(text, kept, own)
        self.stretches = list(self.find_stretches())
        self.code = self.blanked()
        self.long_32 = long_bits == 32
        self.runs = list(self.find_runs()) if self.long_32 else []
        self.apart = set()  # the starts of runs that take a type of their own
        self.listed = {run.start() for run in self.runs if self.is_in_a_list(run)}  # those that stay the system's
        self.narrow = set()  # (begin, end) of arguments that get the type that they have on an AVR

    def find_stretches(self):
        """(begin, end) of what is the sketch's: the rest is most of the text, and is not looked at."""
        ends = [place.start for place in self.places[1:]] + [len(self.original)]
        begin = None
        for place, end in zip(self.places, ends):
            if place.ours and begin is None:
                begin = place.start
            if not place.ours and begin is not None:
                yield begin, place.start
                begin = None
        if begin is not None:
            yield begin, end

    def blanked(self):
        """The same length: spaces in the place of literals, and of all that is not the sketch's."""
        out, at = [], 0
        for begin, end in self.stretches:
            out += [' ' * (begin - at), TOKEN.sub(blank, self.original[begin:end])]
            at = end
        return ''.join(out) + ' ' * (len(self.original) - at)

    def find_runs(self):
        """The specifiers that stand together, where there is exactly one `long` and no `double` among them."""
        run = Run()
        for match in WORD.finditer(self.code):
            if match[0] in SPECIFIERS:
                run.words.append((match.start(), match[0]))
                continue
            yield from self.of_32_bits(run)
            run = Run()
        yield from self.of_32_bits(run)

    @staticmethod
    def of_32_bits(run):
        names = run.names()
        if names.count('long') == 1 and 'double' not in names:
            yield run

    def is_argument_of_a_template(self, run):
        return bool(re.search(r'[<,]\s*$', self.code[max(0, run.start() - 80):run.start()]) and re.match(r'\s*[>,]', self.code[run.end():]))

    def is_in_a_list(self, run):
        """Its statement has is_same<T, …> of it, and of an int with the same sign."""
        if not self.is_argument_of_a_template(run):
            return False
        begin = max(self.code.rfind(end, 0, run.start()) for end in ';{}')
        end = STATEMENT_END.search(self.code, run.end())
        statement = self.code[begin + 1:end.start() if end else len(self.code)]
        return 'is_same' in statement and bool(LISTED_INT[run.is_unsigned()].search(statement))

    def converted(self):
        edits = [edit for run in self.runs for edit in self.edits_of_run(run)]
        edits += self.edits_of_literals() + self.edits_of_system_long() if self.long_32 else []
        edits += self.edits_of_waits()
        edits += [edit for begin, end in self.narrow for edit in ((begin, begin, 'qduino_narrow('), (end, end, ')'))]
        edits += [(place, place, '_of_sketch') for place in places_of_own_names(self.code)]
        out, at = [], 0
        for start, end, text in sorted(edits):
            out += [self.original[at:start], text]
            at = end
        return ''.join(out) + self.original[at:]

    def edits_of_run(self, run):
        if run.start() in self.apart | self.listed:
            kept = [word for word in run.names() if word not in ('unsigned', 'signed', 'long', 'int')]
            if run.start() in self.apart:
                name = f'qduino_other_long<{"unsigned" if run.is_unsigned() else "int"}>'
            else:
                name = 'qduino_system_unsigned_long' if run.is_unsigned() else 'qduino_system_long'
            return [(run.start(), run.end(), ' '.join([*kept, name]))]
        long = next(start for start, word in run.words if word == 'long')
        return [(long, long + 4, '    ' if 'int' in run.names() else 'int ')]

    def edits_of_literals(self):
        edits = []
        for match in (m for stretch in self.stretches for m in TOKEN.finditer(self.original, *stretch)):
            if match['number']:
                number = WHOLE_NUMBER.match(match[0])
                if number:
                    edits.append((*match.span(), number_of_32_bits(number['digits'], number['suffix'] or '').ljust(len(match[0]))))
            elif match['string'] and '%' in match[0] and self.is_format(match.start()):
                edits.append((*match.span(), LONG_FORMAT.sub(r'\1', match[0])))
        return edits

    def edits_of_system_long(self):
        return [(*match.span(), names[match[0]][0]) for pattern, names in (
            (SYSTEM_LONG_NAME, SYSTEM_LONG), (SYSTEM_LONG_FUNCTION, SYSTEM_LONG_FUNCTIONS)) for match in pattern.finditer(self.code)]

    def edits_of_waits(self):
        """Loops without a body whose head changes nothing: they wait."""
        tokens = [(m.start(), m[0]) for m in WORD.finditer(self.code)]
        edits = []
        for head in heads_of_loops(tokens):
            end = end_of_parentheses(tokens, head + 1)
            body = end + 1
            inside = self.code[tokens[head][0]:tokens[end][0]]
            # An assignment, ++, --, the third part of a for, a range: such a loop gets on.
            gets_on = re.search(r'\+\+|--|(?<![=!<>])=(?!=)|;\s*[^;\s][^;]*$', inside)
            if gets_on or (tokens[head][1] == 'for' and inside.count(';') != 2) or body >= len(tokens):
                continue
            words = [word for _, word in tokens[body:body + 3]]
            if words[0] == ';' or words[:2] == ['{', '}'] or words == ['{', ';', '}']:
                start = tokens[body][0]
                wait = f'__asm__ volatile("" : : "i"({len(edits)}));'
                edits.append((start, start + 1, wait if words[0] == ';' else '{' + wait))
        return edits

    def is_format(self, offset):
        """The text is an argument of a call of the printf family, or of a call in it."""
        depth = 0
        for i in range(offset - 1, max(-1, offset - 4000), -1):
            c = self.code[i]
            if c in ';{}':
                return False
            if c == ')':
                depth += 1
            elif c == '(':
                depth -= 1
                if depth < 0:
                    depth = 0
                    name = re.search(r'[A-Za-z_]\w*\s*$', self.code[max(0, i - 80):i])
                    if name and FORMATTED.search(name[0]):
                        return True
        return False

    def set_apart(self, file, line, column):
        """The runs in the declaration whose name is here take a type of their own, those of a template for one type the system's. False: there
        are none."""
        for place in self.places:
            if place.line != line or place.file != file:
                continue
            start = place.start + column - 1
            end = next((m.start() for m in re.finditer(r'[{;]', self.code[start:start + 4000])), 0) + start
            found = [run for run in self.runs if start <= run.start() < end and run.start() not in self.apart | self.listed]
            if found:
                starts = {run.start() for run in found}
                if all(map(self.is_argument_of_a_template, found)):
                    self.listed |= starts
                else:
                    self.apart |= starts
                return True
        return False

    def narrow_arguments(self, file, line, column, indexes):
        """The arguments with these indexes, of the call that one of its parentheses here belongs to, are narrowed. False: there are none."""
        found = set()
        for place in self.places:
            begin = place.start + column - 1
            if place.line != line or place.file != file or not place.ours or self.code[begin:begin + 1] not in ('(', ')'):
                continue
            if self.code[begin] == ')':
                begin = matching_parenthesis(self.code, begin)
            at, index, depth = begin + 1, 0, 0
            for i in range(begin, len(self.code) if begin >= 0 else 0):
                c = self.code[i]
                depth += {'(': 1, '[': 1, '{': 1, ')': -1, ']': -1, '}': -1}.get(c, 0)
                if depth == 0 or (c == ',' and depth == 1):
                    argument = self.original[at:i] if '/' not in self.original[at:i] else self.code[at:i]
                    if index in indexes and argument.strip():
                        found.add((at + len(argument) - len(argument.lstrip()), at + len(argument.rstrip())))
                    at, index = i + 1, index + 1
                if depth == 0:
                    break
        added = found - self.narrow
        self.narrow |= added
        return bool(added)


def number_of_32_bits(digits, suffix):
    """A whole number as it stands where a `long` has 32 bits: C++20, [lex.icon], the types that a literal may have."""
    if digits.lower() == LONG_MAX_64 and 'l' in suffix.lower():
        digits = LONG_MAX_32
    plain = digits.replace("'", '').lower()
    decimal = not plain.startswith('0')
    value = int(plain, 10 if decimal else 16 if plain.startswith('0x') else 2 if plain.startswith('0b') else 8)
    unsigned = 'U' if 'u' in suffix.lower() else ''
    if value < (1 << 32 if unsigned or not decimal else 1 << 31):
        return digits + unsigned
    return digits + (unsigned or ('' if decimal and value < 1 << 63 else 'U' if value >= 1 << 63 else '')) + 'LL'


def declarations_of_system_long(code, cpp):
    """What stands before the text for the names that it has."""
    names = sorted(set(SYSTEM_LONG_NAME.findall(code)))
    functions = sorted(set(SYSTEM_LONG_FUNCTION.findall(code)))
    out = ''.join('typedef %s %s;\n' % SYSTEM_LONG[name][::-1] for name in names)
    declared = ''.join(SYSTEM_LONG_FUNCTIONS[name][1] + '\n' for name in functions)
    if not cpp:
        return out + declared
    if declared:
        out += 'extern "C" {\n' + declared + '}\n'
    if out:
        every = [SYSTEM_LONG[name][0] for name in names] + [SYSTEM_LONG_FUNCTIONS[name][0] for name in functions]
        out += 'namespace std {\n' + ''.join('using ::%s;\n' % name for name in every) + '}\n'
    return out


def diagnostics(command):
    """The compiler's messages as it gives them to programs; none where it cannot."""
    import json  # seldom needed
    done = subprocess.run([*command, '-fdiagnostics-format=json'], capture_output=True, text=True, check=False)
    try:
        return json.loads(done.stderr.splitlines()[0]) if done.stderr else []
    except ValueError:
        return []


def declared_twice(messages):
    """For each declaration that has become the same as another: where both are."""
    for message in messages:
        if message.get('kind') == 'error' and TWICE.search(message.get('message', '')):
            found = [place['caret'] for part in [message, *message.get('children', [])] for place in part.get('locations', [])]
            yield [(caret['file'], caret['line'], caret.get('byte-column', caret['column'])) for caret in found]


def undecided_calls(messages):
    """For each call that the compiler cannot decide: where it is, and which of its arguments are a `long` of the system."""
    for message in messages:
        call = UNDECIDED.search(message.get('message', '')) if message.get('kind') == 'error' else None
        types = [each.split('{')[0].strip() for each in cut_at_top(call['types'], ',')] if call else ()
        indexes = {i for i, each in enumerate(types) if LONG_OF_SYSTEM.fullmatch(each)}
        for place in message['locations'] if indexes else ():
            caret = place['caret']
            yield caret['file'], caret['line'], caret.get('byte-column', caret['column']), indexes


def without_words_on_long_formats(said):
    """What the compiler said, without its warnings that a `%ld` is given an `int`: both have 32 bits here."""
    kept, context, dropping = [], [], False
    for line in said.splitlines(keepends=True):
        plain = COLOUR.sub(b'', line)
        if FORMAT_OF_A_LONG.search(plain):
            dropping = True
        elif BEFORE_A_WARNING.match(plain):
            context = [line] if dropping else [*context, line]
            dropping = False
        elif not dropping or not plain.startswith(b' ') and b': note:' not in plain:
            kept += [*context, line]
            context, dropping = [], False
    return b''.join(kept)


def main_of(text):
    """True, and says so, when the sketch has a main() of its own: it would take the place of the board's."""
    for match in re.finditer(r'(?<![\w.:>])main\s*\([^(){};]*\)\s*\{', text.code):
        before = text.code[:match.start()]
        if before.count('{') != before.count('}'):
            continue
        place = [place for place in text.places if place.start <= match.start()][-1]
        print(f'{place.file}:{place.line}:{match.start() - place.start + 1}: error: a sketch has no main(): the board has it, and calls '
              'setup() and loop(). Move what stands here into these two.', file=sys.stderr)
        return True
    return False


def without(arguments, flag, values):
    """`arguments` without `flag` and so many words behind it."""
    at = arguments.index(flag) if flag in arguments else len(arguments)
    return arguments[:at] + arguments[at + 1 + values:]


def compile_text(text, unit, compiling):
    """Compiles what has become of the text; sets declarations apart until no two are the same. Returns the exit status."""
    for _ in range(ROUNDS):
        head = OTHER_LONG if text.apart and unit.suffix == '.ii' else ''
        head += (NARROWER if text.narrow else '') + (SYSTEM_LONGS if text.listed and unit.suffix == '.ii' else '')
        if text.long_32:
            head += declarations_of_system_long(text.code, unit.suffix == '.ii')
        # A word of the language before the pragma would forbid it.
        prepared, pragma, rest = text.converted().rpartition(PREPARED)
        named, newline, rest = rest.partition('\n') if pragma else ('', '', rest)
        unit.write_text(''.join([prepared, pragma, named, newline, '# 1 "<long>" 3\n', head, rest]), encoding='utf-8',
                        errors='surrogateescape')
        done = subprocess.run(compiling, capture_output=True, check=False)
        if done.returncode == 0 or unit.suffix == '.i':
            break
        messages = diagnostics([*without(without(compiling, '-o', 1), '-c', 0), '-fsyntax-only'])
        changed = [pair for pair in declared_twice(messages) if any(text.set_apart(*place) for place in pair)]
        if text.long_32:
            changed += [call for call in undecided_calls(messages) if text.narrow_arguments(*call)]
        if not changed:
            break
    sys.stdout.buffer.write(done.stdout)
    sys.stderr.buffer.write(without_words_on_long_formats(done.stderr) if text.long_32 else done.stderr)
    return done.returncode


def words_of(folder):
    """The set of all words in the files that Arduino.h is made of; they are kept beside it."""
    header, kept = (os.path.join(folder, 'Arduino.h' + ending) for ending in ('.gch', '.words'))
    if os.path.exists(kept) and os.path.getmtime(kept) >= os.path.getmtime(header):
        return set(pathlib.Path(kept).read_text(encoding='utf-8').split())
    read = pathlib.Path(folder, 'Arduino.h.d').read_text(encoding='utf-8').partition(':')[2].replace('\\\n', ' ').split()
    words = set()
    for file in read:
        words.update(re.findall(r'[A-Za-z_]\w*', pathlib.Path(file).read_text(encoding='utf-8', errors='replace')))
    try:
        own = pathlib.Path(f'{kept}.{os.getpid()}')
        own.write_text('\n'.join(sorted(words)), encoding='utf-8')
        own.replace(kept)
    except OSError:  # as a user who may only read it
        pass
    return words


def may_stand_first(text, folder, is_own):
    """True when what a source says before it comes to Arduino.h means the same behind it. `text` is what has become of it with the header
    of `folder` before all, and with its definitions of macros."""
    own, known = False, None
    for line in text.partition(PREPARED)[2].split('\n')[1:]:
        marker = LINE_MARKER.match(line) if line.startswith('#') else None
        if marker and marker[2] == f'{folder}/Arduino.h' and '1' in marker[3].split():
            return True
        if marker:
            own = is_own(marker[2], '3' in marker[3].split())
        elif own and line.strip():
            definition = DEFINITION.match(line)
            if not definition or definition[1] == 'undef':
                return False
            if READERS_OF_FLASH.fullmatch(definition[2]):
                continue
            known = known or words_of(folder)
            if definition[2] in known:
                return False
    return False


def by_prepared(command, folder):
    """The command, with Arduino.h of the prepared folder where one is named."""
    return [*command, '-I', folder, '-fpch-preprocess'] if folder else command


def preprocess(command, unit, folder, is_own):
    """Writes what becomes of the source in `command` into `unit`, by Arduino.h of the prepared folder where one is named. The exit status."""
    command = by_prepared(command, folder)
    if folder and os.path.exists(os.path.join(folder, 'Arduino.h.gch')):
        first = ['-include', os.path.join(folder, 'Arduino.h'), '-dD', '-E', '-o', str(unit)]
        done = subprocess.run([*command, *first], capture_output=True, check=False)
        if done.returncode == 0:
            text = unit.read_text(encoding='utf-8', errors='surrogateescape')
            if may_stand_first(text, folder, is_own):
                text = re.sub(r'(?m)^#(?:define|undef)\b.*', '', text)
                unit.write_text(text, encoding='utf-8', errors='surrogateescape')
                sys.stderr.buffer.write(done.stderr)
                return 0
    return subprocess.run([*command, '-E', '-o', str(unit)], check=False).returncode


def find_headers(command, folder, is_own):
    """-M: which headers a source reads. Writes them into the file that -MF names. The exit status."""
    unit = pathlib.Path(command[command.index('-MF') + 1] + '.ii')
    status = preprocess(['-MD' if word == '-M' else word for word in command], unit, folder, is_own)
    unit.unlink(missing_ok=True)
    return status


def main():
    split = sys.argv.index('--')
    options, command = list(zip(sys.argv[1:split:2], sys.argv[2:split:2])), sys.argv[split + 1:]
    kept = [os.path.join(value, '') for name, value in options if name == '--keep']
    own = [os.path.join(value, '') for flag, value in zip(command, command[1:]) if flag == '-isystem']
    own = [folder for folder in own if folder not in kept]
    prepared = next((value for name, value in options if name == '--prepared'), '')

    def is_own(file, system):
        return is_ours(file, system, kept, own)
    if prepared and '-M' in command and '-MF' in command:
        return find_headers(command, prepared, is_own)
    if '-c' not in command or '-o' not in command or 'assembler-with-cpp' in command:
        os.execvp(command[0], command)
    source = pathlib.Path(command[command.index('-c') + 1])
    output = command[command.index('-o') + 1]
    unit = pathlib.Path(output + ('.i' if source.suffix == '.c' else '.ii'))
    bare = without(without(command, '-c', 1), '-o', 1)
    folder = prepared if source.suffix != '.c' else ''
    status = preprocess([*bare, str(source)], unit, folder, is_own)
    if status != 0:
        return status
    bare = by_prepared(bare, folder)
    long_bits = 64 if ('--long', '64') in options else 32
    text = Text(unit.read_text(encoding='utf-8', errors='surrogateescape'), kept, long_bits, own)
    if ('--main', 'refused') in options and main_of(text):
        return 1
    formats = any(os.path.exists(os.path.join(folder, FORMATS_HEADER)) for folder in kept)
    if formats and long_bits == 32 and PREPARED not in text.original and 'qduino_printf' not in text.original and FORMATS.search(text.code):
        # By a file of its own: -include looks into the working folder first, and a header that is
        # found there is the sketch's.
        first = pathlib.Path(output + '.first.h')
        first.write_text(f'#include <{FORMATS_HEADER}>\n', encoding='utf-8')
        subprocess.run([*bare, '-include', str(first.resolve()), '-E', str(source), '-o', str(unit)], check=True)
        first.unlink()
        text = Text(unit.read_text(encoding='utf-8', errors='surrogateescape'), kept, long_bits, own)
    compiling = [*without(without(bare, '-MD', 0), '-MF', 1), '-c', str(unit), '-o', output]
    status = compile_text(text, unit, compiling)
    unit.unlink()
    return status


if __name__ == '__main__':
    sys.exit(main())
