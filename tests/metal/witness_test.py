"""The witness of what the board promises: Bochs, in which one instruction of each core is one tick, and which logs every write to a pin
with its tick, outside of the machine. It boots by a BIOS, and its processor has x2APIC and TSC deadline.

  idle     sketches/pulse_train: core 0 has nothing to do
  storm    tests/metal/storm: core 0 is full, and a network card interrupts it without end
  mutants  of the storm: each breaks what it should, and nothing else

  witness_test.py QDUINO [Class.test]"""
import functools
import itertools
import pathlib
import re
import subprocess
import unittest

from runs import CACHE, ENVIRONMENT, HERE, ROOT, changed, main, metal

IDLE, STORM, BLINK = ROOT / 'sketches/pulse_train', HERE / 'storm', ROOT / 'sketches/blink'
SECONDS = {20: '2.5', 100: '0.8'}  # of a storm, by millions of instructions a second: long enough for …
STORM_INTERRUPTS = range(2400, 10001)  # … so many of them


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
        self.mips = mips  # ticks of a microsecond

    @functools.cached_property
    def changes(self):
        """{pin: [(tick, level)]}"""
        pins, now = {}, 0
        for line in self.dump.splitlines():
            if line[0] == '#':
                now = int(line[1:]) * self.mips // 1000
            elif found := re.fullmatch(r'([01])p(\d+)', line):
                pins.setdefault(int(found[2]), []).append((now, int(found[1])))
        return pins

    def rises(self, pin):
        return [tick for tick, level in self.changes[pin] if level == 1]

    def periods(self):
        """The periods of the pulse train, from the second pulse on."""
        rises = self.rises(6)
        return [later - earlier for earlier, later in zip(rises[1:], rises[2:])]

    def widths(self):
        return [down - up for up, down in zip(self.rises(6)[1:], [tick for tick, level in self.changes[6] if level == 0][2:])]

    def came_to(self, core):
        """(timer, devices): interrupts while the loops ran, from the report at the end."""
        found = re.search(r'timer (\d+), devices (\d+)', self.report.rsplit(f'  core {core}:', 1)[1])
        return int(found[1]), int(found[2])

    def calls_to(self, core):
        """How often other cores have called it, and it itself."""
        return int(re.search(r'calls of cores (\d+)', self.report.rsplit(f'  core {core}:', 1)[1])[1])

    def row(self, loop):
        """The report's at the end: the counts, and then the latencies."""
        return re.search(rf'^ +{loop} +\d+ .*$', self.report.split('overruns dropped')[1], re.M)[0].split()

    def overruns(self, loop):
        return int(self.row(loop)[3])

    def latest_us(self, loop):
        """The latest begin of a release."""
        number, unit = self.row(loop)[-2:]
        return float(number) * {'ns': 1e-3, 'us': 1, 'ms': 1e3}[unit]


@functools.cache
def seen(sketch, seconds, mips, *options):
    return Seen(sketch, seconds, mips, *options)


def span(values):
    return max(values) - min(values)


LOOPS = {2: (4, 100), 3: (2, 100), 4: (0.8, 10)}  # of the storm: budget and period in ms; 2 and 3 always want more
CARD = (2, 10)  # its I/O VCPU


def late_us(run):
    """How late a budget may end: by 100 instructions, and 200 at 20 MIPS, where the clock's ticks are longer. In a storm a top half may be under
    way just then, with interrupts off: a way into the kernel, the card's registers, and the way out, 170 instructions each way."""
    instructions = (100 if run.mips == 100 else 200) + (2 * 170 if run.came_to(0)[1] > 1000 else 0)
    return instructions / run.mips


def had(run, pin):
    """[(us, CPU time in us until then)] of the loop at `pin`, by the witness: a pulse needs the same instructions whatever comes between, so
    one that took longer counts as one of the others."""
    rises = run.rises(pin)
    gaps = [later - earlier for earlier, later in zip(rises, rises[1:])]
    longest = 4 * min(gaps)  # between two passes of the loop
    whole = [gap for gap in gaps if gap < longest]
    pulse = sum(whole) / len(whole)
    sums = itertools.accumulate(gap if gap < longest else pulse for gap in gaps)
    return [((rise - rises[0]) / run.mips, ticks / run.mips) for rise, ticks in zip(rises[1:], sums)]


