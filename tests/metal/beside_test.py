"""A core that Linux gives up: Debian's kernel boots in QEMU with two cores, and `qduino metal beside` runs a sketch's image on the second.

The witness is outside of the machine: its memory is a file, which this program maps. So it sees the board also when Linux has crashed.
The printer's image prints there what printd on Linux feeds it, and a virtual machine, on Linux too, plays what is wired to its pins.
What is about times runs with counted time, which makes a run repeatable, whatever else this computer does.

  beside_test.py QDUINO [Class.test]"""
import mmap
import pathlib
import struct
import subprocess
import sys
import tempfile
import time
import unittest

from runs import CACHE, ENVIRONMENT, HERE, QDUINO, ROOT, main, metal

sys.path.insert(0, str(ROOT / 'tests/emulated'))
from emulator import Machine  # noqa: E402
from initramfs import shell_system  # noqa: E402
from kernels import NotToBeHad, kernel  # noqa: E402

MEGABYTES = 640
KEPT_AT = 0x10000000
BOOT_LINE = 'memmap=184M$0x10000000 memmap=4K$0x90000 iomem=relaxed nox2apic'
# Else Linux looks, while it boots, whether the timer interrupts within ten of its periods, and
# panics where this computer is too busy for that.
EMULATED = 'no_timer_check'
COUNTED_TIME = ['-icount', 'shift=4,sleep=off']
PINS_AT = 48 << 20  # of what both share; tests/unit/beside/beside_layout_test.cpp holds these numbers
OUTPUTS_AT, OUTPUT_BYTES, LOST_OF_LOOP_1 = 256, 12, 40704 + 64 + 8
RING_OF_HOST, RING_OF_LOOP_1, RING_SLOTS_AT, RING_SLOTS = 196608, 2359296, 256, 1 << 17
RING_OF_LOOP_2, RING_OF_LOOP_3 = (RING_OF_LOOP_1 + loop * (RING_OF_LOOP_1 - RING_OF_HOST) for loop in (1, 2))
PINS_FILE = f'/dev/mem@{KEPT_AT + PINS_AT}'
LINK_AT, LINK_BYTES = 182 << 20, 2 << 20
STEP_PINS = {2: 'X', 6: 'Y', 10: 'Z', 14: 'E'}  # the pin of its direction is the next one
HEATER = 17
EVENT_OF_LEVEL, EVENT_OF_DUTY = 1, 2
RUNS, ENDED = 2, 3
ENDED_BY_SILENCE = 3
LIMIT_S = 600
BELL_AT = 0x90fff  # the last byte of the trampoline's page: this test rings, and Linux goes on
# `begin`: the sketch runs in the background, and is ready. `heard N`: waits for the bell.
PRELUDE = f"""export PATH=/bin:/usr/bin
online() {{ cat /sys/devices/system/cpu/online; }}
beside() {{ qduino metal beside /image "$@"; echo "ended with $?"; }}
begin() {{ qduino metal beside /image "$@" >/run/said 2>&1 & until grep -q 'sketch: ready' /run/said; do sleep 0.1; done; }}
heard() {{ until [ "$(dd if=/dev/mem bs=1 skip={BELL_AT} count=1 2>/dev/null)" = $1 ]; do sleep 0.1; done; }}
"""
# A part is printed; printd is killed and started again on the way; Linux crashes at the end.
PRINTER = f"""export PATH=$PATH:/sbin:{pathlib.Path(QDUINO).parent}
ip link set lo up
virtual-machine --own-clock --fifo 0 --pins {PINS_FILE} >/run/machine 2>&1 &
serve() {{ printd --state /run/state --link /run/link --no-auth --no-confirm-bed >>/run/printd 2>&1 & service=$!; }}
jobs() {{ curl -s "$@" http://127.0.0.1:8080/api/v1/jobs; }}
sleep 1
qduino metal beside /printer --silence 3000 --link /run/link >/run/said 2>&1 & board=$!
runs() {{ kill -0 $board 2>/dev/null || {{ cat /run/said; echo "the board has ended"; echo o > /proc/sysrq-trigger; sleep 60; }}; }}
until grep -q 'beside Linux' /run/said; do runs; sleep 0.2; done
serve
until answer=$(jobs -F print=true -F file=@/part.gcode); echo "$answer" | grep -q sha256; do
  runs; [ "$answer" = "$before" ] || echo "no: $answer"; before=$answer; sleep 0.5
done
echo uploaded; heard 1
kill -9 $service; echo killed; heard 2
serve
until jobs | grep -q '"state":"done"'; do sleep 0.5; done
echo "is done"; heard 3; echo c > /proc/sysrq-trigger
"""
PART = (b'G21\nG90\nG28\nM104 S45\nG1 X20 Y20 Z0.3 F6000\nG4 P800\n' + b'G1 X24 F3000\nG1 Y24\nG2 X20 Y20 I-4 J0\n' * 12 + b'M84\n')


