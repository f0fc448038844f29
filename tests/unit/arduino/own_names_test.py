#!/usr/bin/env python3
"""Names of a sketch or library that the board or the C library has, too: which get another, and where. Takes the project's folder, a C++ and a C compiler."""
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT, CXX, CC = pathlib.Path(sys.argv[1]).resolve(), *sys.argv[2:4]
del sys.argv[1:4]
sys.path.insert(0, str(ROOT / 'tools/ino'))
import as_arduino  # pylint: disable=wrong-import-position
import own_names  # pylint: disable=wrong-import-position

# What Arduino's language, its AVR core and avr-libc declare at global scope: taken names.
LANGUAGE = re.compile(r'''(?x)
    qduino\w* | arduino | _IO_FILE | String | StringSumHelper | Print | Printable | Stream | LookaheadMode | HardwareSerial | Serial\d? | SERIAL_\d[NEO]\d
    | __FlashStringHelper | NO_IGNORE_CHAR | boolean | byte | word | prog_u?char | [A-Z][A-Z0-9_]*
    | is[A-Z]\w+ | to[A-Z]\w+ | pgm_read_\w+ | \w+_P | u?(?:itoa|toa|ltoa) | dtostrf | strlc(?:py|at) | strto\w+ | v?(?:s|sn|f)?(?:print|scan)f
    | pinMode | digital\w+ | analog(?:Read|Write|Reference) | shift(?:In|Out) | pulseIn(?:Long)? | millis | micros | delay(?:Microseconds)? | yield
    | (?:at|de)tachInterrupt | (?:attachInterruptVcpu|interruptsVcpu|promiseProgress) | (?:noI|i)nterrupts | (?:noT|t)one | min | max | constrain
    | sq | abs | radians | degrees | map | random(?:Seed)? | bit(?:Read|Set|Clear|Write|Toggle)? | (?:low|high)Byte | makeWord
    | port(?:Output|Input|Mode)Register | setup | loop | serialEvent''')


def converted(text):
    """What becomes of lines of a sketch."""
    return as_arduino.Text('# 1 "a.ino"\n' + text, []).converted().split('\n', 1)[1]


class OwnNames(unittest.TestCase):
    def kept(self, text):
        self.assertEqual(converted(text), text)

    def renamed(self, marked):
        """In `marked`, each name that is to become another ends in `@`."""
        self.assertEqual(converted(marked.replace('@', '')), marked.replace('@', '_of_sketch'))

    def test_variables_of_every_form(self):
        self.renamed('unsigned char clock@[8] = {1, 2};\nint a, time@ = 3, *y1@;\nRF24 index@(7, 8);\nconst char pipe@ = 8;\n')
        self.renamed('int pause@{5}; static volatile int link@; void (*sleep@)(int); extern int wait@;\nRF24 write@(CE, 8);\n')
        self.renamed('struct Log { int a; } read@ = {8}, access@[2]; int b __attribute__((unused)), dup@ __attribute__((unused)) = 1;\n')
        self.renamed('namespace { int clock@; } extern "C" { int index@; }\nint f() { return clock@ + index@ + ::time@; }\nint time@;\n')
        self.kept('int f() { int time = 1; extern char** environ; return time; } extern char** environ; int g(int index);\n')

    def test_types(self):
        self.renamed('typedef enum { MANUAL, AUTO } mode_t@;\ntypedef struct { int id; } id_t@;\ntypedef unsigned int time_t@;\n'
                     'using key_t@ = char;\ntypedef void (*clock@)(int);\nmode_t@ m = AUTO; struct P { id_t@ id; key_t@ k[2]; };\n')
        self.renamed('class Channel@;\nclass Mutex@ { public: Mutex@() {} ~Mutex@(); void lock() {} };\nMutex@::~Mutex@() {}\n'
                     'template <typename T, int N = 3> struct RingBuffer@ { T data[N]; };\nstruct Channel@ { int pin; };\n'
                     'class P : public Channel@ { Channel@ c; Mutex@ m; RingBuffer@<Channel@, 4> r; Channel@* f(Channel@&); };\n')
        self.renamed('enum Mode { idle, pause@, wait@ = 4 }; int f() { return pause@ + Mode::wait@; }\n')
        self.kept('enum class Mode { idle, pause }; int f() { return int(Mode::pause); } struct S { enum E { wait }; int g() { return wait; } };\n')

    def test_only_what_is_meant(self):
        self.renamed('int time@;\nvoid f() { radio.time(time@); p->time = time@; std::time(0); say("time"); g(x...  , time@); }\n')
        self.kept('#include <time.h>\nint use() { return time(0) + index("a", 1) - 0; }\nnamespace own { int time; int f() { return time; } }\n')

    def test_members_keep_their_names(self):
        self.renamed('int clock@;\nstruct Watch { int clock; int now() { return clock; } void set(int clock); Watch() : clock(0) {} };\n'
                     'class Other { int now() { return clock@; } void set(int); };\nWatch w = {.clock = clock@};\n'
                     'void Watch::set(int clock) { this->clock = clock; }\nvoid Other::set(int clock@) { ::clock@ = clock@; }\n'
                     'struct Late : Watch { int now(); };\nint Late::now() { return clock; }\n'
                     'template <typename T> struct Box { T clock; T get(); };\ntemplate <typename T> T Box<T>::get() { return clock; }\n')
        self.renamed('int time@; namespace own { int time; int f() { return time; } } int g() { return time@ + own::time; }\n')

    def test_functions(self):
        # The C library has variables of these names.
        self.renamed('int daylight@(int x, char y) { return x / y; }\nvoid setup() { daylight@(3, 1); }\n')
        self.renamed('void pause@() {}\nvoid write@(int a, char b) {}\nvoid close@(int what);\nvoid setup() { pause@(); close@(1); write@(1, 2); }\n')
        self.renamed('int progress@() { return 50; }\nunsigned nanos@ = 5; void spinlockInit@(int* a, int b = 1) {}\n')
        self.kept('double pow(int a, int b) { return 1; }\nint abs(char c) { return c; }\nvoid progress(int percent) { progress(); }\n')
        self.renamed('int rand@() { return 4; }\nint exit@(int a) { return a + rand@(); }\n')

    def test_what_is_not_the_sketchs_stays(self):
        text = ('# 1 "/usr/include/time.h" 1 3\nextern int time(int* t);\n# 1 "a.ino" 2\nint time;\n'
                '# 9 "/usr/include/other.h" 1 3\ninline int f() { return time(0); }\n# 2 "a.ino" 2\nint g() { return time; }\n')
        self.assertEqual(as_arduino.Text(text, []).converted(),
                         text.replace('int time;', 'int time_of_sketch;').replace('return time;', 'return time_of_sketch;'))

    def test_megabytes_of_blanks_end(self):
        """A source that includes the system's headers before Arduino.h has them as blanks, in the middle of a statement."""
        code = 'int' + ' \n' * 1_500_000 + 'pause() { pause(); }\n'
        self.assertEqual([code[place - 5:place] for place in own_names.places_of_own_names(code)], ['pause', 'pause'])

    def test_broken_text_ends(self):
        for text in ('int time; }}} int pause; {{{', 'class { int time', 'enum {', '::time int time;', 'template <int time'):
            converted(text)


