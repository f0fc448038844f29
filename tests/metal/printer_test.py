"""The printer without an operating system: a file is uploaded by HTTP into an emulated machine, printed by the sketch in it, and judged by the
twin from its pins, outside. The simulator prints the same file, step for step.

  printer_test.py PROGRAMS      the folder of printer-metal, virtual-machine and printer-sim; skipped, with exit status 77, without an emulator"""
import hashlib
import json
import os
import pathlib
import shutil
import socket
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / 'apps/metal_printer'))
import metal_printer  # noqa: E402

PROGRAMS = pathlib.Path(sys.argv.pop(1))
SQUARE = b"""G21
G90
M82
G28
M104 S45
M109 S45
G1 X20 Y20 Z0.3 F6000
G1 X24 F3000
G1 Y24
G2 X20 Y20 I-4 J0
M104 S0
M84
"""


def free_port():
    with socket.socket() as probe:
        probe.bind(('127.0.0.1', 0))
        return probe.getsockname()[1]


def multipart(name, data, **fields):
    """(body, headers) of a form with one file, as a slicer sends it."""
    parts = [f'--edge\r\nContent-Disposition: form-data; name="{key}"\r\n\r\n{value}\r\n'.encode() for key, value in fields.items()]
    head = f'--edge\r\nContent-Disposition: form-data; name="file"; filename="{name}"\r\n\r\n'.encode()
    return b''.join(parts) + head + data + b'\r\n--edge--\r\n', {'Content-Type': 'multipart/form-data; boundary=edge'}


def simulated(data):
    """printer-sim's report on a file."""
    with tempfile.TemporaryDirectory() as folder:
        file, report = pathlib.Path(folder) / 'a.gcode', pathlib.Path(folder) / 'report'
        file.write_bytes(data)
        subprocess.run([PROGRAMS / 'printer-sim', file, '--report', report], check=True, capture_output=True)
        return json.loads(report.read_text())


class Printer(unittest.TestCase):
    def setUp(self):
        report = tempfile.TemporaryFile()
        self.addCleanup(report.close)
        self.printer = metal_printer.MetalPrinter(PROGRAMS, free_port(), report=report)
        self.addCleanup(self.printer.stop)
        self.printer.start()

    def upload(self, name, data, **fields):
        body, headers = multipart(name, data, **fields)
        status, answer = self.printer.request('POST', '/api/v1/jobs', body, headers)
        return status, json.loads(answer)

    def test_a_file_is_printed_step_for_step_while_another_comes_in(self):
        status, job = self.upload('square.gcode', SQUARE, print='true')
        self.assertEqual(status, 201, job)
        self.assertEqual((job['size'], job['sha256']), (len(SQUARE), hashlib.sha256(SQUARE).hexdigest()))
        self.assertEqual(self.printer.waiting(), job['id'])
        self.printer.begin(job['id'])
        large = SQUARE + b'; a comment that is no part of it\n' * 3000
        status, second = self.upload('large.gcode', large)
        self.assertEqual(status, 201, second)
        self.assertEqual((second['size'], second['sha256'], second['state']), (len(large), hashlib.sha256(large).hexdigest(), 'held'))
        # More than a socket holds: it goes out over many releases of the loop.
        self.assertEqual(self.printer.request('GET', f'/api/v1/jobs/{second["id"]}/file'), (200, large))
        status, refused = self.upload('third.gcode', SQUARE)
        self.assertEqual((status, refused['error']['code']), (409, 'already_exists'))
        end = self.printer.wait_until(lambda: self.printer.ended(job['id']), 0.5)
        self.assertEqual(end['state'], 'done', end)
        report = self.printer.verdict(job['id'])['report']
        self.assertTrue(report['matches'], report)
        self.assertEqual(report['steps'], simulated(SQUARE)['steps'])

    def test_what_it_refuses(self):
        request = self.printer.request
        self.assertEqual(request('GET', '/api/v1/machine', headers={'X-Api-Key': 'wrong'})[0], 401)
        self.assertEqual(request('GET', '/nothing')[0], 404)
        self.assertEqual(request('PUT', '/api/v1/machine')[0], 405)
        status, error = self.upload('cold.gcode', b'G28\nG1 X10 E5 F600\n')
        self.assertEqual(status, 422, error)
        status, error = self.upload('square.gcode', SQUARE, sha256='0' * 64)
        self.assertEqual((status, error['error']['code']), (500, 'corrupt'))
        status, page = request('GET', '/api/v1/jobs')
        self.assertEqual((status, json.loads(page)['jobs']), (200, []))


if __name__ == '__main__':
    if not (PROGRAMS / 'printer-metal').exists() or not shutil.which(metal_printer.EMULATOR):
        print('skipped: needs musl-dev when it is built, and qemu-system-x86')
        sys.exit(77)
    if os.environ.get('QDUINO_EMULATED') != '1':
        print('skipped: takes a minute; set QDUINO_EMULATED=1, or run ./test --all')
        sys.exit(77)
    unittest.main(verbosity=2)
