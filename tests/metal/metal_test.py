"""Sketches on the board without an operating system, booted in QEMU by `qduino metal run`.

Time is a count of instructions (--deterministic), so a run is the same every time and on every computer.

  metal_test.py QDUINO [Class.test]"""
import concurrent.futures
import contextlib
import datetime
import os
import pathlib
import random
import re
import socket
import subprocess
import threading
import unittest

from runs import CACHE, ENVIRONMENT, HERE, ROOT, Run, changed, main, metal, read_to
from visits import ask, free_port, free_ports, size_and_hash


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


class Image(unittest.TestCase):
    def test_one_that_is_built_is_booted_with_words_of_its_own(self):
        built = subprocess.run(metal('build', ROOT / 'sketches/blink'), capture_output=True, text=True, timeout=200, check=True, env=ENVIRONMENT)
        run = Run(pathlib.Path(built.stdout.strip()), '--words', 'for=2.5')
        self.assertEqual(run.status, 0, run.report)
        self.assertEqual(run.levels(13)[:4], [0, 1, 0, 1])


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


class Eeprom(unittest.TestCase):
    """tests/metal/eeprom: there is no file, and the sketch hears so once."""

    def test_what_is_written_lasts_as_long_as_the_run(self):
        run = Run(HERE / 'eeprom', '--for', '0.1')
        self.assertEqual(run.status, 0, run.report)
        lines = run.serial.replace('\r', '').split('\n')
        self.assertEqual([line for line in lines if line.lstrip('-').isdigit()], ['-1', '1234'], run.serial)
        self.assertEqual((run.serial + run.report).count('this board has no files'), 1, run.serial + run.report)


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


    def test_a_wait_that_the_kernel_does_not_know_lends_no_rank(self):
        """The mutant of the test above, which has to fail on it, and on nothing else."""
        mutant = changed(HERE / 'kernel', 'no_inheritance', ('  lock.lock();\n  digitalWrite(10, LOW);', '  while (!lock.tryLock()) delay(1);\n  digitalWrite(10, LOW);'))
        self.run1 = Run(mutant, '--for', '1', '--cores', 3, '--wire', f'{CACHE}/wire', said=b'AZ', driven=bytes((0x80 | 21, 21)) * 10)
        self.assertEqual(self.run1.status, 0, self.run1.report)
        with self.assertRaises(AssertionError):
            self.test_a_waiter_lends_its_rank_to_the_holder()
        self.test_loops_that_want_more_get_their_budgets()
        self.test_interrupts_go_where_they_are_routed()
        self.test_each_edge_has_its_handler()


class Chain(unittest.TestCase):
    """tests/metal/chain: a rank is inherited through locks and cores."""

    def pulses(self, sketch):
        """The pulses of mid: (before high asks, from then until low gives its lock back, after that)."""
        run = Run(sketch, '--for', '0.3', '--cores', 3)
        self.assertEqual(run.status, 0, run.report)
        asked = run.pins.index((10, 1))
        self.assertIn((11, 1), run.pins[:asked], 'link waits when high asks')
        given, link, high = (run.pins.index((pin, 0), asked) for pin in (5, 11, 10))
        self.assertEqual(sorted((given, link, high)), [given, link, high])
        return tuple(part.count((4, 1)) for part in (run.pins[:asked], run.pins[asked:given], run.pins[given:]))

    def test_the_last_of_a_chain_ranks_as_the_first(self):
        before, meanwhile, after = self.pulses(HERE / 'chain')
        self.assertGreater(before, 20)
        self.assertLessEqual(meanwhile, 2, 'until the other core was told')
        self.assertGreater(after, 30)

    def test_a_wait_that_the_kernel_does_not_know_lends_no_rank(self):
        mutant = changed(HERE / 'chain', 'no_chain', ('  A.lock();\n  digitalWrite(10, LOW);', '  while (!A.tryLock()) delay(1);\n  digitalWrite(10, LOW);'))
        _, meanwhile, after = self.pulses(mutant)
        self.assertGreater(meanwhile, 30)
        self.assertEqual(after, 0)


@contextlib.contextmanager
def someone_who_answers():
    """The ports of a server that answers one line, and one packet, with itself and a word."""
    with socket.create_server(('127.0.0.1', 0)) as listener, socket.socket(type=socket.SOCK_DGRAM) as packets:
        packets.bind(('127.0.0.1', 0))

        def by_tcp():
            with listener.accept()[0] as connection, connection.makefile('rb') as lines:
                connection.sendall(lines.readline().replace(b'\r', b', indeed\r'))

        def by_udp():
            words, whom = packets.recvfrom(100)
            packets.sendto(words + b', indeed', whom)

        for answer in by_tcp, by_udp:
            threading.Thread(target=answer, daemon=True).start()
        yield listener.getsockname()[1], packets.getsockname()[1]


