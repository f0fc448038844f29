"""The printer without an operating system before a witness with a clock: Bochs, in which an instruction of each core is a tick. So what is
late there is late by instructions of ours, and not because a computer was busy.

  this program ─► 127.0.0.1:PORT ─► Bochs [ card, HTTP, printer, what is wired to it ] ─► every write to a pin, with its tick
                                          tests/metal/witnessed_printer

When packets come, in the machine's time, is up to this computer; so the upload begins before the print, and its end is not looked at.

  printer_witness_test.py PROGRAMS [--part FILE] [--mips N]

  PROGRAMS       the folder of qduino, printer-witnessed and printer-sim; skipped, with exit status 77, without Bochs
  --part FILE    prints this G-code instead of one layer of a cube. An hour of an idle computer for a part of 20 mm
  --mips N       millions of instructions in a second of the machine's time"""
import argparse
import functools
import hashlib
import http.client
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import unittest

from prints import COMMENT, cube, main, multipart, simulated
from visits import free_port

arguments = argparse.ArgumentParser()
arguments.add_argument('programs', type=pathlib.Path)
arguments.add_argument('--part', type=pathlib.Path)
# The worst step takes some 700 instructions from its instant to its record: 7.0 us at 100.
arguments.add_argument('--mips', type=int, default=200)
OPTIONS, sys.argv[1:] = arguments.parse_known_args()
PROGRAMS = OPTIONS.programs
LATE_NS = 5000
STEP_PINS = {'X': 2, 'Y': 6, 'Z': 10, 'E': 14}
PART = OPTIONS.part.read_bytes() if OPTIONS.part else cube(1, side=8)


class Witnessed:
    """One boot, from outside."""

    def __init__(self, *words):
        self.port = free_port()
        self.folder = tempfile.TemporaryDirectory()
        self.dump = pathlib.Path(self.folder.name) / 'dump'
        self.process = subprocess.Popen(
            [PROGRAMS / 'qduino', 'metal', 'run', PROGRAMS / 'printer-witnessed', '--witness', 'bochs', '--mips', str(OPTIONS.mips),
             '--forward', f'{self.port}:80', '--vcd', self.dump, '--words', ' '.join(('key=k', *words))],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.wait_until(self.answers)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        """Ends the machine, whatever has happened: the emulator does not hear signals."""
        if self.process.poll() is None:
            self.end()
        self.folder.cleanup()

    def wait_until(self, condition):
        while not (value := condition()):
            if self.process.poll() is not None:
                raise RuntimeError(f'the machine has ended: {self.process.communicate()[0]}')
            time.sleep(0.5)
        return value

    def connect(self):
        return http.client.HTTPConnection('127.0.0.1', self.port, timeout=900)

    def request(self, method, path, body=None, headers=None):
        """(status, the answer)."""
        connection = self.connect()
        try:
            connection.request(method, path, body, {'X-Api-Key': 'k', **(headers or {})})
            answer = connection.getresponse()
            return answer.status, json.loads(answer.read() or b'{}')
        finally:
            connection.close()

    def answers(self):
        try:
            return self.request('GET', '/api/v1/machine')[0] == 200
        except (OSError, http.client.HTTPException):
            return False

    def timing(self):
        return self.request('GET', '/api/v1/machine')[1]['timing']

    def upload(self, name, data, meanwhile=lambda: None, **fields):
        """(status, answer); `meanwhile` is called when some of it has been sent."""
        body, headers = multipart(name, data, **fields)
        connection = self.connect()
        connection.putrequest('POST', '/api/v1/jobs')
        for head in ('X-Api-Key', 'k'), ('Content-Length', str(len(body))), *headers.items():
            connection.putheader(*head)
        connection.endheaders()
        connection.send(body[:10_000])
        meanwhile()
        connection.send(body[10_000:])
        answer = connection.getresponse()
        status, words = answer.status, json.loads(answer.read())
        connection.close()
        return status, words

    def print_while_another_comes(self, part, size):
        """Prints `part`, and keeps what it was told of a file of `size` bytes that comes in meanwhile."""
        _, job = self.upload('part.gcode', part, print='true')
        self.large = part + COMMENT * (size // len(COMMENT) + 1)
        begin = lambda: self.request('POST', '/api/v1/machine/bed-cleared')  # noqa: E731
        self.answer = self.upload('large.gcode', self.large, meanwhile=begin)
        return job['id']

    def end(self):
        self.request('POST', '/api/v1/machine/emergency-stop')
        self.report = self.process.communicate(timeout=600)[0]
        self.status = self.process.returncode

    def came_to(self, core):
        """(timer, devices): interrupts while the loops ran, from the report at the end."""
        found = re.search(r'timer (\d+), devices (\d+)', self.report.rsplit(f'  core {core}:', 1)[1])
        return int(found[1]), int(found[2])

    @functools.cached_property
    def rises(self):
        """{pin: how often it rose}, by the witness."""
        rises = {}
        for pin in re.findall(r'^1p(\d+)$', self.dump.read_text(), re.M):
            rises[int(pin)] = rises.get(int(pin), 0) + 1
        return rises


def broken(run, timing):
    """The promises that a run has broken."""
    kept = {
        'no step late': 0 < timing['lateness_ns']['count'] and timing['lateness_ns']['max'] <= LATE_NS,
        'core 1 untouched': run.came_to(1) == (0, 0),
    }
    return {promise for promise, is_kept in kept.items() if not is_kept}


class PrinterWitness(unittest.TestCase):
    def test_no_step_is_late_while_three_megabytes_come_in(self):
        with Witnessed() as run:
            job = run.print_while_another_comes(PART, 3_000_000)
            state = run.wait_until(lambda: (found := run.request('GET', f'/api/v1/jobs/{job}')[1])['state'] != 'printing' and found)
            timing = run.timing()
            run.end()
            status, words = run.answer
            self.assertEqual((status, words['size'], words['sha256']), (201, len(run.large), hashlib.sha256(run.large).hexdigest()), words)
            self.assertEqual((state['state'], run.status), ('done', 0), f'{state}\n{run.report}')
            self.assertGreater(run.came_to(0)[1], 400, run.report)  # the card's
            self.assertEqual(broken(run, timing), set(), f'{timing}\n{run.report}')
            steps = {axis: run.rises[pin] for axis, pin in STEP_PINS.items()}
            self.assertEqual(list(steps.values()), timing['pulses'])
            self.assertEqual(timing['lateness_ns']['count'], sum(steps.values()))
            told = simulated(PROGRAMS, PART)['steps']
            self.assertEqual(list(steps.values()), list(told.values()) if isinstance(told, dict) else told)
            print(f'{steps}: as printer-sim; late by {timing["lateness_ns"]}; interrupts (timer, devices) of core 1: {run.came_to(1)}')

    def test_interrupts_that_come_to_core_1_make_steps_late(self):
        with Witnessed('mutant=routed') as run:
            run.print_while_another_comes(PART, 3_000_000)
            timing = run.timing()
            run.end()
            self.assertEqual(broken(run, timing), {'no step late', 'core 1 untouched'}, f'{timing}\n{run.report}')


if __name__ == '__main__':
    main(PROGRAMS / 'printer-witnessed', ('bochs', 'grub-mkimage', 'xorriso'),
         'bochs bochs-term bochsbios vgabios grub-common grub-pc-bin xorriso')
