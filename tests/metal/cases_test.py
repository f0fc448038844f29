"""The simulator against the kernel: the same sets of loops, with what this kernel's calls take, and a turn to another loop.

  costs     call_costs/ measures them on the kernel, one by one, before any of the sets runs; cases/costs.toml keeps them
  cases     each loop keeps its periods in both, and its worst response is the same within a tenth
  refused   what no board may take, both refuse

  cases_test.py QDUINO [Class.test]"""
import pathlib
import re
import subprocess
import tomllib
import unittest

from runs import CACHE, ENVIRONMENT, HERE, QDUINO, Run, main, metal

COSTS = HERE / 'cases/costs.toml'
SECONDS = '0.3'
LOOPS = 16


def said(words, seconds=1700):
    done = subprocess.run(list(map(str, words)), stdin=subprocess.DEVNULL, capture_output=True, timeout=seconds, check=False, env=ENVIRONMENT)
    return done.returncode, done.stdout.decode(errors='replace') + done.stderr.decode(errors='replace')


def simulated(sketch, costs=COSTS):
    return said([QDUINO, 'sim', sketch, '--board', costs, '--for', SECONDS])


def on_metal(sketch):
    return said(metal('run', sketch, '--cores', 8, '--witness', 'bochs', '--mips', 100, '--for', SECONDS))


def measured_costs():
    """{call: ns}, as the kernel measures them itself."""
    status, report = on_metal(HERE / 'call_costs')
    assert status == 0, report
    return {call: int(ns) for call, ns in re.findall(r'^cost (\w+) (\d+)', report, re.M)}


def board_file(costs):
    words = ''.join(f'{call} = "{ns} ns"\n' for call, ns in costs.items())
    file = pathlib.Path(CACHE) / 'costs.toml'
    file.write_text('[sim]\ncores = 8\n[sim.costs]\n' + words)
    return file


def worst(report):
    """{loop: ns}"""
    return {int(loop): int(ns) for loop, ns in re.findall(r'^worst (\d+) (\d+)', report, re.M)}


class Cases(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.costs = measured_costs()
        cls.simulated, cls.on_metal = simulated(HERE / 'cases', board_file(cls.costs)), on_metal(HERE / 'cases')

    def test_every_loop_keeps_its_periods_in_both(self):
        for status, report in self.simulated, self.on_metal:
            self.assertEqual(status, 0, report)
            self.assertEqual(set(worst(report)), set(range(1, LOOPS + 1)), report)
            self.assertIn('every period was kept', report)

    def test_the_simulator_says_each_worst_response(self):
        expected, measured = worst(self.simulated[1]), worst(self.on_metal[1])
        print(*(f'loop {loop}: {ns / 1000:.1f} us on the kernel, {expected[loop] / 1000:.1f} simulated' for loop, ns in measured.items()), sep='\n')
        for loop, ns in measured.items():
            with self.subTest(loop=loop):
                self.assertLess(abs(expected[loop] - ns), 0.1 * ns, f'{expected[loop]} simulated, {ns} on the kernel')

    def test_the_costs_that_are_kept_are_this_kernels(self):
        kept = tomllib.loads(COSTS.read_text())['sim']['costs']
        self.assertEqual(set(kept), set(self.costs))
        for call, ns in self.costs.items():
            with self.subTest(call=call):
                self.assertLess(abs(int(kept[call].removesuffix(' ns')) - ns), 0.05 * ns, f'{kept[call]} kept, {ns} ns measured')


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
