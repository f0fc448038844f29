"""Sketches on the board without an operating system, booted in QEMU by `qduino metal run`: what a witness outside saw at the pins,
what came over the serial line, and what the guarantee report says.

Time is a count of instructions (--deterministic), so a run is the same every time and on every computer.

  metal_test.py QDUINO [Class.test]
Skipped, with exit status 77, when qduino was built without images or no emulator is installed: it says which."""
import os
import pathlib
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
HERE = ROOT / 'tests/metal'
SKIPPED = 77
QDUINO = sys.argv.pop(1)
CACHE = tempfile.mkdtemp(prefix='qduino-metal-')


ENVIRONMENT = {**os.environ, 'XDG_CACHE_HOME': CACHE}


def metal(*words):
    return [QDUINO, 'metal', *map(str, words)]


def read_to(stream, word):
    """The lines up to one that begins with `word`, or to the end."""
    lines = [stream.readline()]
    while lines[-1] and not lines[-1].startswith(word):
        lines.append(stream.readline())
    return b''.join(lines)


class Run:
    """One boot, from outside."""

    def __init__(self, sketch, *options, said=None, driven=None):
        """`said`: bytes to say on the serial line when the sketch has said that it is ready; `driven`: on the wire to its pins, when its loops run."""
        record = pathlib.Path(CACHE) / 'record'
        with subprocess.Popen(metal('run', sketch, '--record', record, '--deterministic', *options), stdin=subprocess.PIPE,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=ENVIRONMENT, bufsize=0) as process:
            before = b''
            if said:
                before += read_to(process.stdout, b'ready')
                process.stdin.write(said)
                process.stdin.flush()
            with socket.socket(socket.AF_UNIX) as wire:  # open to the end: a machine drops what a closed one still holds
                if driven:
                    before += read_to(process.stdout, b'line')
                    wire.connect(f'{CACHE}/wire')
                    wire.sendall(driven)
                rest, report = process.communicate(timeout=200)
        self.status = process.returncode
        self.serial = (before + rest).decode(errors='replace')
        self.report = report.decode(errors='replace')
        self.record = record.read_bytes() if record.exists() else b''
        self.pins = [(byte & 0x7f, byte >> 7) for byte in self.record]

    def levels(self, pin):
        return [level for at, level in self.pins if at == pin]

    def rises(self, pin):
        return self.levels(pin).count(1)

    def came_to(self, core):
        """(timer, devices): interrupts of a core while the loops ran, from the report at the end."""
        last = self.report.rsplit(f'  core {core}:', 1)[1]
        found = re.search(r'timer (\d+), devices (\d+)', last)
        return int(found[1]), int(found[2])


class PulseTrain(unittest.TestCase):
    """sketches/pulse_train, as it is."""

    def test_every_pulse_is_seen_outside_and_core_1_is_never_interrupted(self):
        for cores in 2, 4:
            run = Run(ROOT / 'sketches/pulse_train', '--for', '0.2', '--cores', cores)
            self.assertEqual(run.status, 0, run.report)
            # 100 us of spin and two writes; at the end the safe level, twice.
            self.assertEqual(run.levels(6), [0] + [1, 0] * run.rises(6) + [0, 0])
            self.assertGreater(run.rises(6), 1900)
            self.assertLess(run.rises(6), 2000)
            self.assertEqual(run.came_to(1), (0, 0), run.report)

    def test_two_runs_are_the_same(self):
        first, second = (Run(ROOT / 'sketches/pulse_train', '--for', '0.1') for _ in range(2))
        self.assertEqual(first.record, second.record)
        self.assertEqual(first.report, second.report)
        self.assertGreater(len(first.record), 1000)


class Blink(unittest.TestCase):
    """sketches/blink, as it is."""

    def test_the_light_goes_on_and_off(self):
        run = Run(ROOT / 'sketches/blink', '--for', '2.5')
        self.assertEqual(run.status, 0, run.report)
        self.assertEqual(run.levels(13)[:4], [0, 1, 0, 1])
        self.assertEqual(run.levels(13)[-1], 0)

    def test_reports_of_machine_and_command_share_a_file(self):
        path = pathlib.Path(CACHE) / 'words'
        with open(path, 'wb') as file:
            subprocess.run(metal('run', ROOT / 'sketches/blink', '--for', '0.1', '--deterministic'), stdin=subprocess.DEVNULL,
                           stdout=subprocess.DEVNULL, stderr=file, timeout=200, check=True, env=ENVIRONMENT)
        words = path.read_text()
        places = [words.find(part) for part in ('core 0: admitted', 'Periods: ', 'Pins, as seen', 'Verdict: blink ran')]
        self.assertEqual(places, sorted(places), words)
        self.assertGreaterEqual(places[0], 0, words)