class WebLight(unittest.TestCase):
    """sketches/web_light, as it is."""

    def test_a_browser_switches_the_light(self):
        port = free_port()
        answers = []

        def visit():
            answers.extend(ask(port, path) for path in ('/', '/on', '/', '/off'))

        run = Run(ROOT / 'sketches/web_light', '--forward', f'{port}:8080', visit=visit)
        self.assertEqual(run.status, 0, run.report)
        self.assertEqual(answers, [(200, f'The light is {state}.\r\n') for state in ('off', 'on', 'on', 'off')])
        self.assertEqual(run.levels(13), [0, 1, 0] + run.levels(13)[3:])
        self.assertLessEqual(set(run.levels(13)[3:]), {0})


class Network(unittest.TestCase):
    """tests/metal/network, which says what it answers."""
    # A whole file to print where there is time for it.
    LARGEST = 3_000_000 if os.environ.get('QDUINO_EMULATED') == '1' else 300_000
    # Each of a crowd has a door of its own. At one door QEMU's router lets a single visitor wait
    # (its listen() is told 1); this computer holds further ones off, or resets them after a second,
    # and the machine never hears of them.
    DOORS = 8

    @classmethod
    def setUpClass(cls):
        ports = free_ports(cls.DOORS)
        port = ports[0]
        cls.bodies = [b'', b'x', bytes(range(256)) * 5, random.Random(14).randbytes(cls.LARGEST)]
        cls.answers = []

        def visit():
            for body in cls.bodies:
                cls.answers.append(ask(port, body=body))
            with concurrent.futures.ThreadPoolExecutor(cls.DOORS) as visitors:
                twice = visitors.map(lambda number: [ask(ports[number], body=b'?' * (number + more)) for more in (0, cls.DOORS)], range(cls.DOORS))
                cls.crowd = [answer for both in zip(*twice) for answer in both]
            with someone_who_answers() as (tcp, udp):
                cls.asked = [ask(port, f'/tcp/{tcp}'), ask(port, f'/udp/{udp}')]
            cls.asked.append(ask(port, f'/tcp/{free_port()}'))

        doors = [word for port in ports for word in ('--forward', f'{port}:80')]
        cls.run1 = Run(HERE / 'network', *doors, visit=visit, goodbye=b'!')

    def setUp(self):
        self.assertEqual(self.run1.status, 0, self.run1.report)

    def test_it_asks_for_its_address(self):
        self.assertIn('ready at 10.0.2.15', self.run1.serial)

    def test_what_is_sent_arrives_whole(self):
        self.assertEqual(self.answers, [(200, size_and_hash(body)) for body in self.bodies])

    def test_many_at_once_are_answered(self):
        self.assertEqual(self.crowd, [(200, size_and_hash(b'?' * number)) for number in range(2 * self.DOORS)])

    def test_it_asks_others(self):
        self.assertEqual(self.asked, [(200, 'who is there?, indeed\r'), (200, 'who is there?, indeed'), (200, 'nobody')])

    def test_the_card_interrupts_core_0_alone(self):
        self.assertEqual(self.run1.came_to(1), (0, 0), self.run1.report)
        self.assertGreater(self.run1.came_to(0)[1], 10, self.run1.report)
        self.assertGreater(self.run1.rises(6), 5_000 * self.run1.seconds())
        self.assertIn('(uart: above every loop, nic: io 33)', ' '.join(self.run1.report.split()))


class OtherCard(unittest.TestCase):
    """The same sketch with the card that interrupts by a line, and not by messages."""

    def test_it_serves_as_well(self):
        port = free_port()
        body = random.Random(15).randbytes(20_000)
        answers = []
        run = Run(HERE / 'network', '--card', 'e1000', '--forward', f'{port}:80',
                  visit=lambda: answers.append(ask(port, body=body)), goodbye=b'!')
        self.assertEqual(run.status, 0, run.report)
        self.assertEqual(answers, [(200, size_and_hash(body))])
        self.assertEqual(run.came_to(1), (0, 0), run.report)
        self.assertGreater(run.came_to(0)[1], 5, run.report)


class NoNetwork(unittest.TestCase):
    def test_without_a_card_a_server_says_so(self):
        folder = pathlib.Path(CACHE) / 'alone'
        folder.mkdir()
        (folder / 'alone.ino').write_text('#include <WiFi.h>\nWiFiServer server(80);\n'
                                          'void setup() { Serial.begin(115200); server.begin(); Serial.println(WiFi.status()); }\n'
                                          'void loop() { delay(100); }\n')
        run = Run(folder, '--for', '0.3')
        self.assertEqual(run.status, 0, run.report)
        self.assertIn('no network card', run.report)
        self.assertIn('6\r\n', run.serial)