def keeps_budget(run, pin, switches_us):
    """In each whole period a loop that always wants more has its budget: no more than that and what its end may be late, and no less than that
    without the ways into the kernel and out of it. The periods are counted from when the pulse train began, up to its end. The core begins later,
    in the middle of one, so that one and the next are not looked at."""
    if len(run.rises(pin)) < 2:
        return False
    budget, period = (1000 * ms for ms in LOOPS[pin])
    end = (run.rises(6)[-1] - run.rises(pin)[0]) / run.mips
    times = [(time, cpu) for time, cpu in had(run, pin) if time < end]
    origin = (run.rises(6)[0] - run.rises(pin)[0]) / run.mips - 200  # when neither of them has budget
    taken = [max((cpu for time, cpu in times if time < origin + number * period), default=0)
             for number in range(1, int((times[-1][0] - origin) // period) + 1)]
    whole = [later - earlier for earlier, later in zip(taken[1:], taken[2:])]
    pulse = times[0][1]
    return len(whole) > 0 and all(budget - switches_us - pulse <= had <= budget + late_us(run) + pulse for had in whole)


def charged(run):
    """(us since the loops began, {VCPU: us}): the board's own accounts."""
    words = ' '.join(run.report.rsplit('Charged in ', 1)[1].split())
    return float(words.split()[0]), {int(vcpu): float(us) for vcpu, us in re.findall(r'(\d+) had ([\d.]+) us', words)}


def keeps_accounts(run):
    found = re.search(r'ends of budgets (\d+), at most (\d+) ns late', ' '.join(run.report.split()))
    ends, late_ns = map(int, found.groups()) if found else (0, 0)
    since, used = charged(run)
    return ends > 0 and late_ns <= 1000 * late_us(run) and all(
        used[loop] <= 1000 * budget * (since // (1000 * period) + 1) + ends * late_us(run) for loop, (budget, period) in LOOPS.items())


def keeps_bottom_half(run):
    """U t + U T, by the accounts; and by the witness, who sees most of it."""
    since, used = charged(run)
    budget, period = CARD
    most = budget / period * since + 1000 * budget
    first, last = run.rises(6)[0], run.rises(6)[-1]  # before and after the loops it is in no budget
    highs = [later - earlier for (earlier, up), (later, _) in zip(run.changes[5], run.changes[5][1:]) if up == 1 and first < earlier < last]
    usual = sorted(highs)[len(highs) // 2] if highs else 0  # one that its budget's end cut in two lasts longer, and takes as much
    seen_us = sum(min(high, 2 * usual) for high in highs) / run.mips
    return used.get(33, 0) <= most and seen_us <= most


def broken(run, idle):
    """The promises that a run of the storm has broken."""
    kept = {
        'period and width': span(run.periods()) <= 10 and span(run.widths()) <= 10,
        'as when idle': max(run.periods()) <= max(idle.periods()) + 5 and max(run.widths()) <= max(idle.widths()) + 5,
        'core 1 untouched': run.came_to(1) == (0, 0) and run.calls_to(1) <= 2,  # to begin, and to end
        'budgets': all(keeps_budget(run, pin, LOOPS[pin][0] * 5000 / run.mips) for pin in (2, 3)),
        'accounts': keeps_accounts(run),
        'bottom half': keeps_bottom_half(run),
        'releases of loop 4': run.overruns(4) == 0 and (run.mips < 100 or run.latest_us(4) <= 50),
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
        return self.ended(STORM, SECONDS[mips], mips)

    def test_every_pulse_is_as_long_as_the_others(self):
        for mips in 20, 100:
            with self.subTest(mips=mips):
                idle = self.idle(mips)
                self.assertGreater(len(idle.periods()), 2700)
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
                self.assertIn(run.came_to(0)[1], STORM_INTERRUPTS, run.report)
                self.assertEqual(broken(run, self.idle(mips)), set(), run.report)

    def test_a_slow_machine_runs_for_minutes(self):
        # A decision of the scheduler takes a millisecond there.
        run = self.ended(BLINK, '150', 1)
        self.assertEqual(len(run.rises(13)), 75)

    def test_a_storm_is_the_same_to_the_tick(self):
        again = Seen(STORM, SECONDS[20], 20)
        self.assertEqual((again.dump, again.report), (self.storm().dump, self.storm().report))

    def mutant_breaks(self, name, promises, *changes):
        run = self.ended(changed(STORM, name, *changes), SECONDS[20], 20)
        self.assertEqual(broken(run, self.idle()), promises, run.report)

    def test_interrupts_that_are_routed_to_core_1_are_seen_there(self):
        self.mutant_breaks('routed', {'period and width', 'as when idle', 'core 1 untouched'},
                           ('  noInterrupts(ALL, 1);\n', '  noInterrupts(NIC, 0);\n'))

    # Without a card: each of its interrupts would be a look at the budgets, too.
    QUIET = (('  if (!asker.open()) Serial.println("no network card");\n', ''), ('  asker.begin();\n', ''))

    def test_budgets_are_exact(self):
        run = self.ended(changed(STORM, 'quiet', *self.QUIET), '0.4', 100)
        for pin in 2, 3:
            self.assertTrue(keeps_budget(run, pin, 10), had(run, pin)[-1])
        self.assertTrue(keeps_accounts(run), run.report)

    def test_a_budget_counts_from_the_first_period_on(self):
        """The reports before the first take the serial line's time. Nobody else wants core 0, so each run of pulses is a budget in one piece."""
        folder = pathlib.Path(CACHE) / 'first'
        folder.mkdir()
        (folder / 'first.ino').write_text('void setup() { pinMode(6, OUTPUT); }\nvoid loop(1, 60, 100, 0) { digitalWrite(6, HIGH); digitalWrite(6, LOW); }\n')
        run = Seen(folder, '0.45', 20)
        self.assertEqual(run.status, 0, run.report + run.table)
        rises = run.rises(6)
        pauses = [at for at, (before, after) in enumerate(zip(rises, rises[1:]), 1) if after - before > 1000 * run.mips]
        pieces = [(rises[end - 1] - rises[begin]) / run.mips for begin, end in itertools.pairwise([0, *pauses])]
        self.assertGreaterEqual(len(pieces), 4)
        for piece in pieces:
            self.assertLessEqual(piece, 60_000 + late_us(run))
            self.assertGreater(piece, 59_000)

    def test_budgets_need_the_alarm(self):
        self.mutant_breaks('no_alarm', {'budgets', 'accounts'}, *self.QUIET, ('#include "asker.h"', '#include "asker.h"\n#include "board/metal/core/kernel.h"'),
                           ('  interruptsVcpu', '  qduino::board::metal::cores[0].allow_alarms(false);\n  interruptsVcpu'))


if __name__ == '__main__':
    main(when_asked=True, bochs='bochs bochs-term bochsbios vgabios', grub_mkimage='grub-common', xorriso='grub-pc-bin xorriso')