class Shared:
    """What Linux and the board share (board/window/beside_layout.h), from outside of the machine."""

    def __init__(self, memory):
        self.memory = memory

    def word(self, offset, form='<Q'):
        return struct.unpack_from(form, self.memory, KEPT_AT + offset)[0]

    def board(self):
        """(beats, its clock, its state, its status)."""
        return self.word(512), self.word(520), self.word(528, '<I'), self.word(532, '<I')

    def silence(self):
        """When the board saw the last heartbeat, and when its safe levels had been driven."""
        return self.word(536), self.word(544)

    def edges(self):
        """That loop 1 has written, with those that found their ring full."""
        return self.word(PINS_AT + RING_OF_LOOP_1) + self.word(PINS_AT + LOST_OF_LOOP_1)

    def events(self, ring):
        """(time, pin, level) of the last thousand edges that a VCPU has written: they stay in its ring when they have been read."""
        pushed = self.word(PINS_AT + ring)
        for number in range(max(0, pushed - 1000), pushed):
            at = KEPT_AT + PINS_AT + ring + RING_SLOTS_AT + 16 * (number % RING_SLOTS)
            time_ns, pin, _, level = struct.unpack_from('<qHBB', self.memory, at)
            yield time_ns, pin, level

    def duties(self, ring, pin):
        """[(time, duty)]: those that a VCPU has given a pin, as far as its ring goes back."""
        pushed = self.word(PINS_AT + ring)
        slots = (struct.unpack_from('<qHBBf', self.memory, KEPT_AT + PINS_AT + ring + RING_SLOTS_AT + 16 * (number % RING_SLOTS))
                 for number in range(max(0, pushed - RING_SLOTS), pushed))
        return [(time_ns, duty) for time_ns, of, kind, _, duty in slots if (of, kind) == (pin, EVENT_OF_DUTY)]

    def latch(self, pin):
        return self.memory[KEPT_AT + PINS_AT + OUTPUTS_AT + OUTPUT_BYTES * pin + 1]


