"""The board for aarch64 in QEMU's machine virt. What the pins of its PL061 do is QEMU's own trace, or its qtest wires.

  aarch64_test.py QDUINO BUILD_FOLDER [Class.test]"""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

BUILD = pathlib.Path(sys.argv.pop(2))

from runs import ENVIRONMENT, HERE, ROOT, Run, main, metal  # noqa: E402

sys.path.insert(0, str(ROOT / 'tests/emulated'))
from emulator import Machine  # noqa: E402

VIRT = ['qemu-system-aarch64', '-machine', 'virt,gic-version=2', '-cpu', 'cortex-a53', '-m', '128', '-smp', '2']
QUIET = ['-display', 'none', '-nodefaults', '-no-reboot']
EXACT = {'BusyUntilAndSleepUntilAreNeverEarly'}  # contract_test.py says why
LIMIT_S = 120


def setUpModule():
    subprocess.run(['cmake', '--build', BUILD, '--target', 'metal-aarch64'], check=True, timeout=1500)


class Virt(Run):
    def __init__(self, sketch, *options, **more):
        super().__init__(sketch, '--arch', 'aarch64', *options, **more)


class PulseTrain(unittest.TestCase):
    """sketches/pulse_train, as it is."""

    def test_every_pulse_is_seen_outside_and_core_1_is_never_interrupted(self):
        for cores in 2, 4:
            run = Virt(ROOT / 'sketches/pulse_train', '--for', '0.2', '--cores', cores)
            self.assertEqual(run.status, 0, run.report)
            self.assertEqual(run.levels(6), [1, 0] * run.rises(6))
            self.assertGreater(run.rises(6), 1900)
            self.assertLess(run.rises(6), 2000)
            self.assertEqual(run.came_to(1), (0, 0), run.report)
            self.assertIn('GICv2, generic timer', ' '.join(run.report.split()))
            self.assertIn(f'  core {cores - 1}: ', run.report)

    def test_two_runs_are_the_same(self):
        first, second = (Virt(ROOT / 'sketches/pulse_train', '--for', '0.1') for _ in range(2))
        self.assertEqual((first.record, first.report), (second.record, second.report))
        self.assertGreater(len(first.record), 1000)


class Contract(unittest.TestCase):
    """The contract of every board (contract_test.py), on this one."""

    def boot(self, words):
        shift = 0 if words.removeprefix('case=') in EXACT else 4
        done = subprocess.run([*VIRT, *QUIET, '-kernel', BUILD / 'aarch64/tests/contract-metal', '-append', 'semihosting ' + words, '-icount',
                               f'shift={shift},sleep=off', '-serial', 'stdio', '-semihosting-config', 'enable=on,target=native'],
                              stdin=subprocess.DEVNULL, capture_output=True, timeout=LIMIT_S, check=False)
        return done.returncode, (done.stdout + done.stderr).decode(errors='replace')

    def test_every_case(self):
        status, names = self.boot('list')
        self.assertEqual(status, 0, names)
        self.assertGreater(len(names.split()), 25)
        for name in names.split():
            with self.subTest(name):
                self.assertEqual(self.boot('case=' + name), (0, 'passed\n'))


