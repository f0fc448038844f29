#!/usr/bin/env python3
"""Compiles the examples of Debian's `arduino` package unchanged, and runs each for ten virtual seconds.

    run_examples.py --prepare COMPILER SOURCE_DIR WORK_DIR [FLAG…]       precompiles Arduino.h
    run_examples.py GROUP COMPILER SOURCE_DIR WORK_DIR RUNNER [FLAG…]    one group, such as 01.Basics

Exits 77 (skipped) where the package is neither installed nor unpacked in build/arduino (./test does that). What is expected of a run is in EXPECTED: text on Serial, pins that moved; of a
sketch that is not there, that it compiles, runs and does not fall over.
"""
import pathlib
import re
import subprocess
import sys

UNPACKED = pathlib.Path(__file__).resolve().parents[3] / 'build/arduino/usr/share/arduino/examples'
FOLDERS = ['/usr/share/arduino/examples', '/usr/share/doc/arduino/examples', UNPACKED]
# As the Arduino IDE compiles sketches: lenient, and without warnings. For the simulator, as
# `qduino` does: blocks that run are counted.
COMPILE = ['-std=gnu++20', '-fpermissive', '-w', '-O0', '-fPIC', '-fno-finite-loops', '-fsanitize-coverage=trace-pc']
SKIPPED = 77

# What comes in on Serial, for the sketches that read it.
INPUT = {'ReadASCIIString': '10,200,30\n', 'SerialEvent': 'hello\n', 'Dimmer': 'A\x10', 'PhysicalPixel': 'HLH', 'CharacterAnalysis': 'a7',
         'StringToInt': '42\n', 'StringLength': 'abc', 'switchCase2': 'abx', 'SerialCallResponse': 'AAA',
         'SerialCallResponseASCII': 'AAA'}
# Sketch -> (patterns that must be on Serial, patterns that must be in the report of the pins).
EXPECTED = {
    'AnalogReadSerial': ([r'^\d+\r$'], []),
    'Blink': ([], [r'pin 13 changed 10']),
    'DigitalReadSerial': ([r'^0\r$', r'^1\r$'], []),
    'Fade': ([], [r'pin 9 pwm 3\d\d']),
    'ReadAnalogVoltage': ([r'^\d\.\d\d\r$'], []),
    'BlinkWithoutDelay': ([], [r'pin 13 changed (9|10)']),
    'Button': ([], [r'pin 13 changed 1\d']),
    'Debounce': ([], [r'pin 13 changed']),
    'StateChangeDetection': ([r'^on\r$', r'number of button pushes: 4'], []),
    'toneMelody': ([], [r'pin 8 changed \d{3}']),
    'tonePitchFollower': ([r'^\d+\r$'], [r'pin 9 changed \d{3}']),
    'AnalogInOutSerial': ([r'sensor = \d+\t output = \d+'], [r'pin 9 pwm']),
    'AnalogWriteMega': ([], [r'pin 2 pwm 511', r'pin 10 pwm']),
    'Fading': ([], [r'pin 9 pwm 3\d\d']),
    'ASCIITable': ([r'ASCII Table ~ Character Map', r'^!, dec: 33, hex: 21, oct: 41, bin: 100001\r$',
                    r'^~, dec: 126, hex: 7E, oct: 176, bin: 1111110\r$'], []),
    'Dimmer': ([], [r'pin 9 pwm 2']),
    'Midi': ([], []),
    'PhysicalPixel': ([], [r'pin 13 changed 3']),
    'ReadASCIIString': ([r'^F537E1\r$'], [r'pin 3 pwm 1', r'pin 5 pwm 1', r'pin 6 pwm 1']),
    'SerialCallResponseASCII': ([r'^0,0,0\r|^\d+,\d+,(0|255)'], []),
    'SerialEvent': ([r'^hello\r?$'], []),
    'Arrays': ([], [r'pin 2 changed', r'pin 7 changed']),
    'switchCase': ([r'^(dark|dim|medium|bright)\r$'], []),
    'switchCase2': ([], [r'pin 2 changed']),
    'Knock': ([r'^Knock!\r$'], [r'pin 13 changed']),
    'CharacterAnalysis': ([r"You sent me: 'a'  ASCII Value: 97", r"it's alphanumeric", r"it's a numeric digit"], []),
    'StringAdditionOperator': ([r'^You added 123456789\r$', r'^You added A\r$', r'^Sensor value: \d+\r$'], []),
    'StringCaseChanges': ([r'^<HTML><HEAD><BODY>\r$', r'^</body></html>\r$'], []),
    'StringCharacters': ([r'^SensorReading: 456\r$', r'^SensorReading= 456\r$', r'Most significant digit of the sensor reading is: 4'], []),
    'StringComparisonOperators': ([r'^StringOne == "this"\r$', r'^This equals \(ignoring case\) this\r$', r'^Brown < Charles\r$',
                                  r'^Cucumber comes before Cucuracha\r$'], []),
    'StringConstructors': ([r'^Hello String\r$', r'^13\r$', r'^2d\r$', r'^11111111\r$', r'^5\.698\r$'], []),
    'StringIndexOf': ([r'The index of > in the string <HTML><HEAD><BODY> is 5', r'second to last paragraph tag .* is 33\r$'], []),
    'StringReplace': ([r'^Modified string: </html></head></body>\r$', r'^l33tspeak: b00kk33p3r\r$'], []),
    'StringStartsWithEndsWith': ([r"Server's using http version 1\.1", r'Got an OK from the server'], []),
    'StringSubstring': ([r'It\'s an html file', r'It\'s a text-based file'], []),
    'StringToInt': ([r'^Value:42\r$', r'^String: 42'], []),
    'p03_LoveOMeter': ([r'^sensor Value: \d+, Volts: \d\.\d\d, degrees C: '], []),
    'p05_ServoMoodIndicator': ([r'potVal: \d+, angle: \d+'], [r'pin 9 pwm']),
    'p07_Keyboard': ([r'^\d+\r$'], []),
    'p11_CrystalBall': ([], [r'pin 11 changed \d{2,}']),
    'p13_TouchSensorLamp': ([r'^-?\d+\r$'], []),
}


