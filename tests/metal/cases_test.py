"""The simulator against the kernel: the same sets of loops, with what this kernel's calls and passes take (cases/costs.toml).

  cases     each loop keeps its periods in both, and its worst response is the same within a tenth
  refused   what no board may take, both refuse

  cases_test.py QDUINO [Class.test]"""
import re
import subprocess
import tomllib
import unittest

from runs import ENVIRONMENT, HERE, QDUINO, Run, main, metal

COSTS = HERE / 'cases/costs.toml'
SECONDS = '0.3'
LOOPS = 16


def said(words, seconds=1700):
    done = subprocess.run(list(map(str, words)), stdin=subprocess.DEVNULL, capture_output=True, timeout=seconds, check=False, env=ENVIRONMENT)
    return done.returncode, done.stdout.decode(errors='replace') + done.stderr.decode(errors='replace')


def simulated(sketch):
    return said([QDUINO, 'sim', sketch, '--board', COSTS, '--for', SECONDS])


def worst(report):
    """{loop: ns}"""
    return {int(loop): int(ns) for loop, ns in re.findall(r'^worst (\d+) (\d+)', report, re.M)}


class Cases(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.simulated, cls.on_metal = simulated(HERE / 'cases'), said(
            metal('run', HERE / 'cases', '--cores', 8, '--witness', 'bochs', '--mips', 100, '--for', SECONDS))

    def test_every_loop_keeps_its_periods_in_both(self):
        for status, report in self.simulated, self.on_metal:
            self.assertEqual(status, 0, report)
            self.assertEqual(set(worst(report)), set(range(1, LOOPS + 1)), report)
            self.assertIn('every period was kept', report)

    def test_the_simulator_says_each_worst_response(self):
        expected, measured = worst(self.simulated[1]), worst(self.on_metal[1])
        for loop, ns in measured.items():
            with self.subTest(loop=loop):
                self.assertLess(abs(expected[loop] - ns), 0.1 * ns, f'{expected[loop]} simulated, {ns} on the kernel')

    def test_the_costs_are_this_kernels(self):
        passes = [int(ns) for ns in re.findall(r'kernel (\d+) ns', ' '.join(self.on_metal[1].split()))]
        named = re.fullmatch(r'(\d+) us', tomllib.loads(COSTS.read_text())['sim']['costs']['context_switch'])
        self.assertLess(abs(1000 * int(named[1]) - max(passes)), 0.2 * max(passes))


class Refused(unittest.TestCase):
    def test_both_refuse_each(self):
        simulated_status, simulated_report = simulated(HERE / 'refused')
        run = Run(HERE / 'refused', '--for', '1', '--cores', 4)
        for status, report in (simulated_status, simulated_report), (run.status, run.report):
            self.assertEqual(status, 2, report)
            for core in range(4):
                self.assertIn(f'core {core}: refused', report)


if __name__ == '__main__':
    main(when_asked=True, bochs='bochs bochs-term bochsbios vgabios', qemu_system_x86_64='qemu-system-x86', grub_mkimage='grub-common',
         xorriso='grub-pc-bin xorriso')
