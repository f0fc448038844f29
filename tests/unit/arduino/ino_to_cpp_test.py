#!/usr/bin/env python3
"""What ino_to_cpp.py makes of sketches: prototypes, their place, #line, tabs, registration. Takes the tool's path."""
import importlib.util
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

TOOL = pathlib.Path(sys.argv.pop(1)).resolve()
spec = importlib.util.spec_from_file_location('ino_to_cpp', TOOL)
ino_to_cpp = importlib.util.module_from_spec(spec)
sys.modules['ino_to_cpp'] = ino_to_cpp
spec.loader.exec_module(ino_to_cpp)


def convert(text, name='sketch.ino'):
    return ino_to_cpp.convert([ino_to_cpp.Tab(pathlib.Path(name), text)])


def prototypes(text):
    """The lines that the conversion added, without the first, #line and the registration."""
    before = set(text.splitlines())
    return [line for line in convert(text).splitlines()[1:]
            if line not in before and not line.startswith(('#line', '#undef loop', '[[maybe_unused]]', '#endif'))]


class Prototypes(unittest.TestCase):
    def check(self, text, expected):
        self.assertEqual(prototypes(text), expected)

    def test_the_two_of_every_sketch(self):
        self.check('void setup() {\n}\nvoid loop() {\n}\n', ['void setup();', 'void loop();'])

    def test_returns_and_parameters(self):
        self.check('int add(int a, int b) { return a + b; }\nconst char *name(char const* s){return s;}\n'
                   'unsigned long long wide ( ) {}\nString text(const String &s) {}\n',
                   ['int add(int a, int b);', 'const char *name(char const* s);', 'unsigned long long wide ( );',
                    'String text(const String &s);'])

    def test_a_head_over_several_lines_with_comments(self):
        self.check('void // why\nlong_name(int a, /* one */\n          int b)\n{\n}\n', ['void long_name(int a, int b);'])

    def test_static_inline_template_and_trailing_return(self):
        self.check('static void a() {}\ninline int b() { return 1; }\ntemplate <typename T> T twice(T x) { return x + x; }\n'
                   'auto c() -> int { return 1; }\nvoid d() noexcept {}\n',
                   ['static void a();', 'inline int b();', 'template <typename T> T twice(T x);', 'auto c() -> int;',
                    'void d() noexcept;'])

    def test_function_pointers_and_callbacks(self):
        self.check('void call(void (*f)(int), int n) { f(n); }\n', ['void call(void (*f)(int), int n);'])

    def test_default_arguments_get_none(self):
        self.check('void f(int a = 3) {}\nvoid g() {}\n', ['void g();'])

    def test_what_has_a_prototype_gets_no_second(self):
        self.check('static int f(int);\nint g(int a = 1);\nstatic int f(int a) { return a; }\nint g(int a) { return a; }\n', [])

    def test_each_overload_counts_by_its_parameters(self):
        self.check('int show(const int value);\nint show(int number) { return number; }\nint show(const char *text) { return 0; }\n'
                   'int show() { return 1; }\n', ['int show(const char *text);', 'int show();'])

    def test_types_may_have_their_full_name(self):
        self.check('struct Spot at(int x) { return {x}; }\nenum state next(enum state s) { return s; }\n',
                   ['struct Spot at(int x);', 'enum state next(enum state s);'])
        self.check('struct Packed ALIGNED(4) { int a; };\nclass Led : public Base { };\nvoid f() {}\n', ['void f();'])

    def test_behind_the_types_that_it_names(self):
        for kind in ('struct Pair { int a; };', 'enum Pair { one };', 'typedef struct { int a; } Pair;', 'using Pair = int;', 'typedef int Pair;',
                     'template <int N> struct Two {};\nusing Pair = Two<3>;', '#if A\nstruct Pair { int a; };\n#else\nstruct Pair { long a; };\n#endif'):
            lines = convert(f'void setup() {{}}\n{kind}\nbool odd(Pair p) {{ return 1; }}\n').splitlines()
            last = max(i for i, line in enumerate(lines) if line and line in kind)
            self.assertEqual(lines.count('bool odd(Pair p);'), 1)
            self.assertGreater(lines.index('bool odd(Pair p);'), last, kind)
            self.assertLess(lines.index('void setup();'), last)

    def test_defaults_of_templates_stand_in_the_prototype_alone(self):
        text = convert('template <typename T = pair<int, 2>, int N = 3>\nT first(T x) { return x; }\n')
        self.assertEqual(re.findall(r'<typename T.*N[ =3]*>', text), ['<typename T = pair<int, 2>, int N = 3>', '<typename T               , int N    >'])

    def test_both_branches_begin_the_same_body(self):
        self.check('#if A\nint f(int a) {\n#else\nint f() {\n#endif\nreturn 1; }\nvoid loop() {}\n', ['int f(int a);', 'int f();', 'void loop();'])
        self.check('#if A\nint f(int a)\n#elif B\nint f()\n#endif\n{ return 1; }\n', ['int f(int a);', 'int f();'])
        self.check('#if 0\n{ {\n#endif\nvoid f() {}\n', ['void f();'])
        self.check('#ifdef A\nstatic\n#endif\nvoid f() {}\n', ['static void f();', '#else', 'void f();'])

    def test_members_operators_and_blocks_get_none(self):
        self.check('struct A { void m() {} A() {} };\nclass B : public A { int n() { return 1; } };\n'
                   'void C::method() {}\nbool operator==(A, A) { return true; }\nnamespace n { void inner() {} }\n'
                   'extern "C" { void c_function() {} }\nenum { ONE };\nunion U { int i; };\n', [])

    def test_initialisers_are_no_functions(self):
        self.check('int a[] = {1, 2, 3};\nstruct P p = {1};\nauto f = [](int x) { return x; };\nint b{3};\n'
                   'const int (*q)(int) = nullptr;\nint pins[sizeof(int)] = {1};\n', [])

    def test_extern_c_function_keeps_its_linkage(self):
        self.check('extern "C" void isr(void) {}\n', ['extern "C" void isr(void);'])

    def test_strings_characters_and_comments_hide_braces(self):
        self.check('const char* s = "} void no() {";\nchar c = \'{\';\n// void no() {\n/* void no() { */\n'
                   'const char* r = R"x(void no() { " )x";\nint n = 1\'000;\nvoid yes() { Serial.print("}"); }\n',
                   ['void yes();'])

    def test_calls_of_macros(self):
        self.check('ISR(TIMER1_OVF_vect) {\n}\nTIME_UNIT(us)\nvoid setup() {}\nSOME_MACRO(1)\nint f() { return 1; }\n',
                   ['void setup();', 'int f();'])

    def test_attributes_stay(self):
        self.check('IRAM_ATTR void fast() {}\n__attribute__((noinline)) void slow() {}\n[[noreturn]] void end() { for(;;); }\n',
                   ['IRAM_ATTR void fast();', '__attribute__((noinline)) void slow();', '[[noreturn]] void end();'])

    def test_vcpu_loops_are_left_alone(self):
        text = 'TIME_UNIT(us);\nvoid loop(1, 100, 100, 1) { helper(); }\nvoid loop(2, 1ms, 8ms) {}\nvoid helper() {}\nvoid setup() {}\n'
        self.check(text, ['void helper();', 'void setup();'])
        converted = convert(text)
        self.assertLess(converted.index('TIME_UNIT'), converted.index('void helper();'))
        self.assertLess(converted.index('void helper();'), converted.index('void loop(1'))

    def test_conditions_are_repeated(self):
        text = ('void setup() {}\n#if defined(A)\nvoid f() {}\n#elif B\nvoid g() {}\n#else\nvoid h() {}\n#endif\n')
        out = convert(text)
        self.assertIn('#if defined(A)\n#line 3 "sketch.ino"\nvoid f();\n#endif\n', out)
        self.assertIn('#if defined(A)\n#elif B\n#line 5 "sketch.ino"\nvoid g();\n#endif\n', out)
        self.assertIn('#if defined(A)\n#elif B\n#else\n#line 7 "sketch.ino"\nvoid h();\n#endif\n', out)