class Kernel(unittest.TestCase):
    """tests/metal/kernel, which says what is on which pin."""

    @classmethod
    def setUpClass(cls):
        cls.run1 = Run(HERE / 'kernel', '--for', '1', '--cores', 3, '--wire', f'{CACHE}/wire', said=b'AZ',
                       driven=bytes((0x80 | 21, 21)) * 10)

    def setUp(self):
        self.assertEqual(self.run1.status, 0, self.run1.report)

    def test_loops_that_want_more_get_their_budgets(self):
        # 20 and 10 ms of each 100, at 100 us a pulse.
        for pin, budgets in (2, 20), (3, 10):
            self.assertGreater(self.run1.rises(pin), 85 * budgets)
            self.assertLess(self.run1.rises(pin), 102 * budgets)

    def test_interrupts_go_where_they_are_routed(self):
        self.assertEqual(self.run1.came_to(1), (0, 0), self.run1.report)
        timer, devices = self.run1.came_to(0)
        self.assertGreater(devices, 200)
        self.assertGreater(timer, 50)
        self.assertGreater(self.run1.rises(6), 4000)

    def test_serial_carries_every_byte_both_ways(self):
        lines = [line for line in self.run1.serial.replace('\r', '').split('\n') if line.startswith('line ')]
        self.assertGreater(len(lines), 80)
        for number, line in enumerate(lines[:-1], 101):
            self.assertEqual(line, f'line {number} of many, long enough to need several turns of the line\'s sixteen bytes')
        self.assertIn('heard 65\r\nheard 90\r\n', self.run1.serial)

    def test_each_edge_has_its_handler(self):
        self.assertGreater(self.run1.rises(11), 80)
        self.assertLessEqual(abs(self.run1.rises(12) - self.run1.rises(11)), 1)

    def test_each_edge_from_outside_has_its_handler(self):
        self.assertEqual(self.run1.rises(22), 10)

    def test_a_waiter_lends_its_rank_to_the_holder(self):
        """From when high waits until low gives the lock back, mid does not run; then high is the first."""
        pins = [event for event in self.run1.pins if event[0] in (4, 5, 10)]
        asked = pins.index((10, 1))
        self.assertEqual(pins[asked - 1], (5, 1), 'low holds the lock when high asks for it')
        self.assertEqual(pins[asked + 1:asked + 3], [(5, 0), (10, 0)])
        self.assertIn((4, 1), pins[asked + 3:], 'mid ran afterwards')


class Death(unittest.TestCase):
    """tests/metal/death: the pins come first."""

    def dies(self, letter, words):
        run = Run(HERE / 'death', '--for', '60', said=letter)
        self.assertEqual(run.status, 1, run.report)
        self.assertIn('PANIC on core 0: ', run.report)
        self.assertIn(words, run.report)
        self.assertGreater(run.rises(6), 0)
        self.assertEqual(run.levels(6)[-1], 0)
        self.assertEqual(run.levels(7)[-1], 1)

    def test_null_pointer(self):
        self.dies(b'n', 'page fault at')
        self.dies(b'n', '(a null pointer)')

    def test_full_stack(self):
        self.dies(b's', '(a stack is full)')

    def test_broken_contract(self):
        self.dies(b'c', 'contract broken: ')

    def test_division_by_zero(self):
        self.dies(b'd', 'divide error')


class Refusal(unittest.TestCase):
    def test_a_sketch_that_does_not_fit_is_refused(self):
        folder = pathlib.Path(CACHE) / 'full'
        folder.mkdir()
        (folder / 'full.ino').write_text('void setup() { pinMode(2, OUTPUT); }\n'
                                         'void loop(1, 60, 100, 0) { digitalWrite(2, HIGH); }\n'
                                         'void loop(2, 60, 100, 0) {}\n')
        run = Run(folder, '--for', '1')
        self.assertEqual(run.status, 2, run.report)
        self.assertIn('is refused on core 0', run.report)
        self.assertEqual(run.rises(2), 0)


def can_run():
    built = subprocess.run(metal('build', ROOT / 'sketches/blink'), capture_output=True, timeout=200, check=False, env=ENVIRONMENT)
    if not shutil.which('qemu-system-x86_64'):
        print('skipped: no emulator. As root, run: apt-get install qemu-system-x86')
    elif b'musl-dev' in built.stderr:
        print('skipped: ' + built.stderr.decode())
    else:
        return True
    return False


if __name__ == '__main__':
    try:
        if not can_run():
            sys.exit(SKIPPED)
        unittest.main(verbosity=2)
    finally:
        shutil.rmtree(CACHE, ignore_errors=True)
