#!/usr/bin/env python3
"""What the compiler says of sketches: errors point into the .ino, wrong declarations of loops do not compile, with the reason.

    compile_test.py COMPILER SOURCE_DIR
"""
import importlib.util
import pathlib
import subprocess
import sys
import tempfile
import unittest

COMPILER, SOURCE = sys.argv[1], pathlib.Path(sys.argv[2])
del sys.argv[1:3]
spec = importlib.util.spec_from_file_location('ino_to_cpp', SOURCE / 'tools/ino/ino_to_cpp.py')
ino_to_cpp = importlib.util.module_from_spec(spec)
sys.modules['ino_to_cpp'] = ino_to_cpp
spec.loader.exec_module(ino_to_cpp)


INCLUDES = [f'-I{folder}' for folder in (SOURCE, SOURCE / 'arduino', *sorted((SOURCE / 'arduino/libraries').iterdir()))]


class Compiling(unittest.TestCase):
    def compile(self, text):
        """(ok, messages) of a sketch."""
        with tempfile.TemporaryDirectory() as temporary:
            folder = pathlib.Path(temporary) / 'bad'
            folder.mkdir()
            (folder / 'bad.ino').write_text(text)
            cpp = folder / 'bad.cpp'
            subprocess.run([sys.executable, SOURCE / 'tools/ino/ino_to_cpp.py', folder, '-o', cpp], check=True)
            done = subprocess.run([COMPILER, '-std=c++20', '-Wall', '-Wextra', '-Wpedantic', '-Wshadow', '-Werror', '-fsyntax-only',
                                   *INCLUDES, cpp], capture_output=True, text=True)
            return done.returncode == 0, done.stderr

    def refused(self, text, *expected):
        ok, messages = self.compile(text)
        self.assertFalse(ok)
        for words in expected:
            self.assertIn(words, messages)

    def test_a_sketch_is_clean_under_all_warnings(self):
        ok, messages = self.compile('TIME_UNIT(us);\nvoid setup() { helper(F("x")); }\n'
                                    'void loop(1, 100, 100, 1) { delayBusyNanoseconds(100000); }\nvoid loop() {}\n'
                                    'void helper(const __FlashStringHelper* s) { Serial.println(s); }\n')
        self.assertTrue(ok, messages)

    def test_an_error_points_into_the_ino(self):
        self.refused('void setup() {\n  int x = 1;\n  no_such_thing(x);\n}\nvoid loop() {}\n', 'bad.ino:3:', 'no_such_thing')

    def test_id(self):
        self.refused('void setup() {}\nvoid loop(33, 1, 10) {}\n', 'id is 1 to 32', 'bad.ino:2:')
        self.refused('void setup() {}\nvoid loop(0, 1, 10) {}\n', 'id is 1 to 32')

    def test_budget(self):
        self.refused('void setup() {}\nvoid loop(1, 11, 10) {}\n', '0 < budget <= period')
        self.refused('void setup() {}\nvoid loop(1, 0, 10) {}\n', '0 < budget <= period')
        self.refused('void setup() {}\nvoid loop(1, 5ms, 100us) {}\n', '0 < budget <= period')

    def test_a_librarys_header_of_a_name_that_freertos_has(self):
        with tempfile.TemporaryDirectory() as temporary:
            library, source = pathlib.Path(temporary, 'library'), pathlib.Path(temporary, 'a.cpp')
            library.mkdir()

            def said(text):
                source.write_text(text)
                return subprocess.run([COMPILER, '-std=c++20', '-fsyntax-only', *INCLUDES, f'-I{library}', source],
                                      capture_output=True, text=True).stderr
            for name in ('queue', 'timers', 'task', 'semphr', 'event_groups'):
                self.assertIn(f'{name}.h: No such file', said(f'#include <{name}.h>\n'))
                (library / f'{name}.h').write_text(f'struct Of_{name} {{}};\n')
                self.assertEqual(said(f'#include <{name}.h>\nOf_{name} mine;\n'), '')
            self.assertEqual(said('#include <Arduino_FreeRTOS.h>\n#include <queue.h>\n#include <timers.h>\n#include <semphr.h>\n'
                                  '#include <task.h>\n#include <event_groups.h>\nQueueHandle_t q; TimerHandle_t t; SemaphoreHandle_t s;\n'
                                  'EventGroupHandle_t e;\nvoid f() { configASSERT(q == nullptr); }\n'), '')

    def test_headers_by_other_names(self):
        names = ['new.h', 'HID.h', 'PluggableUSB.h', 'USBAPI.h', *(str(path.relative_to(SOURCE / 'arduino')) for path in sorted((SOURCE / 'arduino/api').rglob('*.h')))]
        ok, messages = self.compile(''.join(f'#include <{name}>\n' for name in names) + 'void setup() {}\nvoid loop() {}\n')
        self.assertTrue(ok, messages)

    def test_no_such_device_or_unit(self):
        self.refused('void setup() { noInterrupts(TOASTER, 1); }\nvoid loop() {}\n', 'TOASTER')
        self.refused('TIME_UNIT(weeks);\nvoid setup() {}\nvoid loop() {}\n', 'weeks')


if __name__ == '__main__':
    unittest.main()
