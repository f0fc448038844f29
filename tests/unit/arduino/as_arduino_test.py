#!/usr/bin/env python3
"""What as_arduino.py makes of `long` (every way to write it, numbers, formats, overloads), of loops that wait, and what must stay. Takes the tool's path and a C++ and a C
compiler."""
import itertools
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile
import unittest

TOOL, CXX, CC = pathlib.Path(sys.argv[1]).resolve(), *sys.argv[2:4]
del sys.argv[1:4]
sys.path.insert(0, str(TOOL.parent))
import as_arduino  # pylint: disable=wrong-import-position

BASES = [('long',), ('long', 'int'), ('signed', 'long'), ('signed', 'long', 'int'), ('unsigned', 'long'), ('unsigned', 'long', 'int'),
         ('long', 'long'), ('unsigned', 'long', 'long'), ('long', 'long', 'int'), ('long', 'double'), ('int',), ('unsigned', 'short')]


def meaning(words):
    """The oracle: what the words stand for on a 32-bit Arduino, by the counts of C's grammar."""
    if 'double' in words:
        return 'long double'
    if 'short' in words:
        return 'unsigned short'
    size = 'long long' if words.count('long') == 2 else 'int'
    return ('unsigned ' if 'unsigned' in words else '') + size


def converted(text, kept=()):
    """What becomes of lines of a sketch."""
    return as_arduino.Text('# 1 "a.ino"\n' + text, list(kept)).converted().split('\n', 1)[1]


