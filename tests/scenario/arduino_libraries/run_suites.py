#!/usr/bin/env python3
"""Runs the test suites of ArduinoCore-API and of ArduinoJson against this board's headers, in the simulator. Run by hand: their repositories
are not in this tree.

    run_suites.py QDUINO [--api FOLDER] [--json FOLDER] [--keep FOLDER] [--only WORD]

--api and --json: checkouts of github.com/arduino/ArduinoCore-API and github.com/bblanchon/ArduinoJson. Both suites are written for Catch2, of
which Debian's package `catch2` has the header. The files of a folder of tests are compiled together, those that do not go with the others apart,
and as a sketch is: with a `long` of 32 bits. Of a suite's own doubles (PrintMock, StreamMock) those are taken that stand on our classes;
a String, a Print or an Arduino.h of its own is not. A file that does not compile is named and left out, and its cases count as failed.

It prints, for each folder, how many cases there are and how many passed, then each that failed; it ends with 0 when all passed but those
that KNOWN lists with their reason. --keep leaves the sketches in FOLDER, where a second run goes on. --only takes folders with this word.
"""
import argparse
import collections
import os
import pathlib
import re
import subprocess
import sys
import tempfile

CASE = re.compile(r'^\s*(?:TEST_CASE|SCENARIO|TEST_CASE_METHOD|TEMPLATE_TEST_CASE)\s*\(', re.M)
RUNNER = '''#define CATCH_CONFIG_RUNNER
#include <catch2/catch.hpp>
#include <cstdio>
int run_tests(const char* report) {
    const char* words[] = {"tests", "--reporter", "xml", "--out", report};
    return Catch::Session().run(5, words);
}
'''
INO = '''#include <SuiteRunner.h>
void setup() {
  run_tests("%s");
  stopSketch();
}
void loop() {}
'''
# Catch2's third version has a header for each part.
SHIMS = {'catch2/catch_test_macros.hpp': '#include <catch2/catch.hpp>\n', 'catch2/catch_approx.hpp': '#include <catch2/catch.hpp>\n#define Approx Catch::Detail::Approx\n',
         'catch.hpp': '#include <catch2/catch.hpp>\n'}
API_SHIMS = {'MillisFake.h': '#pragma once\ninline void millis_autoOn() {}  // the board has a clock\n'}
# What fails for a reason that docs/arduino.md tells.
KNOWN = {
    'Testing String move': 'a String that was moved from is an empty text, not a null pointer',
    'Print::print(int, int': 'a number has 8 hexadecimal digits, as an int has here',
    'Print::print(long, int': 'a long has 32 bits',
    'test_store_char.cpp': 'the bytes of RingBufferN are not public: one loop fills them while another reads',
}


class Part:
    """The files of tests that are compiled together as one sketch, and the flags that they need."""

    def __init__(self, name, files, headers, flags=()):
        self.name, self.files, self.headers, self.flags = name, files, headers, flags

    def cases(self):
        return sum(len(CASE.findall(file.read_text(encoding='utf-8', errors='replace'))) for file in self.files)


def parts_of_api(folder):
    tests = folder / 'test'
    doubles = [path for path in (tests / 'include').glob('*.h') if path.name not in API_SHIMS]
    sources = [tests / 'src' / name for name in ('PrintMock.cpp', 'StreamMock.cpp')]
    for each in sorted(path for path in (tests / 'src').iterdir() if path.is_dir()):
        headers = {**SHIMS, **API_SHIMS, **{path.name: path for path in (*doubles, *each.glob('*.h'))}}
        yield Part(each.name, [*sources, *sorted(each.glob('*.cpp'))], headers)


def parts_of_json(folder):
    tests = folder / 'extras' / 'tests'
    helpers = {path.name: path for path in (tests / 'Helpers').glob('*.hpp')}
    flags = ('-DARDUINOJSON_ENABLE_STD_STREAM=1', '-DARDUINOJSON_ENABLE_STD_STRING=1', '-isystem', str(folder / 'src'))
    for each in sorted(path for path in tests.iterdir() if path.is_dir() and path.name not in ('catch', 'Helpers', 'FailingBuilds')):
        own = {path.name: path for path in each.glob('*.hpp')}
        yield Part(each.name, sorted(each.glob('*.cpp')), {**SHIMS, **helpers, **own}, flags)