class Beside(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        built = subprocess.run(metal('build', HERE / 'beside'), capture_output=True, timeout=200, check=True, env=ENVIRONMENT)
        cls.image = pathlib.Path(built.stdout.decode().strip()).read_bytes()
        cls.qduino = pathlib.Path(CACHE) / 'stripped'
        subprocess.run(['strip', '-o', cls.qduino, QDUINO], check=True)
        cls.kernel = next(kernel('amd64', pathlib.Path.home() / '.cache/qduinomc/emulated').glob('vmlinuz-*'))

    def boot(self, script, *options, words='', boot_line=BOOT_LINE, programs=(), files=None):
        """Linux carries out `script`, where `beside` runs the sketch's image. `programs` of this computer and `files` are there besides."""
        folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix='qduino-beside-', dir='/dev/shm')))
        shell_system(folder / 'initramfs', PRELUDE + script, [QDUINO, '/bin/grep', '/bin/dd', '/usr/bin/taskset', '/usr/bin/sha256sum', *programs],
                     {'bin/qduino': self.qduino.read_bytes(), 'image': self.image, 'damaged': self.image[:5000], **(files or {})})
        memory = folder / 'memory'
        command = ['qemu-system-x86_64', '-machine', 'q35,memory-backend=ram', '-cpu', 'max', '-smp', '2', '-m', str(MEGABYTES), '-object',
                   f'memory-backend-file,id=ram,size={MEGABYTES}M,share=on,mem-path={memory}', '-kernel', str(self.kernel), '-initrd',
                   str(folder / 'initramfs'), '-append', f'quiet loglevel=3 console=ttyS0 tsc=reliable {EMULATED} {boot_line} {words}', *options]
        self.machine = self.enterContext(Machine(command, folder, LIMIT_S))
        with open(memory, 'r+b') as file:
            self.memory = self.enterContext(mmap.mmap(file.fileno(), MEGABYTES << 20))
            self.shared = Shared(self.memory)
        return self.machine

    def run(self, result=None):
        faults = len(result.failures) + len(result.errors)
        super().run(result)
        if len(result.failures) + len(result.errors) > faults and hasattr(self, 'machine'):
            print(*self.machine.console[-60:], sep='\n  | ', flush=True)

    def wait_for(self, condition):
        """Its value, once it is true."""
        while not (value := condition()):
            if time.monotonic() > self.machine.deadline or self.machine.process.poll() is not None:
                self.fail('\n'.join(['what is waited for does not come', *self.machine.console[-40:]]))
            time.sleep(0.02)
        return value

    def ring(self, number):
        self.memory[BELL_AT] = ord(str(number))

    def assert_runs_on(self):
        """The board's clock goes on for half a second, and pulses come meanwhile."""
        begin, edges = self.shared.board()[1], self.shared.edges()
        self.wait_for(lambda: self.shared.board()[1] > begin + 500_000_000)
        self.assertEqual(self.shared.board()[2], RUNS)
        self.assertGreater(self.shared.edges(), edges + 100)

    # ---- the core is given, and taken back

    def test_taken_back_ten_times(self):
        machine = self.boot('for i in 1 2 3 4 5 6 7 8 9 10; do beside --for 0.1 --silence 0; online; taskset -c 1 cat /proc/self/stat; done')
        for _ in range(10):
            machine.expect('sketch: ready')
            self.assertGreater(int(machine.expect(r'^  6 +\d+ +(\d+)  low')[1]), 0)
            machine.expect('Linux has its core back')
            self.assertEqual(machine.expect(r'ended with (\d+)')[1], '0')
            self.assertEqual(machine.expect(r'^(\d\S*)$')[1], '0-1')
            task = machine.expect(r'^\d+ \(cat\) (.*)$')[1].split()
            self.assertEqual(task[36], '1', 'the core that it runs on: field 39 of proc_pid_stat(5)')
        machine.wait_until_off()

    def test_the_core_comes_back_whatever_fails(self):
        script = (
            'qduino metal beside /damaged; echo "ended with $?"; online; beside --core 7; online\n'
            'begin --silence 0; kill -TERM $!; wait $!; echo "ended with $?"; online')
        machine = self.boot(script)
        machine.expect('this is no image that starts beside Linux')
        self.assertEqual(machine.expect(r'ended with (\d+)')[1], '1')
        self.assertEqual(machine.expect(r'^(\d\S*)$')[1], '0-1')
        machine.expect('Linux does not give core 7 up')
        self.assertEqual(machine.expect(r'^(\d\S*)$')[1], '0-1')
        self.assertEqual(machine.expect(r'ended with (\d+)')[1], '0')
        self.assertEqual(self.shared.board()[2], ENDED)
        self.assertEqual(machine.expect(r'^(\d\S*)$')[1], '0-1')
        machine.wait_until_off()

    def test_a_boot_line_that_lacks_words_is_refused(self):
        machine = self.boot('beside; online', boot_line='memmap=4K$0x90000 nox2apic')
        machine.expect('ended with 1')
        self.assertEqual(machine.expect(r'^(\d\S*)$')[1], '0-1')
        machine.wait_until_off()
        said = ' '.join(line.strip() for line in machine.console)
        self.assertRegex(said, r'lacks: memmap=184M\$0x10000000 iomem=relaxed\.')

    # ---- Linux is loaded, crashes, kills

    def test_pulses_go_on_while_linux_is_full_and_kills_everything(self):
        machine = self.boot('''
begin --silence 0
for i in 1 2 3 4 5 6; do while :; do sha256sum /bin/qduino; done >/dev/null & done
echo "is full"; heard 1
kill -9 -1
echo "is killed"; heard 2
echo 1 > /sys/devices/system/cpu/cpu1/online; online; taskset -c 1 cat /proc/self/stat
''')
        machine.expect('^is full')
        self.wait_for(lambda: self.shared.board()[2] == RUNS)
        self.assert_runs_on()
        self.ring(1)
        machine.expect('^is killed')
        self.assert_runs_on()
        self.ring(2)
        self.assertEqual(machine.expect(r'^(\d\S*)$')[1], '0-1')
        self.assertEqual(machine.expect(r'^\d+ \(cat\) (.*)$')[1].split()[36], '1')
        beats = self.shared.board()[0]
        machine.wait_until_off()
        self.assertEqual(self.shared.board()[0], beats, 'the board went on when Linux had its core back')

    def test_pulses_go_on_after_a_crash(self):
        machine = self.boot('begin --silence 0; echo running; heard 1; echo c > /proc/sysrq-trigger')
        machine.expect('^running')
        self.wait_for(lambda: self.shared.board()[2] == RUNS)
        self.ring(1)
        machine.expect('Kernel panic')
        machine.expect('end Kernel panic')
        self.assert_runs_on()

    # ---- heartbeat

    def assert_made_safe(self):
        self.wait_for(lambda: self.shared.board()[2] == ENDED)
        self.assertEqual(self.shared.board()[3], ENDED_BY_SILENCE)
        self.assertEqual([self.shared.latch(pin) for pin in (7, 8, 9)], [0, 1, 1], 'two safe levels, and a pin without one')
        seen, safe = self.shared.silence()
        self.assertGreater(safe - seen, 5_000_000)
        # A look came up to 1 ms after the last heartbeat.
        self.assertLess(safe - seen + 1_000_000, 10_000_000)
        first_safe = next(time_ns for time_ns, pin, level in self.shared.events(RING_OF_HOST) if time_ns > seen and (pin, level) == (7, 0))
        self.assertLessEqual(first_safe, safe, 'the edge bears its own time')
        later = [(pin, level) for time_ns, pin, level in self.shared.events(RING_OF_LOOP_1) if time_ns > safe]
        self.assertLessEqual(len(later), 1, 'one that was under way; the next look makes it safe again')

    def begin_with_heartbeat(self, end):
        """The sketch runs for a while, then Linux does `end`."""
        machine = self.boot('echo 1 > /sys/devices/system/cpu/cpu1/online\nbegin --silence 5\necho running; heard 1; echo ending\n' + end,
                            *COUNTED_TIME, words='maxcpus=1')
        machine.expect('^running')
        self.wait_for(lambda: self.shared.board()[2] == RUNS)
        self.assertEqual([self.shared.latch(pin) for pin in (7, 8, 9)], [1, 0, 1])
        self.ring(1)
        machine.expect('^ending')
        return machine

    def test_a_keeper_that_is_killed_makes_the_pins_safe(self):
        machine = self.begin_with_heartbeat('kill -9 $!; sleep 1; online; echo 1 > /sys/devices/system/cpu/cpu1/online; online')
        self.assert_made_safe()
        self.assertEqual(machine.expect(r'^(\d\S*)$')[1], '0')
        self.assertEqual(machine.expect(r'^(\d\S*)$')[1], '0-1')
        machine.wait_until_off()

    def test_a_keeper_that_was_stopped_says_how_it_ended(self):
        machine = self.begin_with_heartbeat('kill -STOP $!; sleep 1; kill -CONT $!; wait $!; echo "ended with $?"; cat /run/said; online')
        self.assert_made_safe()
        self.assertEqual(machine.expect(r'ended with (\d+)')[1], '1')
        machine.expect('Linux was silent: ')
        machine.expect('was ENDED, for Linux was silent')
        self.assertEqual(machine.expect(r'^(\d\S*)$')[1], '0-1')
        machine.wait_until_off()

    def test_a_crash_makes_the_pins_safe(self):
        self.begin_with_heartbeat('echo c > /proc/sysrq-trigger')
        self.assert_made_safe()

    # ---- the printer

    def follow(self, steps):
        """How many there are. Skips the test where this computer is so busy that the machine's Linux does not answer a bus in time."""
        if self.memory.find(b'has stopped sampling', KEPT_AT + LINK_AT, KEPT_AT + LINK_AT + LINK_BYTES) >= 0:
            self.skipTest('this computer is too busy: the virtual machine inside did not answer its converter in time')
        return steps.follow()

    def wait_for_steps(self, steps, count):
        self.wait_for(lambda: self.follow(steps) >= count)

    def test_printd_feeds_the_printer_and_may_be_killed(self):
        programs = pathlib.Path(QDUINO).parent
        folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        expected = steps_behind_the_pause(programs, folder, PART)
        machine = self.boot(PRINTER, programs=['/sbin/ip', '/usr/bin/curl', programs / 'printd', programs / 'virtual-machine'], files={
            'printer': (programs / 'printer-beside').read_bytes(), 'part.gcode': PART})
        steps = Steps(self.shared)
        self.wait_for(lambda: self.follow(steps) >= 0 and 'uploaded' in machine.console)
        self.wait_for(lambda: self.follow(steps) and any(duty > 0 for _, duty in self.shared.duties(RING_OF_LOOP_3, HEATER)))
        self.wait_for_steps(steps, steps.follow() + 2000)
        self.ring(1)
        machine.expect('^killed')
        self.wait_for_steps(steps, steps.follow() + 2000)
        self.ring(2)
        self.wait_for(lambda: self.follow(steps) and any('is done' in line for line in machine.console))
        self.assertEqual({axis: of[-len(expected[axis]):] if expected[axis] else [] for axis, of in steps.of.items()}, expected)
        self.assertGreater(self.shared.duties(RING_OF_LOOP_3, HEATER)[-1][1], 0, 'the part leaves the heater on')
        self.ring(3)
        self.wait_for(lambda: self.shared.board()[2] == ENDED)
        self.assertEqual(self.shared.board()[3], ENDED_BY_SILENCE)
        seen, safe = self.shared.silence()
        off_ns, duty = next(of for of in self.shared.duties(RING_OF_HOST, HEATER) if of[0] > seen)
        self.assertEqual(duty, 0)
        self.assertLessEqual(off_ns, safe)
        later = [of for of in self.shared.duties(RING_OF_LOOP_3, HEATER) if of[0] > safe]
        self.assertLessEqual(len(later), 1, 'one that was under way; the next look makes it safe again')


