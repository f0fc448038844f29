"""The printer without an operating system: a file is uploaded by HTTP into an emulated machine, printed by the sketch in it, and judged by the
twin from its pins, outside. The simulator prints the same file, step for step.

  printer_test.py PROGRAMS      the folder of qduino, printer-metal, virtual-machine and printer-sim; skipped, with exit status 77, without an emulator"""
import gzip
import hashlib
import http.client
import json
import pathlib
import socket
import sys
import tempfile
import unittest

from prints import COMMENT, cube, main, multipart, simulated
from visits import free_port

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
        self.assertEqual(report['steps'], simulated(PROGRAMS, SQUARE)['steps'])

    def test_a_cube_is_printed_step_for_step_while_three_megabytes_come_in(self):
        part = cube(2)
        status, job = self.upload('cube.gcode', part, print='true')
        self.assertEqual(status, 201, job)
        self.printer.begin(job['id'])
        moves = len(part) // 4  # beyond the heating
        self.printer.wait_until(lambda: self.printer.get('/api/v1/machine')['bytes_executed'] > moves, 0.5)
        large = part + COMMENT * 46_000
        status, second = self.upload('large.gcode', large)
        self.assertEqual((status, second['size'], second['sha256']), (201, len(large), hashlib.sha256(large).hexdigest()))
        self.assertGreater(len(large), 3_000_000)
        end = self.printer.wait_until(lambda: self.printer.ended(job['id']), 0.5)
        self.assertEqual(end['state'], 'done', end)
        report = self.printer.verdict(job['id'])['report']
        self.assertTrue(report['matches'], report)
        self.assertEqual(report['steps'], simulated(PROGRAMS, part)['steps'])

    def ask(self, method, path, body=None, **headers):
        """(status, headers, body), without the key."""
        connection = http.client.HTTPConnection('127.0.0.1', self.printer.port, timeout=600)
        self.addCleanup(connection.close)
        connection.request(method, path, body, {name.replace('_', '-'): value for name, value in headers.items()})
        answer = connection.getresponse()
        return answer.status, answer.headers, answer.read()

    def test_the_page_is_there_and_its_session_admits_it(self):
        dist = ROOT / 'web/ui/dist'
        for path, file in ('/', 'index.html'), *((f'/assets/{each.name}', f'assets/{each.name}') for each in (dist / 'assets').glob('*.js')):
            status, head, plain = self.ask('GET', path)
            self.assertEqual((status, plain), (200, (dist / file).read_bytes()), path)
            self.assertEqual(head['Content-Type'], f'text/{"html" if path == "/" else "javascript"}; charset=utf-8')
            self.assertEqual(self.ask('GET', path, If_None_Match=head['ETag'])[0], 304)
            status, coded, short = self.ask('GET', path, Accept_Encoding='gzip')
            self.assertEqual((status, coded['Content-Encoding'], gzip.decompress(short)), (200, 'gzip', plain))
            self.assertNotEqual(coded['ETag'], head['ETag'])
        login = lambda key, **more: self.ask('POST', '/api/v1/session', json.dumps({'key': key}), **more)  # noqa: E731
        self.assertEqual(login('wrong')[0], 401)
        self.assertEqual(login(self.printer.key, Origin='http://elsewhere.example')[0], 401)
        status, head, _ = login(self.printer.key)
        self.assertEqual(status, 204)
        self.assertIn('; HttpOnly; SameSite=Strict', head['Set-Cookie'])
        cookie = head['Set-Cookie'].split(';')[0]
        status, _, answer = self.ask('GET', '/api/v1/machine', Cookie=cookie)
        self.assertEqual((status, json.loads(answer)['lacks']), (200, ['live', 'hand', 'layers', 'guarantee', 'queue']))
        for wrong in {'Cookie': cookie + '0'}, {'Cookie': cookie, 'Origin': 'http://elsewhere.example'}, {'Cookie': cookie, 'Host': 'elsewhere.example'}:
            self.assertEqual(self.ask('GET', '/api/v1/machine', **wrong)[0], 401, wrong)

    def begun(self, head):
        """A connection that has sent so much of a request."""
        connection = self.enterContext(socket.create_connection(('127.0.0.1', self.printer.port), timeout=600))
        connection.sendall(head)
        return connection

    def test_files_that_want_more_memory_than_there_is_are_refused(self):
        """The machine lives on, and uploads that were cut off give their memory back."""
        head = (f'PUT /api/v1/jobs/large.gcode HTTP/1.1\r\nHost: printer\r\nX-Api-Key: {self.printer.key}\r\nContent-Length: 16000000\r\n'
                'Expect: 100-continue\r\n\r\n').encode()
        begun = [self.begun(head) for _ in range(4)]
        for connection in begun:
            self.assertTrue(connection.recv(100).startswith(b'HTTP/1.1 100 '))
            connection.sendall(SQUARE)
        status, refused = self.upload('square.gcode', SQUARE)
        self.assertEqual((status, refused['error']['code']), (503, 'unavailable'))
        self.assertEqual(self.printer.get('/api/v1/machine')['state'], 'idle')
        for connection in begun:
            connection.close()
        self.printer.wait_until(lambda: self.upload('square.gcode', SQUARE)[0] == 201)

    def test_strangers_take_no_place_of_one_who_has_shown_the_key(self):
        def asks(connection, path, key=''):
            connection.sendall(f'GET {path} HTTP/1.1\r\nHost: printer\r\n{key}\r\n'.encode())
            return connection.recv(100_000)[:12]

        key = f'X-Api-Key: {self.printer.key}\r\n'
        known = self.begun(b'')
        self.assertEqual(asks(known, '/api/v1/machine', key), b'HTTP/1.1 200')
        strangers = []
        for _ in range(10):  # four more than there are places
            strangers.append(self.begun(b''))
            self.assertEqual(asks(strangers[-1], '/healthz'), b'HTTP/1.1 200')
        self.assertEqual([connection.recv(100) for connection in strangers[:4]], [b''] * 4, 'the oldest had to leave')
        self.assertEqual(asks(strangers[-1], '/healthz'), b'HTTP/1.1 200')
        self.assertEqual(asks(known, '/api/v1/machine', key), b'HTTP/1.1 200')

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
    main(PROGRAMS / 'printer-metal', ('qemu-system-x86_64',), 'qemu-system-x86')