def write(path, text):
    """What has not changed is not written again, so that it is not compiled again."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.exists() or path.read_text(encoding='utf-8', errors='replace') != text:
        path.write_text(text, encoding='utf-8')


class Suite:
    def __init__(self, qduino, folder):
        self.qduino, self.folder = qduino, folder
        # A library, so that all sketches share its object.
        runner = self.folder / 'libraries' / 'SuiteRunner'
        write(runner / 'SuiteRunner.h', 'int run_tests(const char* report);\n')
        write(runner / 'runner.cpp', RUNNER)

    def run(self, name, part):
        """Builds it without the files that do not compile; returns {case: passed} and the files left out."""
        sketch = self.folder / name / part.name / 'suite'
        report = sketch.parent / 'report.xml'
        files, out = list(part.files), []
        # What is alone: it sets the library up for itself, or turns out not to go with the others.
        apart = [file for file in files if '#define ARDUINOJSON_' in file.read_text(encoding='utf-8', errors='replace')]
        while files:
            self.write(sketch, part, files, apart, report)
            built = self.command('build', sketch, part)
            if built.returncode == 0:
                break
            # The second way: an error in a library's template names where it is asked for.
            wrong = {file: re.search(rf'{re.escape(str(file))}:\d+:(?:\d+:)? +(?:(?:fatal )?error|required from here).*', built.stderr)
                     for file in files}
            bad = [file for file in files if wrong[file]]
            if not bad:
                sys.exit(f'{part.name} does not build:\n{built.stderr[-4000:]}')
            for file in bad:
                if file not in apart:
                    apart.append(file)
                    continue
                out.append((file, wrong[file][0]))
                files.remove(file)
                apart.remove(file)
        report.unlink(missing_ok=True)
        ran = self.command('sim', sketch, part, '--for', '3600', '--plain')
        if not report.exists() or '</Catch>' not in report.read_text(encoding='utf-8', errors='replace'):
            sys.exit(f'{part.name} did not come to its end:\n{ran.stdout[-2000:]}{ran.stderr[-2000:]}')
        return cases_of(report.read_text(encoding='utf-8', errors='replace')), out

    def command(self, word, sketch, part, *more):
        environment = dict(os.environ, QDUINO_LIBRARIES=str(self.folder / 'libraries'), CXXFLAGS=' '.join(['-O0', '-g0', '-w', *part.flags]))
        only = ('--only', 'sim') if word == 'build' else ()
        return subprocess.run([self.qduino, word, sketch, *only, *more], env=environment, stdin=subprocess.DEVNULL, capture_output=True,
                              text=True, errors='replace', check=False)

    @staticmethod
    def write(sketch, part, files, apart, report):
        texts = {'suite.ino': INO % report}
        for name, header in part.headers.items():
            texts[name] = header if isinstance(header, str) else header.read_text(encoding='utf-8', errors='replace')
        texts['tests.cpp'] = ''.join(f'#include "{file}"\n' for file in files if file not in apart)
        for old in sketch.glob('apart_*.cpp'):
            old.unlink()
        for file in apart:
            texts[f'apart_{file.stem}.cpp'] = f'#include "{file}"\n'
        for name, text in texts.items():
            write(sketch / name, text)


def cases_of(report):
    """{case: passed} of Catch2's XML."""
    return {match[1]: match[2] == 'true' for match in
            re.finditer(r'<TestCase name="([^"]*)".*?<OverallResult success="(true|false)"', report, re.S)}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split('\n', maxsplit=1)[0])
    parser.add_argument('qduino', type=pathlib.Path)
    parser.add_argument('--api', type=pathlib.Path)
    parser.add_argument('--json', type=pathlib.Path)
    parser.add_argument('--keep', type=pathlib.Path)
    parser.add_argument('--only', default='')
    arguments = parser.parse_args()
    totals, unexplained = collections.Counter(), 0
    with tempfile.TemporaryDirectory() as temporary:
        suite = Suite(arguments.qduino.resolve(), (arguments.keep or pathlib.Path(temporary)).resolve())
        for name, folder, parts in (('api', arguments.api, parts_of_api), ('json', arguments.json, parts_of_json)):
            for part in parts(folder.resolve()) if folder else ():
                if arguments.only not in part.name:
                    continue
                results, out = suite.run(name, part)
                count, passed = part.cases(), sum(results.values())
                totals += collections.Counter(cases=count, passed=passed)
                print(f'{name} {part.name}: {count} cases, {passed} passed', flush=True)
                failed = [case for case, good in results.items() if not good] + [f'{file.name} does not compile: {why}' for file, why in out]
                for case in failed:
                    reason = next((why for start, why in KNOWN.items() if case.startswith(start)), '')
                    unexplained += not reason
                    print(f'  {case}{": known: " + reason if reason else ""}', flush=True)
    print(f'{totals["cases"]} cases, {totals["passed"]} passed, {unexplained} failures without a reason')
    return 1 if unexplained or not totals['passed'] else 0


if __name__ == '__main__':
    sys.exit(main())