class Place(unittest.TestCase):
    def test_a_head_of_two_branches_declares_what_is_defined(self):
        for head in ('#if A\nint f(int a)\n#else\nint f()\n#endif\n{ return 1; }\n', '#ifdef A\nstatic\n#endif\nint f() { return 1; }\n'):
            for flags in ([], ['-DA']):
                text = convert('#define A_DEFINED\n' + head).replace('#include <Arduino.h>\n', '').split('#undef loop')[0]
                compiler = ['g++', '-fsyntax-only', '-Wall', '-Werror', '-Wno-unused-function', '-x', 'c++', *flags, '-']
                done = subprocess.run(compiler, input=text, text=True, capture_output=True, check=False)
                self.assertEqual(done.returncode, 0, done.stderr)

    def test_after_includes_types_and_globals_before_the_first_function(self):
        out = convert('#include <Wire.h>\nstruct P { int x; };\nint n;\nint f(P p) { return g(p); }\nint g(P p) { return p.x; }\n')
        self.assertLess(out.index('struct P'), out.index('int g(P p);'))
        self.assertLess(out.index('int g(P p);'), out.index('int f(P p) {'))
        self.assertTrue(out.startswith('#include <Arduino.h>\n#line 1 "sketch.ino"\n#include <Wire.h>\n'))

    def test_not_inside_a_condition_that_the_first_function_stands_in(self):
        out = convert('int n;\n#ifdef A\nvoid f() {}\n#endif\nvoid g() {}\n')
        self.assertLess(out.index('void g();'), out.index('#ifdef A\nvoid f() {}'))

    def test_in_the_middle_of_a_line(self):
        out = convert('int x; void f() { g(); } void g() {}\n')
        self.assertLess(out.index('int x;'), out.index('void g();'))
        self.assertLess(out.index('void g();'), out.index('void f() {'))

    def test_lines_are_the_sketchs(self):
        out = convert('\n\nvoid setup() {}\n\nvoid loop() {}\n')
        self.assertIn('#line 3 "sketch.ino"\nvoid setup();\n', out)
        self.assertIn('#line 5 "sketch.ino"\nvoid loop();\n', out)
        self.assertIn('#line 3 "sketch.ino"\nvoid setup() {}', out)

    def test_a_name_with_quotes(self):
        self.assertIn(r'#line 1 "a\"b\\c.ino"', convert('int x;\n', 'a"b\\c.ino'))