class Inputs(unittest.TestCase):
    """tests/metal/aarch64: edges that come from outside."""

    def test_each_edge_from_outside_has_its_handler(self):
        built = subprocess.run(metal('build', HERE / 'aarch64', '--arch', 'aarch64'), capture_output=True, text=True, timeout=200, check=True,
                               env=ENVIRONMENT)
        folder = self.enterContext(tempfile.TemporaryDirectory())
        with Machine([*VIRT, '-kernel', built.stdout.strip(), '-append', 'for=3600'], folder, LIMIT_S) as machine:
            chip = machine.device('pl061')
            machine.watch_outputs(chip)
            machine.expect('rises 0$')
            for level in [True, False] * 5:
                machine.set_input(chip, 4, level)
                machine.expect_output(5, level)
            for rise in range(1, 6):
                machine.set_input(chip, 3, True)
                machine.expect(f'rises {rise}$')
                machine.expect_output(6, rise % 2 == 1)
                machine.set_input(chip, 3, False)
            self.assertNotIn('has lost a register', '\n'.join(machine.console))


    def test_interrupts_and_budgets_are_core_0s(self):
        run = Virt(HERE / 'aarch64', '--for', '0.5', said=b'echo, please')
        self.assertEqual(run.status, 0, run.report)
        self.assertEqual(run.came_to(1)[1], 0, run.report)
        self.assertGreater(run.came_to(0)[1], 0, run.report)
        self.assertNotIn('has lost a register', run.serial)
        accounts = ' '.join(run.report.rsplit('Charged in ', 1)[1].split())
        charged = float(dict(re.findall(r'(\d+) had ([\d.]+) us', accounts))['4'])  # of a loop that always wants more: 8 ms of each 40
        periods, rest = divmod(float(accounts.split()[0]), 40_000)
        self.assertLess(charged, periods * 8000 + min(rest, 8000) + 100, run.report)
        self.assertGreater(charged, (periods - 1) * 7900, run.report)


class Date(unittest.TestCase):
    """tests/metal/date: what the PL031 says."""

    def test_a_sketch_begins_at_the_true_date(self):
        built = subprocess.run(metal('build', HERE / 'date', '--arch', 'aarch64'), capture_output=True, text=True, timeout=200, check=True,
                               env=ENVIRONMENT)
        done = subprocess.run([*VIRT, *QUIET, '-kernel', built.stdout.strip(), '-append', 'semihosting for=4', '-icount', 'shift=4,sleep=off', '-serial',
                               'stdio', '-semihosting-config', 'enable=on,target=native', '-rtc', 'base=2026-02-28T23:59:58,clock=vm'],
                              stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=LIMIT_S, check=False)
        self.assertRegex(done.stdout, r'began 2026-02-28T23:59:5[89]')
        self.assertRegex(done.stdout, r'waited 2026-03-01T00:00:0[123]')
        self.assertRegex(done.stdout, r'over 2026-03-01T00:00:0[123]')


class Death(unittest.TestCase):
    """tests/metal/death: the pins come first."""

    def dies(self, letter, *words):
        run = Virt(HERE / 'death', '--for', '60', said=letter)
        self.assertEqual(run.status, 1, run.report)
        for wanted in ('PANIC on core 0: ', *words):
            self.assertIn(wanted, run.report)
        self.assertGreater(run.rises(6), 0)
        self.assertEqual((run.levels(6)[-1], run.levels(7)[-1]), (0, 1))

    def test_null_pointer(self):
        self.dies(b'n', 'page fault at', '(a null pointer)')

    def test_full_stack(self):
        self.dies(b's', '(a stack is full)')

    def test_broken_contract(self):
        self.dies(b'c', 'contract broken: ')


class Refusals(unittest.TestCase):
    def refused(self, *command):
        done = subprocess.run(metal(*command), capture_output=True, text=True, timeout=200, check=False, env=ENVIRONMENT)
        self.assertEqual(done.returncode, 1, done.stderr)
        return ' '.join(done.stderr.split())

    def test_what_there_is_not_is_said(self):
        sketch = ROOT / 'sketches/pulse_train'
        self.assertIn("no 'iso'", self.refused('iso', sketch, '--arch', 'aarch64'))
        for option in ['--card', 'e1000'], ['--boot', 'uefi'], ['--witness', 'bochs']:
            self.assertIn('--arch aarch64 has no', self.refused('run', sketch, '--arch', 'aarch64', *option))
        self.assertIn('there is no network', self.refused('run', sketch, '--arch', 'aarch64', '--forward', '8080:80'))

    def test_a_pin_that_the_chip_has_not_is_refused(self):
        run = Virt(ROOT / 'sketches/blink', '--for', '0.2')  # pin 13
        self.assertIn('a PL061 has the pins 0 to 7', ' '.join((run.report + run.serial).split()))


if __name__ == '__main__':
    if not shutil.which('aarch64-linux-gnu-g++'):
        print('skipped: as root, run: apt-get install g++-aarch64-linux-gnu')
        sys.exit(77)
    main(when_asked=True, qemu_system_aarch64='qemu-system-arm')