def examples_folder():
    for folder in FOLDERS:
        if (pathlib.Path(folder) / '01.Basics').is_dir():
            return pathlib.Path(folder)
    print('skipped: the Arduino examples are not installed (apt-get install --no-install-recommends arduino)')
    sys.exit(SKIPPED)


def includes(source, work):
    folders = [work / 'precompiled', source, source / 'arduino', *sorted((source / 'arduino/libraries').iterdir())]
    return [f'-I{folder}' for folder in folders]


def prepare(compiler, source, work, flags):
    examples_folder()
    target = work / 'precompiled' / 'Arduino.h.gch'
    target.parent.mkdir(parents=True, exist_ok=True)
    if 'clang' in subprocess.run([compiler, '--version'], capture_output=True, text=True, check=True).stdout:
        return  # takes precompiled headers another way; it does without
    subprocess.run([compiler, *COMPILE, *flags, *includes(source, work), '-x', 'c++-header',
                    source / 'arduino/Arduino.h', '-o', target], check=True)


def build(sketch, compiler, source, work, flags):
    """The shared object of a sketch folder, or None with the compiler's words on standard output."""
    name = sketch.name
    cpp, library = work / f'{name}.cpp', work / f'{name}.so'
    subprocess.run([sys.executable, source / 'tools/ino/ino_to_cpp.py', sketch, '-o', cpp], check=True)
    done = subprocess.run([compiler, *COMPILE, *flags, *includes(source, work), f'-I{sketch}', '-shared', cpp, '-o', library],
                          capture_output=True, text=True)
    if done.returncode != 0:
        print(f'{name}: does not compile\n{done.stderr}')
        return None
    return library


def run(sketch, library, runner):
    """What is wrong with its run; empty when nothing is."""
    name = sketch.name
    done = subprocess.run([runner, library], input=INPUT.get(name, '').encode('latin-1'), capture_output=True, timeout=60)
    text, report = done.stdout.decode('latin-1'), done.stderr.decode('latin-1')
    if done.returncode != 0:
        return f'exit status {done.returncode}: {report}'
    on_serial, on_pins = EXPECTED.get(name, ([], []))
    missing = [p for p in on_serial if not re.search(p, text, re.M)] + [p for p in on_pins if not re.search(p, report)]
    if not missing:
        return ''
    return f'not found: {missing}\n--- Serial\n{text[:800]}\n--- pins\n{report[:800]}'


def main():
    arguments = sys.argv[1:]
    group, compiler, source, work = arguments[0], arguments[1], pathlib.Path(arguments[2]), pathlib.Path(arguments[3])
    if group == '--prepare':
        return prepare(compiler, source, work, arguments[4:])
    runner, flags = arguments[4], arguments[5:]
    sketches = sorted(p.parent for p in (examples_folder() / group).rglob('*.ino'))
    if not sketches:
        sys.exit(f'no sketches in {group}')
    (work / group).mkdir(parents=True, exist_ok=True)
    failures = 0
    for sketch in sketches:
        library = build(sketch, compiler, source, work, flags)
        wrong = 'does not compile' if not library else run(sketch, library, runner)
        print(f'{sketch.name}: {wrong or "ok"}')
        failures += bool(wrong)
    print(f'{group}: {len(sketches)} sketches, {failures} failed')
    sys.exit(1 if failures else 0)


if __name__ == '__main__':
    main()