class Registration(unittest.TestCase):
    def entries(self, text):
        return re.search(r'qduino_sketch_registration\{(.*?), "', convert(text))[1]

    def test_classic(self):
        self.assertEqual(self.entries('void setup() {}\nvoid loop() {}\n'), '&setup, &loop, nullptr')

    def test_void_parameter(self):
        self.assertEqual(self.entries('void setup(void) {}\nvoid loop(void) {}\n'), '&setup, &loop, nullptr')

    def test_vcpu_loops_only(self):
        self.assertEqual(self.entries('void setup() {}\nvoid loop(1, 1, 2) {}\n'), '&setup, nullptr, nullptr')

    def test_both(self):
        self.assertEqual(self.entries('void setup() {}\nvoid loop(1, 1, 2) {}\nvoid loop() {}\n'), '&setup, &loop, nullptr')

    def test_what_stands_in_a_condition_may_be_missing(self):
        text = convert('#ifdef LISTEN\nvoid serialEvent() {}\n#endif\nvoid loop() {}\n')
        self.assertIn('void (serialEvent)() __attribute__((weak));', text)
        self.assertNotIn('void (loop)()', text)

    def test_serial_event(self):
        self.assertEqual(self.entries('void setup() {}\nvoid loop() {}\nvoid serialEvent() {}\n'), '&setup, &loop, &serialEvent')


class Tabs(unittest.TestCase):
    def test_the_main_tab_first_then_by_name(self):
        with tempfile.TemporaryDirectory() as temporary:
            folder = pathlib.Path(temporary) / 'robot'
            folder.mkdir()
            (folder / 'arm.ino').write_text('void arm() { leg(); }')  # no newline at its end
            (folder / 'leg.ino').write_text('void leg() {}\n')
            (folder / 'robot.ino').write_text('#define N 3\r\nvoid setup() {}\r\nvoid loop() { arm(); }\r\n')
            out = folder / 'build' / 'robot.cpp'
            subprocess.run([sys.executable, TOOL, folder, '-o', out], check=True)
            text = out.read_text()
            self.assertLess(text.index('#define N 3'), text.index('void arm() { leg(); }'))
            self.assertLess(text.index('void arm() { leg(); }'), text.index('void leg() {}'))
            self.assertLess(text.index('void leg();'), text.index('void setup() {}'))
            self.assertIn('leg.ino"\nvoid leg();', text)
            self.assertNotIn('\r', text)

    def test_errors(self):
        with tempfile.TemporaryDirectory() as temporary:
            empty = subprocess.run([sys.executable, TOOL, temporary], capture_output=True, text=True)
            self.assertNotEqual(empty.returncode, 0)
            self.assertIn('no .ino file', empty.stderr)
            missing = subprocess.run([sys.executable, TOOL, temporary + '/x.ino'], capture_output=True, text=True)
            self.assertIn('No such file', missing.stderr)


if __name__ == '__main__':
    unittest.main()