class Turns(unittest.TestCase):
    """tests/metal/turns: devices that are served without an interrupt."""

    def test_each_is_served_when_it_said_and_when_asked(self):
        run = Run(HERE / 'turns', '--for', '1')
        self.assertEqual(run.status, 0, run.report)
        self.assertGreater(run.rises(2), 90)
        self.assertLessEqual(run.rises(2), 103)
        self.assertGreater(run.rises(3), 45)
        self.assertLessEqual(run.rises(3), 53)
        self.assertGreater(run.rises(4), 90)
        self.assertLessEqual(abs(run.rises(5) - run.rises(4)), 1)

    def test_bottom_halves_of_one_device_do_not_overlap(self):
        run = Run(HERE / 'turns', '--for', '0.4')
        self.assertEqual(run.status, 0, run.report)
        self.assertEqual(run.rises(7), 0)
        self.assertGreater(run.rises(8), 256)


class Dying:
    """One boot of tests/metal/death, or of a mutant of it, whose pins and reports go to one file, in their order: so it shows which came first.
    `letter`: what the sketch is told to do. `command`: what the emulator's monitor is told to do."""
    PIN_6_LOW, PIN_7_HIGH = 6, 0x87

    def __init__(self, letter=b'', command='', sketch=HERE / 'death'):
        image = subprocess.run(metal('build', sketch), capture_output=True, text=True, timeout=200, check=True, env=ENVIRONMENT).stdout.strip()
        witness, monitor = pathlib.Path(CACHE) / 'witness', pathlib.Path(CACHE) / 'monitor'
        witness.unlink(missing_ok=True)
        monitor.unlink(missing_ok=True)
        words = ['qemu-system-x86_64', '-machine', 'q35', '-cpu', 'max', '-m', '128', '-smp', '2', '-display', 'none', '-nodefaults', '-no-reboot',
                 '-icount', 'shift=4,sleep=off', '-kernel', image, '-append', 'for=60', '-serial', 'stdio',
                 '-monitor', f'unix:{monitor},server=on,wait=off', '-device', 'isa-debug-exit,iobase=0xf4,iosize=0x01']
        for name, port in ('pins', 0x2e8), ('report', 0xe9):
            words += ['-chardev', f'file,id={name},path={witness},append=on', '-device', f'isa-debugcon,iobase={port:#x},chardev={name}']
        with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, bufsize=0) as process:
            if letter or command:
                read_to(process.stdout, b'ready')
            with socket.socket(socket.AF_UNIX) as operator:
                if command:
                    operator.connect(str(monitor))
                    operator.sendall(command.encode() + b'\n')
                process.stdin.write(letter)
                try:
                    self.status = process.wait(timeout=200) // 2
                finally:
                    process.kill()
        self.before, _, self.words = witness.read_bytes().partition(b'PANIC on ')
        self.pins = [byte for byte in self.before if byte in (6, 7, 0x86, 0x87)]


class Death(unittest.TestCase):
    """tests/metal/death: the pins come first."""

    def dies(self, core, words, **how):
        run = Dying(**how)
        self.assertEqual(run.status, 1, run.words)
        self.assertRegex(run.words.decode(errors='replace'), rf'^core {core}: .*{words}')
        self.assertIn(0x86, run.pins)
        # The safe levels were there when it began to speak, and stayed.
        self.assertEqual((run.pins[-2:], run.words.count(b'\x86')), ([Dying.PIN_6_LOW, Dying.PIN_7_HIGH], 0))

    def test_null_pointer(self):
        self.dies(0, r'page fault at .*\(a null pointer\)', letter=b'n')

    def test_full_stack(self):
        self.dies(0, r'\(a stack is full\)', letter=b's')

    def test_a_frame_that_is_larger_than_its_stack(self):
        self.dies(1, r'\(a stack is full\)', letter=b'B')

    def test_full_stack_of_setup(self):
        sketch = changed(HERE / 'death', 'early', ('  lock.heldBy(1, 1);', '  digitalWrite(6, HIGH);\n  digitalWrite(7, LOW);\n  fill(0);'))
        self.dies(0, r'\(a stack is full\)', sketch=sketch)

    def test_division_by_zero(self):
        self.dies(1, 'divide error', letter=b'D')

    def test_broken_contract_on_either_core(self):
        for core, letter in enumerate((b'c', b'C')):
            self.dies(core, 'contract broken: ', letter=letter)

    def test_double_fault_on_either_core(self):
        for core, letter in enumerate((b'f', b'F')):
            self.dies(core, 'double fault', letter=letter)

    def test_non_maskable_interrupt_on_either_core(self):
        for core, letter in enumerate((b'i', b'I')):
            self.dies(core, 'non-maskable interrupt', letter=letter)

    def test_machine_check_on_either_core(self):
        """Bank 9 reports an error of memory that nothing corrected, while another one may follow (Intel SDM volume 3, 15.3)."""
        for core in 0, 1:
            self.dies(core, 'machine check', command=f'mce {core} 9 0xbd00000000000134 0x5 0x1234 0x8c')