class Compiled(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def compile(self, name, text, *flags, status=0, prepared=(), cwd=None):
        """The messages."""
        source = self.folder / name
        source.write_text(text, encoding='utf-8')
        compiler = [CC, '-std=gnu17'] if name.endswith('.c') else [CXX, '-std=gnu++20', '-fpermissive']
        options = ['--keep', self.folder / 'kept', *itertools.chain(*(('--prepared', folder) for folder in prepared))]
        done = subprocess.run([sys.executable, '-B', TOOL, *options, '--', *compiler, '-Wall', *flags, '-MD', '-MF',
                               f'{source}.d', '-c', source, '-o', f'{source}.o'], cwd=cwd, env={**os.environ, 'LC_ALL': 'C'}, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, status, done.stderr)
        return done.stderr

    def output(self, name, text, **options):
        self.compile(name, text, **options)
        subprocess.run([CXX, self.folder / f'{name}.o', '-o', self.folder / 'program'], check=True)
        return subprocess.run([self.folder / 'program'], capture_output=True, text=True, check=True).stdout

    def test_every_spelling_means_what_the_grammar_says(self):
        seed = random.randrange(1 << 32)
        shuffled = random.Random(seed)
        lines = ['#include <type_traits>']
        spellings = {words for base in BASES for words in itertools.permutations(base)}
        for number, words in enumerate(sorted(spellings)):
            place = shuffled.randrange(len(words) + 1)
            spelled = [*words[:place], shuffled.choice(['const', 'volatile', '\n']), *words[place:]]
            lines.append(f'extern {" ".join(spelled)} v{number};\nstatic_assert(std::is_same_v<std::remove_cv_t<decltype(v{number})>, '
                         f'{meaning(words)}>, "{" ".join(words)}, seed {seed}");')
        self.assertEqual(self.compile('spellings.cpp', '\n'.join(lines)), '')

    def test_a_prepared_header_stands_for_its_text(self):
        header = self.folder / 'kept.h'
        header.write_text('#pragma once\nstruct Kept { long size; };\ninline int version() { return 1; }\n')
        prepared = self.folder / 'prepared'
        prepared.mkdir()
        subprocess.run([CXX, '-std=gnu++20', '-fpermissive', '-Wall', '-w', '-x', 'c++-header', '-c', header, '-o', prepared / 'kept.h.gch'],
                       check=True)
        # A program that says 2 was made of this text, and not of the prepared one.
        header.write_text(header.read_text().replace('return 1', 'return 2'))
        text = ('// a comment may stand before it\n#define BEFORE\n#include <kept.h>\n#include <cstdio>\nint f(int) { return 3; }\n'
                'int f(long) { return 4; }\nint main() { long l = 5000000000L; std::printf("%d %zu %zu %d", version(), sizeof(Kept), '
                'sizeof l, f(l)); }\n')
        self.assertEqual(self.output('prepared.cpp', text, prepared=[prepared]), '1 8 4 3')
        # A word of the language before it: the compiler reads the header itself.
        text = text.replace('#define BEFORE', 'int before;').replace('<kept.h>', '"kept.h"')
        self.assertEqual(self.output('unprepared.cpp', text, prepared=[prepared]), '2 4 4 3')

    def prepared_arduino(self):
        """A folder with Arduino.h as PreparedHeaders makes it. version() is 1 in what the compiler has read, and 2 in the header by now."""
        kept, prepared = self.folder / 'kept', self.folder / 'prepared'
        kept.mkdir()
        prepared.mkdir()
        header = kept / 'Arduino.h'
        header.write_text('#ifndef ARDUINO_H\n#define ARDUINO_H\n#include <cstdio>\ninline int version() { return 1; }\n#ifndef KNOWN\n#define KNOWN 4\n#endif\n'
                          '#ifndef pgm_read_byte\ninline int pgm_read_byte(const void*) { return 5; }\n#endif\n#endif\n')
        (prepared / 'Arduino.h').write_text('#include_next <Arduino.h>\n')
        made = prepared / 'Arduino.h.gch'
        subprocess.run([CXX, '-std=gnu++20', '-fpermissive', '-Wall', '-isystem', kept, '-w', '-MD', '-MF', prepared / 'Arduino.h.d', '-x',
                        'c++-header', '-c', prepared / 'Arduino.h', '-o', made], check=True)
        header.write_text(header.read_text().replace('return 1', 'return 2'))
        return ['-isystem', kept], prepared

    def test_a_library_gets_the_prepared_header_behind_its_own(self):
        flags, prepared = self.prepared_arduino()
        library = self.folder / 'library'
        library.mkdir()
        (library / 'next.h').write_text('#pragma once\n#include <cstring>\n#include "Arduino.h"\nstruct Next { int value = version(); };\n')
        program = 'int main() { std::printf("%d", Next().value); }\n'

        def said(before, program=program):
            (library / 'library.h').write_text(f'#ifndef LIBRARY_H\n#define LIBRARY_H\n{before}\n#include "next.h"\n#endif\n')
            self.compile('library.cpp', '// A library.\n#include "library.h"\n' + program, *flags, '-isystem', library, prepared=[prepared])
            subprocess.run([CXX, self.folder / 'library.cpp.o', '-o', self.folder / 'program'], check=True)
            return subprocess.run([self.folder / 'program'], capture_output=True, text=True, check=True).stdout
        self.assertEqual(said(''), '1')
        self.assertEqual(said('#define OWN_OF_LIBRARY 7\n/* it says nothing */'), '1')
        for before in ('int before;', 'extern "C" {}', '#define version version_of_library', '#undef SOMETHING', '#pragma pack(1)'):
            self.assertEqual(said(before), '2', before)
        known = 'int main() { std::printf("%d", KNOWN); }\n'
        self.assertEqual(said('#define KNOWN 3', known), '3')
        own_reader = 'int main() { std::printf("%d %d", pgm_read_byte(nullptr), version()); }\n'
        self.assertEqual(said('', own_reader), '5 1')
        self.assertEqual(said('#define pgm_read_byte(address) 6', own_reader), '6 1')

    def test_a_source_without_arduino_h_does_not_get_it(self):
        flags, prepared = self.prepared_arduino()
        self.assertEqual(self.compile('plain.cpp', '#include <cstdio>\nint version() { return 3; }\n#ifdef KNOWN\n#error it is there\n#endif\n',
                                      *flags, prepared=[prepared]), '')

    def test_libraries_are_found_by_the_prepared_header(self):
        flags, prepared = self.prepared_arduino()
        library = self.folder / 'library'
        library.mkdir()
        (library / 'first.h').write_text('#include "Arduino.h"\n#include <second.h>\n')
        (self.folder / 'a.cpp').write_text('#include <first.h>\n')
        found = self.folder / 'a.d'
        command = [sys.executable, '-B', TOOL, '--keep', self.folder / 'kept', '--prepared', prepared, '--', 'env', 'LC_ALL=C', CXX,
                   '-std=gnu++20', '-fpermissive', '-Wall', *flags, '-M', '-MF', found, '-MQ', 'it', self.folder / 'a.cpp', '-isystem', library]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 1)
        self.assertIn('fatal error: second.h: No such file', done.stderr)
        (library / 'second.h').write_text('')
        self.assertEqual(subprocess.run(command, check=False).returncode, 0)
        self.assertIn('second.h', found.read_text())
        self.assertNotIn('cstdio', found.read_text())  # which the compiler has read before
        self.assertEqual(sorted(path.name for path in self.folder.iterdir() if path.is_file()), ['a.cpp', 'a.d'])

    def test_a_size_chooses_as_on_an_avr(self):
        text = ('#include <cstdio>\n#include <cstring>\nstatic int f(int) { return 1; }\nstatic int f(unsigned) { return 2; }\n'
                'template <typename T> T larger(T a, T b) { return a < b ? b : a; }\nstruct S { int k; S(int) : k(3) {} S(unsigned) : k(4) {} };\n'
                'int main() {\n  char t[] = "abc";\n  const char* end = t + 2;\n  S s(sizeof(t));\n  std::printf("%d %d %u %d %d %d", f(sizeof t), '
                'f(strlen(t) + /* , */ 1), larger(sizeof "ab,", 3u), s.k, f( strlen("a,b") ), f(end - t));\n}\n')
        self.assertEqual(self.output('size.cpp', text), '2 2 4 4 2 1')
        # Whatever else nobody can decide stays an error.
        self.assertIn('is ambiguous', self.compile('double.cpp', 'int f(int);\nint f(unsigned);\nint a = f(1.5);\n', status=1))

    def test_a_list_of_whole_numbers_has_the_type_of_a_size(self):
        text = ('#include <cstdio>\n#include <cstddef>\n#include <ctime>\n#include <type_traits>\nusing std::is_same;\n'
                'template <typename T> constexpr bool is_whole = is_same<T, int>::value || is_same<T, unsigned int>::value ||\n'
                '  is_same<T, signed long>::value || is_same<T, unsigned long>::value;\n'
                'template <typename T> struct Size { static const int value = 0; };\ntemplate <> struct Size<int> { static const int value = 1; };\n'
                'template <> struct Size<long> { static const int value = 2; };\n'
                'template <> struct Size<unsigned int> { static const int value = 3; };\n'
                'template <> struct Size<unsigned long> : Size<unsigned int> {};\n'
                'template <typename T> constexpr bool is_long = is_same<T, long>::value;\n'
                'int main() { std::printf("%d%d%d%d %d%d%d%d %d%d", is_whole<long>, is_whole<unsigned long>, is_whole<size_t>, is_whole<char>, '
                'Size<long>::value, Size<size_t>::value, Size<std::ptrdiff_t>::value, Size<char>::value, is_long<long>, is_long<time_t>); }\n')
        self.assertEqual(self.output('list.cpp', text), '1110 1320 10')

    def test_a_format_with_a_name_is_not_warned_of(self):
        text = ('#include <stdio.h>\nconst char kWrite[] = "%5ld %lu\\n", kRead[] = "%ld %lx";\nvoid f(long a, unsigned long b) {\n'
                '  printf(kWrite, a, b);\n  sscanf("1 2", kRead, &a, &b);\n}\n')
        self.assertEqual(self.compile('format.cpp', text), '')
        self.assertEqual(self.compile('format.c', text.replace('const char kWrite', 'static const char kWrite')), '')
        # What is wrong on an Arduino, too, is warned of, behind its context.
        said = self.compile('wrong.cpp', text + 'const char kText[] = "%ld %s\\n";\nvoid g(long a) {\n  printf(kText, a, a);\n  int unused;\n}\n')
        self.assertEqual(re.findall(r'In function .*|warning: .*', said),
                         ["In function 'void g(int)':", "warning: format '%s' expects argument of type 'char*', but argument 3 has type 'int' "
                          "[-Wformat=]", "warning: unused variable 'unused' [-Wunused-variable]"])
        self.assertIn('long long', self.compile('wide.cpp', text + 'void g(long long a) { printf(kWrite, a, 1ul); }\n'))

    def test_the_systems_headers_keep_theirs(self):
        self.compile('system.cpp', '#include <cstdint>\n#include <ctime>\n#include <cstdlib>\n'
                     'static_assert(sizeof(int64_t) == 8 && sizeof(size_t) == 8 && sizeof(time_t) == 8 && sizeof(clock()) == 8 && '
                     'sizeof(long) == 4);\n')

    def test_what_reads_and_rounds_a_long_gives_32_bits(self):
        text = ('#include <stdio.h>\n#include <stdlib.h>\n#include <math.h>\nint main() { printf("%d %d %d ", (int)sizeof(strtol("", 0, 0)), '
                '(int)sizeof(labs(-1L)), (int)sizeof(strtoul("", 0, 0)));\n'
                'printf("%ld %ld %ld %ld", atol("-77"), labs(-2147483647L), lround(-2.5), lrint(2.5)); return 0; }\n')
        for name in ('reads.c', 'reads.cpp'):
            self.assertEqual(self.output(name, text), '4 4 4 -77 2147483647 -3 2')
        self.assertEqual(self.output('std.cpp', '#include <cstdio>\n#include <cstdlib>\nint main() { std::printf("%d", '
                                     '(int)sizeof(std::labs(1L))); }\n'), '4')

    def test_a_kept_folder_stays_where_it_comes_as_a_systems(self):
        (self.folder / 'kept').mkdir()
        (self.folder / 'other').mkdir()
        for name in ('kept', 'other'):
            (self.folder / name / f'{name}.h').write_text(f'using {name}_long = long;\n')
        self.compile('kept.cpp', '#include "kept.h"\n#include "other.h"\nstatic_assert(sizeof(kept_long) == 8 && sizeof(other_long) == 4);\n',
                     '-isystem', self.folder / 'kept', '-isystem', self.folder / 'other')

    def test_formats_are_the_boards_wherever_the_tool_runs(self):
        kept = self.folder / 'kept'
        (kept / 'arduino/core').mkdir(parents=True)
        (kept / 'arduino/core/formats.h').write_text('#pragma once\nlong of_the_board();\n')
        for cwd in (self.folder, kept):
            self.compile('formats.cpp', '#include <cstdio>\nint f() { return printf("x"); }\nstatic_assert(sizeof(of_the_board()) == 8);\n',
                         '-isystem', kept, cwd=cwd)
        self.assertEqual([path.name for path in self.folder.glob('*first*')], [])

    def test_a_library_below_a_kept_folder_is_no_systems(self):
        inner = self.folder / 'kept/libraries/inner'
        inner.mkdir(parents=True)
        (inner / 'inner.h').write_text('typedef long inner_long;\n')
        self.compile('inner.cpp', '#include "inner.h"\nstatic_assert(sizeof(inner_long) == 4);\n',
                     '-isystem', self.folder / 'kept', '-isystem', inner)

    def test_names_that_the_system_has_too_are_of_32_bits(self):
        again = 'typedef unsigned int uint;\ntypedef unsigned long ulong;\n'
        checks = ('union Both { uint uint; ulong ulong; };\n_Static_assert(sizeof(ulong) == 4 && sizeof(union Both) == 4, "ulong");\n'
                  'struct Mine { int ulonger; };\n')
        for head in (again, '#include <sys/types.h>\n', '#include <sys/types.h>\n' + again, again + '#include <sys/types.h>\n'):
            self.compile('names.cpp', head + checks.replace('_Static_assert', 'static_assert'))
            self.compile('names.c', head + checks)
        self.compile('names.cpp', '#include <sys/types.h>\nstatic_assert(sizeof(u_long) == 4);\n')

    def test_limits_are_those_of_32_bits(self):
        for name in ('limits.cpp', 'limits.c'):
            self.compile(name, '#include <limits.h>\n#include <assert.h>\nstatic_assert(LONG_MAX == 2147483647 && ULONG_MAX == 4294967295U && '
                         'LONG_MIN == -2147483647 - 1 && LLONG_MAX == 9223372036854775807LL, "");\n')

    def test_numbers_are_as_wide_as_they_need(self):
        self.compile('numbers.cpp', "static_assert(sizeof(5L) == 4 && sizeof(0xFFUL) == 4 && sizeof(1'000lu) == 4 && sizeof(0b1L) == 4);\n"
                     'static_assert(sizeof(5000000000UL) == 8 && sizeof(5LL) == 8 && sizeof(5ULL) == 8 && sizeof(1.5L) == 16);\n'
                     'static_assert(0xFFFFFFUL * 256UL + 255UL + 1UL == 0);\n')

    def test_wide_numbers_and_names_are_long_long(self):
        self.compile('wide.cpp', '#include <cstdint>\n#include <type_traits>\n#define IS(x, T) static_assert(std::is_same_v<decltype(x), T>)\n'
                     'IS(5000000000, long long); IS(2147483648, long long); IS(2147483647, int); IS(0xFFFFFFFF, unsigned); IS(0x1FFFFFFFFL, long long);\n'
                     'IS(0xFFFFFFFFFFFFFFFF, unsigned long long); IS(4294967296u, unsigned long long); IS(037777777777, unsigned); IS(INT64_MIN, long long);\n'
                     'IS(int64_t(), long long); IS(std::uint64_t(), unsigned long long); IS(int_fast32_t(), int);\n'
                     'typedef signed long long int64_t;\nint64_t f(int64_t x) { return x; }\n')

    def test_formats_and_overloads(self):
        said = self.output('formats.cpp', """
#include <cstdio>
struct Print {
  void put(int) { puts("int"); }
  void put(long number);
  void put(unsigned long) { puts("unsigned"); }
  void put(unsigned int number);
};
void Print::put(long number) { printf("%ld", number); }
void Print::put(unsigned int number) { printf("unsigned int %u\\n", number); }
template <typename T> struct Name { static const char* text() { return "other"; } };
template <> struct Name<int> { static const char* text() { return "int"; } };
template <> struct Name<long> { static const char* text() { return "long"; } };
int main() {
  unsigned long u = 4294967295UL;
  long s = -1, read = 0;
  int after = 7;
  char text[40];
  snprintf(text, sizeof text, "%lu|%5ld|%-3lx|%lld|%.1Lf", u, s, u, 5LL, 2.5L);
  puts(text);
  sscanf("-42", "%ld", &read);
  printf("%ld %d\\n", read, after);
  puts("100%load %ld");
  Print().put(s);
  Print().put(3);
  puts(Name<long>::text());
}
""")
        self.assertEqual(said.splitlines(), ['4294967295|   -1|ffffffff|5|2.5', '-42 7', '100%load %ld', 'int', 'int', 'int'])

    def test_messages_keep_their_places(self):
        said = self.compile('wrong.cpp', 'unsigned long a = 5UL; int b = missing;\n', status=1)
        self.assertRegex(said, r'wrong\.cpp:1:32: error')
        self.assertIn('header_that_is_not.h', self.compile('none.cpp', '#include <header_that_is_not.h>\n', status=1))


