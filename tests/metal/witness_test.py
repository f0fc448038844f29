"""The witness of what the board promises: Bochs, in which one instruction of each core is one tick, and which logs every write to a pin
with its tick, outside of the machine. It boots by a BIOS, and its processor has x2APIC and TSC deadline.

  idle     sketches/pulse_train: core 0 has nothing to do
  storm    tests/metal/storm: core 0 is full, and a network card interrupts it without end
  mutants  of the storm: each breaks what it should, and nothing else

  witness_test.py QDUINO [Class.test]"""
import functools
import pathlib
import re
import subprocess
import unittest

from runs import CACHE, ENVIRONMENT, HERE, ROOT, changed, main, metal

IDLE, STORM = ROOT / 'sketches/pulse_train', HERE / 'storm'
SECONDS = '0.5'
STORMS = {20: 500, 100: 2400}  # so many interrupts in that time, by millions of instructions a second


class Seen:
    """One run. Times are in ticks."""

    def __init__(self, sketch, seconds, mips, *options):
        dump = pathlib.Path(CACHE) / 'dump'
        done = subprocess.run(metal('run', sketch, '--witness', 'bochs', '--for', seconds, '--mips', mips, '--vcd', dump, *options),
                              stdin=subprocess.DEVNULL, capture_output=True, timeout=600, check=False, env=ENVIRONMENT)
        self.status = done.returncode
        self.report = done.stdout.decode(errors='replace')
        self.table = done.stderr.decode(errors='replace')
        self.dump = dump.read_text() if dump.exists() else ''
        self.tick_ns = 1000 // mips

    @functools.cached_property
    def changes(self):
        """{pin: [(tick, level)]}"""
        pins, now = {}, 0
        for line in self.dump.splitlines():
            if line[0] == '#':
                now = int(line[1:]) // self.tick_ns
            elif found := re.fullmatch(r'([01])p(\d+)', line):
                pins.setdefault(int(found[2]), []).append((now, int(found[1])))
        return pins

    def rises(self, pin):
        return [tick for tick, level in self.changes[pin] if level == 1]

    def periods(self):
        """Of the pulse train, from the second pulse on."""
        rises = self.rises(6)
        return [later - earlier for earlier, later in zip(rises[1:], rises[2:])]

    def widths(self):
        return [down - up for up, down in zip(self.rises(6)[1:], [tick for tick, level in self.changes[6] if level == 0][2:])]

    def came_to(self, core):
        """(timer, devices): interrupts while the loops ran, from the report at the end."""
        found = re.search(r'timer (\d+), devices (\d+)', self.report.rsplit(f'  core {core}:', 1)[1])
        return int(found[1]), int(found[2])

    def overruns(self, loop):
        return int(re.search(rf'^ +{loop} +\d+ +\d+ +(\d+) ', self.report.split('overruns dropped')[1], re.M)[1])


@functools.cache
def seen(sketch, seconds, mips, *options):
    return Seen(sketch, seconds, mips, *options)


def span(values):
    return max(values) - min(values)


def keeps_budget(run, pin, ms):
    """`ms` of each 100: the loop at `pin` always wants more, and computes the same between two rises. So the CPU that it has had is as often
    the shortest period as there are rises. A budget came at the beginning, and every 100 ms since; a fifth of it may go into switches."""
    rises = run.rises(pin)
    if len(rises) < 2:
        return False
    had = len(rises) * min(later - earlier for earlier, later in zip(rises, rises[1:]))
    ticks = 1_000_000 // run.tick_ns  # of a millisecond
    lasted = run.rises(6)[-1] - run.rises(6)[0]
    budgets = lasted // (100 * ticks)
    return 0.75 * budgets * ms * ticks < had < 1.01 * (budgets + 1) * ms * ticks


def broken(run, idle):
    """The promises that a run of the storm has broken."""
    kept = {
        'period and width': span(run.periods()) <= 10 and span(run.widths()) <= 10,
        'as when idle': max(run.periods()) <= max(idle.periods()) + 5 and max(run.widths()) <= max(idle.widths()) + 5,
        'core 1 untouched': run.came_to(1) == (0, 0),
        'budgets': keeps_budget(run, 2, 20) and keeps_budget(run, 3, 10),
        'releases of loop 4': run.overruns(4) == 0,
    }
    return {promise for promise, is_kept in kept.items() if not is_kept}


class Witness(unittest.TestCase):
    def ended(self, *run):
        result = seen(*run)
        self.assertEqual(result.status, 0, result.report + result.table)
        self.assertIn('x2APIC, TSC deadline', result.report)
        return result

    def idle(self, mips=20):
        return self.ended(IDLE, '0.3', mips)

    def storm(self, mips=20):
        return self.ended(STORM, SECONDS, mips)

    def test_every_pulse_is_as_long_as_the_others(self):
        for mips in 20, 100:
            with self.subTest(mips=mips):
                idle = self.idle(mips)
                self.assertGreater(len(idle.periods()), 3000)
                self.assertLessEqual(span(idle.periods()), 10)
                self.assertLessEqual(span(idle.widths()), 10)
                self.assertEqual(idle.came_to(1), (0, 0))

    def test_two_runs_are_the_same_to_the_tick(self):
        again = Seen(IDLE, '0.3', 20)
        self.assertEqual(again.dump, self.idle().dump)
        self.assertEqual(again.report, self.idle().report)

    def test_four_cores(self):
        run = self.ended(IDLE, '0.1', 20, '--cores', '4')
        self.assertIn('  core 3: ', run.report)
        self.assertLessEqual(span(run.periods()), 10)

    def test_a_storm_on_core_0_does_not_reach_core_1(self):
        for mips in 20, 100:
            with self.subTest(mips=mips):
                run = self.storm(mips)
                self.assertGreater(run.came_to(0)[1], STORMS[mips], run.report)
                self.assertEqual(broken(run, self.idle(mips)), set(), run.report)

    def test_a_storm_is_the_same_to_the_tick(self):
        again = Seen(STORM, SECONDS, 20)
        self.assertEqual((again.dump, again.report), (self.storm().dump, self.storm().report))

    def mutant_breaks(self, name, promises, *changes):
        run = self.ended(changed(STORM, name, *changes), SECONDS, 20)
        self.assertEqual(broken(run, self.idle()), promises, run.report)

    def test_interrupts_that_are_routed_to_core_1_are_seen_there(self):
        self.mutant_breaks('routed', {'period and width', 'as when idle', 'core 1 untouched'},
                           ('  noInterrupts(ALL, 1);\n', '  noInterrupts(NIC, 0);\n'))

    def test_budgets_need_the_alarm(self):
        """Without a card: each of its interrupts would be a look at the budgets, too."""
        self.mutant_breaks('no_alarm', {'budgets'},
                           ('#include "network_card.h"', '#include "board/metal/core/kernel.h"'), ('storm::NetworkCard card;\n', ''),
                           ('  if (!card.open()) Serial.println("no network card");\n', '  qduino::board::metal::cores[0].allow_alarms(false);\n'),
                           ('  if (card.answers() == 0) card.ask();\n', ''))


if __name__ == '__main__':
    main(when_asked=True, bochs='bochs bochs-term bochsbios vgabios', grub_mkimage='grub-common', xorriso='grub-pc-bin xorriso')