class Undeclared(unittest.TestCase):
    """Who gives the core up more often than it declares pays for the turns, and is named; nobody else is."""

    WORDS = r'  (\d+) +0 .*\n +it gave its core up (\d+) times more often than it declares'

    def said_of(self, sketch):
        run = Run(sketch, '--for', '1')
        self.assertEqual(run.status, 0, run.report)
        return {int(loop): int(times) for loop, times in re.findall(self.WORDS, run.report)}

    def test_it_is_named_with_how_often(self):
        said = self.said_of(HERE / 'undeclared')
        self.assertEqual(set(said), {1})
        self.assertGreater(said[1], 400)
        self.assertLess(said[1], 520)

    def test_what_was_declared_is_nobodys_fault(self):
        self.assertEqual(self.said_of(changed(HERE / 'undeclared', 'declared', ('loop(1, 2, 20, 0)', 'loop(1, 2, 20, 0, 12, 10)'))), {})


class Clocks(unittest.TestCase):
    """tests/metal/clocks: what the libraries say of the time, where no system tells them."""

    def test_they_are_the_boards(self):
        run = Run(HERE / 'clocks', '--for', '0.5')
        self.assertEqual(run.status, 0, run.report)
        self.assertIn('setup: 0', run.serial)
        said = re.search(r'worked (\d+) lasted (\d+) steady (\d+) idle (\d+) others (\d+) slept 0 wrong -1-1\.', run.serial)
        self.assertIsNotNone(said, run.serial)
        worked, lasted, steady, idle, others = map(int, said.groups())
        self.assertIn(worked, (9, 10, 11))
        self.assertGreaterEqual(lasted, 30)  # and loop 2 is above
        self.assertLess(lasted, 45)
        self.assertLessEqual(abs(steady - lasted), 1)
        self.assertLessEqual(idle, 1)
        self.assertIn(others, (4, 5, 6))


class Date(unittest.TestCase):
    """tests/metal/date: what the clock that runs without power says, as C and C++ tell it."""

    def date_of(self, *rtc):
        """What the sketch says: when it began, 3 s later, and behind a wait for a date that is over. Of QEMU's clock the words `rtc`."""
        built = subprocess.run(metal('build', HERE / 'date'), capture_output=True, text=True, timeout=200, check=True, env=ENVIRONMENT)
        done = subprocess.run(['qemu-system-x86_64', '-machine', 'q35', '-cpu', 'max', '-m', '128', '-smp', '2', '-display', 'none', '-nodefaults',
                               '-no-reboot', '-icount', 'shift=4,sleep=off', '-kernel', built.stdout.strip(), '-append', 'for=4', '-serial', 'stdio',
                               '-device', 'isa-debug-exit,iobase=0xf4,iosize=0x01', *rtc],
                              stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=200, check=False)
        said = dict(re.findall(r'(began|waited|over) (\S+)', done.stdout))
        self.assertEqual(set(said), {'began', 'waited', 'over'}, done.stdout + done.stderr)
        self.assertIn((datetime.datetime.fromisoformat(said['over']) - datetime.datetime.fromisoformat(said['waited'])).seconds, (0, 1), said)
        return said['began'], said['waited']

    def test_a_sketch_begins_at_the_true_date(self):
        began, waited = self.date_of('-rtc', 'base=2026-02-28T23:59:58,clock=vm')
        self.assertIn(began, ('2026-02-28T23:59:58', '2026-02-28T23:59:59'))
        self.assertIn(waited, ('2026-03-01T00:00:01', '2026-03-01T00:00:02', '2026-03-01T00:00:03'))

    def test_the_century_is_the_firmwares(self):
        began, waited = self.date_of('-rtc', 'base=1999-12-31T23:59:58,clock=vm')
        self.assertEqual((began[:10], waited[:10]), ('1999-12-31', '2000-01-01'))

    def test_counted_time_has_a_counted_date(self):
        run = Run(HERE / 'date', '--for', '0.5')
        self.assertEqual(run.status, 0, run.report)
        self.assertIn('began 2000-01-01T00:00:0', run.serial)


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


if __name__ == '__main__':
    main(qemu_system_x86_64='qemu-system-x86')