class Text(unittest.TestCase):
    def test_columns_stay(self):
        for line in ('unsigned long int a = 0x10UL + 5l; long b;', 'f(long(x), "%ld"); printf("%d", 5L);'):
            new = converted(line)
            self.assertEqual(len(new), len(line))
            self.assertNotIn('long', new)

    def test_loops_that_wait_are_marked_and_no_others(self):
        for line in ('while (true);', 'while (!flag) ;', 'while (1) {}', 'for (;;);', 'for (;!a.b();) { ; }', 'do while (x); while (y);'):
            self.assertEqual(converted(line).count('__asm__ volatile'), 1, line)
        for line in ('do { x(); } while (y);', 'do x(); while (y);', 'while (*p++);', 'for (int i = 0; i < 9; i++);', 'while ((c = get()) < 0);',
                     'while (a) b();', 'for (char c : text) {}x', 'while_not(1);', 'do { while (a) b(); } while (c);'):
            self.assertEqual(converted(line), line)
        self.assertRegex(converted('while (a == b); do { if (c) d(); } while (e); while (f);'),
                         r'^while \(a == b\) ?__asm__.*0\)\); do { if \(c\) d\(\); } while \(e\); while \(f\) ?__asm__.*1\)\);$')

    def test_names_texts_and_raw_texts_stay(self):
        for line in ('int longer = belong + long_name;', 'puts("a long text");', 'auto r = R"(long 5L %ld)";', 'puts("while (1);");', "int c = 'l';"):
            self.assertEqual(converted(line), line)

    def test_what_is_not_the_sketchs_stays(self):
        text = '# 1 "/usr/include/x.h" 1 3\nlong a = 5L;\n# 2 "a.ino" 2\nlong b = 5L;\n# 3 "a.ino" 3 4\nlong c;\n'
        self.assertEqual(re.findall(r'\w+ +[abc]\b', converted(text)), ['long a', 'int  b', 'int  c'])


if __name__ == '__main__':
    unittest.main()