class Steps:
    """Each step of each motor, +1 or -1, as loop 2 wrote them to the pins. follow() has to come before the ring has gone round."""

    def __init__(self, shared):
        self.shared, self.read = shared, 0
        self.high, self.of = {}, {axis: [] for axis in STEP_PINS.values()}

    def follow(self):
        shared, ring = self.shared, KEPT_AT + PINS_AT + RING_OF_LOOP_2
        pushed = shared.word(PINS_AT + RING_OF_LOOP_2)
        assert pushed - self.read <= RING_SLOTS, 'the witness is too slow'
        for number in range(self.read, pushed):
            _, pin, kind, level = struct.unpack_from('<qHBB', shared.memory, ring + RING_SLOTS_AT + 16 * (number % RING_SLOTS))
            if kind != EVENT_OF_LEVEL:
                continue
            if level and not self.high.get(pin) and pin in STEP_PINS:
                self.of[STEP_PINS[pin]].append(1 if self.high.get(pin + 1) else -1)
            self.high[pin] = level
        self.read = pushed
        return sum(map(len, self.of.values()))


def steps_behind_the_pause(programs, folder, part):
    """{axis: the simulator's steps behind the longest pause of a part}: homing is before it, whose length a switch decides."""
    file, steps = folder / 'part', folder / 'steps'
    file.write_bytes(part)
    subprocess.run([programs / 'printer-sim', file, '--steps', steps], check=True, capture_output=True)
    rows = [line.split(',') for line in steps.read_text().splitlines()[1:]]
    times = [int(row[0]) for row in rows]
    begin = max(range(1, len(rows)), key=lambda i: times[i] - times[i - 1])
    return {axis: [int(row[2]) for row in rows[begin:] if row[1] == axis] for axis in STEP_PINS.values()}


if __name__ == '__main__':
    main(when_asked=True, qemu_system_x86_64='qemu-system-x86', strip='binutils', curl='curl', ip='iproute2')
