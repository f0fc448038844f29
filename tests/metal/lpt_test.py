"""The parallel port as pins (pins=lpt). QEMU's own trace of its parallel port tells each access: the port's registers, and their values.
What they mean at the connector stands in this file a second time (IEEE 1284-1994, annex C).

  lpt_test.py QDUINO [Class.test]"""
import pathlib
import re
import subprocess
import unittest

from runs import CACHE, ENVIRONMENT, HERE, ROOT, main, metal

DATA, STATUS, CONTROL = 0, 1, 2
LINES = {pin: (DATA, pin - 2, False) for pin in range(2, 10)} | {
    1: (CONTROL, 0, True), 14: (CONTROL, 1, True), 16: (CONTROL, 2, False), 17: (CONTROL, 3, True),
    15: (STATUS, 3, False), 13: (STATUS, 4, False), 12: (STATUS, 5, False), 10: (STATUS, 6, False), 11: (STATUS, 7, True)}
OUTPUTS = [pin for pin, (register, _, _) in sorted(LINES.items()) if register != STATUS]


def levels(registers):
    """{pin: level} of the connector."""
    return {pin: registers[at] >> bit & 1 ^ inverted for pin, (at, bit, inverted) in LINES.items() if at in registers}


class Port:
    """One boot of a sketch on a machine that has a parallel port, or none."""

    def __init__(self, sketch, words, present=True):
        built = subprocess.run(metal('build', sketch), capture_output=True, text=True, timeout=200, check=True, env=ENVIRONMENT)
        trace = pathlib.Path(CACHE) / 'trace'
        command = ['qemu-system-x86_64', '-machine', 'q35', '-cpu', 'max', '-m', '128', '-smp', '2', '-display', 'none', '-nodefaults', '-no-reboot',
                   '-icount', 'shift=4,sleep=off', '-kernel', built.stdout.strip(), '-append', words, '-serial', 'stdio',
                   '-chardev', 'file,id=report,path=/dev/stderr', '-device', 'isa-debugcon,iobase=0xe9,chardev=report',
                   '-device', 'isa-debug-exit,iobase=0xf4,iosize=0x01', '-trace', 'parallel_ioport_*', '-D', str(trace)]
        if present:
            command += ['-chardev', 'null,id=printer', '-device', 'isa-parallel,chardev=printer']
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, timeout=200, check=False)
        self.status, self.serial, self.report = done.returncode // 2, done.stdout.decode(), done.stderr.decode()
        lines = trace.read_text() if trace.exists() else ''
        self.accesses = [(kind, int(at, 16) & 7, int(value, 16)) for kind, at, value in
                         re.findall(r'parallel_ioport_(read|write) .*?addr (0x[0-9a-f]+) val (0x[0-9a-f]+)', lines)]

    def states(self):
        """The levels at the connector after each write, from the board's first two on, which make them low. Before that the firmware looks for a
        port, with patterns."""
        writes = [(at, value) for kind, at, value in self.accesses if kind == 'write']
        begin = next(i for i in range(len(writes) - 1) if {at for at, _ in writes[i:i + 2]} == {DATA, CONTROL} and
                     set(levels(dict(writes[i:i + 2])).values()) == {0})
        registers, states = dict(writes[begin:begin + 2]), []
        for at, value in writes[begin:]:
            registers[at] = value
            states.append(levels(registers))
        return states

    def changes(self):
        """[(pin, level)]: of one write at most one pin changes."""
        states = self.states()
        changed = [{pin: after[pin] for pin in after if after[pin] != before[pin]} for before, after in zip(states, states[1:])]
        assert all(len(change) <= 1 for change in changed), changed
        return [next(iter(change.items())) for change in changed if change]


class Lpt(unittest.TestCase):
    def test_each_pin_of_the_connector(self):
        run = Port(HERE / 'lpt', 'for=0.1 pins=lpt')
        self.assertEqual(run.status, 0, run.report)
        self.assertEqual(run.changes(), [(pin, 1) for pin in OUTPUTS] + [(pin, 0) for pin in OUTPUTS] + [(9, 1)])
        status = next(value for kind, at, value in run.accesses if (kind, at) == ('read', STATUS))
        said = {int(pin): int(level) for pin, level in re.findall(r'(\d+)=(\d)', run.serial)}
        self.assertEqual(said, levels({STATUS: status}))
        for words in ('a parallel port has pins 1 to 17', 'pin 10 of a parallel port is an input', "real pins have levels alone"):
            self.assertIn(words, ' '.join((run.report + run.serial).split()))

    def test_a_pulse_train(self):
        run = Port(ROOT / 'sketches/pulse_train', 'for=0.1 pins=lpt')
        self.assertEqual(run.status, 0, run.report)
        pulses = len(run.changes()) // 2
        self.assertEqual(run.changes(), [(6, 1), (6, 0)] * pulses)
        self.assertGreater(pulses, 900)
        self.assertLess(pulses, 1000)

    def test_what_is_not_there_is_refused(self):
        for words, present, said in (('pins=lpt', False, 'no parallel port answers at 0x378'), ('pins=gold', True, 'pins=gold: this board knows'),
                                     ('pins=baytrail', True, 'this is no Bay Trail'), ('pins=apollolake-nw', True, 'this is no Apollo Lake')):
            run = Port(ROOT / 'sketches/pulse_train', f'for=0.1 {words}', present)
            self.assertEqual(run.status, 1, run.report)
            self.assertIn(said, run.report)


if __name__ == '__main__':
    main(qemu_system_x86_64='qemu-system-x86')