class Compiled(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def compile(self, name, text, headers=()):
        for header, content in headers:
            (self.folder / header).write_text(content)
        (self.folder / name).write_text(text)
        compiler = [CC, '-std=gnu17'] if name.endswith('.c') else [CXX, '-std=gnu++20', '-fpermissive', '-w']
        tool = [sys.executable, '-B', ROOT / 'tools/ino/as_arduino.py', '--keep', ROOT, '--keep', ROOT / 'arduino', '--']
        done = subprocess.run([*tool, *compiler, '-DQDUINO_LONG_32', '-isystem', ROOT / 'arduino', '-isystem', ROOT, '-c', self.folder / name,
                               '-o', self.folder / f'{name}.o'], cwd=self.folder, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        return self.folder / f'{name}.o'

    def test_each_name_is_free(self):
        types = own_names.BOARD_TYPES | own_names.LIBC_TYPES
        compiled = self.compile('free.cpp', '#include <Arduino.h>\n#include <unistd.h>\n#include <sys/time.h>\n' +
                                ''.join(f'int {word};\n' for word in sorted(own_names.VALUES - types)) +
                                ''.join(f'struct {word} {{ char c; }};\n' for word in sorted(types)))
        # The linker would take a variable of the C library's name for the C library's function.
        symbols = subprocess.run(['nm', '--defined-only', '--format=posix', compiled], capture_output=True, text=True, check=True).stdout
        self.assertFalse({line.split()[0] for line in symbols.splitlines()} & own_names.VALUES)
        self.assertIn('signal_of_sketch ', symbols)

    def test_headers_libraries_and_the_c_language_agree(self):
        header = ('#pragma once\n#ifdef __cplusplus\nextern "C" {\n#endif\nvoid pause(void);\nextern unsigned long time;\n#ifdef __cplusplus\n}\n#endif\n')
        objects = [
            self.compile('a.c', '#include "a.h"\nunsigned long time = 30;\nvoid pause(void) { time += 4; }\n', [('a.h', header)]),
            # Without the system's headers: the name is in nobody's way, and is to be the same.
            self.compile('b.cpp', '#include "b.h"\nint Channel::read() { return 7; }\n',
                         [('b.h', '#pragma once\nclass Channel { public: int read(); };\n')]),
            self.compile('m.cpp', '#include <iostream>\n#include <unistd.h>\n#include "a.h"\n#include "b.h"\n'
                         '#define SHOW(x) std::cout << #x "=" << int(x) << " "\nstatic int index = 5; int main() { Channel c; pause(); SHOW(time); SHOW(c.read()); SHOW(index); }\n'),
        ]
        subprocess.run([CXX, *objects, '-o', self.folder / 'program'], check=True)
        done = subprocess.run([self.folder / 'program'], capture_output=True, text=True, check=False)
        self.assertEqual(done.stdout, 'time=34 c.read()=7 index=5 ', done.stderr)

    def test_the_list_of_the_boards_names_is_whole(self):
        (self.folder / 'all.cpp').write_text('#include <Arduino.h>\n')
        text = subprocess.run([CXX, '-std=gnu++20', '-DQDUINO_LONG_32', '-I', ROOT / 'arduino', '-I', ROOT, '-E', self.folder / 'all.cpp'],
                              capture_output=True, text=True, check=True).stdout
        # The board's headers stand for the sketch's.
        scopes = own_names.Scopes(as_arduino.Text(text, []).code)
        names = scopes.root.names | scopes.functions_of(scopes.root)
        self.assertIn('nanos', names)
        own = {name for name in names if not LANGUAGE.fullmatch(name)}
        self.assertEqual(own, own_names.BOARD_TYPES | own_names.BOARD_FUNCTIONS.keys())
        for name, counts, _ in scopes.root.functions:
            if name in own_names.BOARD_FUNCTIONS:
                self.assertLessEqual(set(range(counts[0], counts[1] + 1)), own_names.BOARD_FUNCTIONS[name], name)


if __name__ == '__main__':
    unittest.main()
