"""The printer without an operating system, in an emulated machine, and the virtual machine that it prints on, outside of it.

  curl ─► 127.0.0.1:PORT ─► QEMU [ HTTP, printer ] ◄─ memory of both ─► virtual-machine ◄─ inspector's socket ─ this program

  metal_printer.py PROGRAMS [--port N] [--real-time]      PROGRAMS: the folder of qduino, virtual-machine and printer-metal

It tells the inspector which file was asked for, then tells the printer that the bed is clear, and judges each print at its end. `./run --metal`
starts it; tests/metal/printer_test.py uses the class."""
import argparse
import http.client
import json
import os
import pathlib
import secrets
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
ENDED = ('done', 'cancelled', 'failed')
TURN_US = 100  # how long one core runs while the others stand still; so a step may be this late


class MetalPrinter:
    """Both processes, for the time of a `with`."""

    def __init__(self, programs, port, counted_time=True, turn_us=TURN_US, report=None):
        self.programs, self.port, self.counted_time, self.turn_us, self.report = pathlib.Path(programs), port, counted_time, turn_us, report
        self.key = secrets.token_hex(16)
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix='qduino-metal-', dir='/dev/shm'))
        self.processes = []

    def start(self):
        """Returns when the printer answers."""
        try:
            self._start([self.programs / 'virtual-machine', '--pins', self.folder / 'pins', '--inspect',
                                        self.folder / 'inspect', '--own-clock', '--fifo', '0'])
            self.wait_until(lambda: (self.folder / 'inspect').exists())
            self._start(self._emulator_words())
            self.wait_until(self._answers)
        except BaseException:
            self.stop()
            raise

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self.stop()

    def _start(self, words):
        process = subprocess.Popen(list(map(str, words)), stdin=subprocess.DEVNULL, stdout=self.report, stderr=self.report)
        self.processes.append(process)
        return process

    def _emulator_words(self):
        words = [self.programs / 'qduino', 'metal', 'run', self.programs / 'printer-metal', '--window', self.folder / 'pins',
                 '--forward', f'{self.port}:80', '--files', ROOT / 'web/ui/dist', '--words', f'key={self.key} turns={self.turn_us}']
        return words + (['--deterministic'] if self.counted_time else [])

    def stop(self):
        for process in reversed(self.processes):
            if process.poll() is None:
                process.terminate()
                process.wait(timeout=20)
        shutil.rmtree(self.folder, ignore_errors=True)

    def wait_until(self, condition, pause_s=0.2):
        """The value of `condition` once it is true; an error when a process has ended, for then it will not come."""
        while not (value := condition()):
            for process in self.processes:
                if process.poll() is not None:
                    raise RuntimeError(f'{process.args[0]} has ended with status {process.returncode}')
            time.sleep(pause_s)
        return value

    def _answers(self):
        try:
            return self.request('GET', '/healthz')[0] == 200
        except OSError:
            return False

    def request(self, method, path, body=None, headers=None):
        """(status, the body of the answer)."""
        connection = http.client.HTTPConnection('127.0.0.1', self.port, timeout=600)
        try:
            connection.request(method, path, body, {'X-Api-Key': self.key, **(headers or {})})
            answer = connection.getresponse()
            return answer.status, answer.read()
        except http.client.HTTPException as broken:
            raise OSError(str(broken)) from broken
        finally:
            connection.close()

    def get(self, path):
        return json.loads(self.request('GET', path)[1])

    def ask_inspector(self, **question):
        with socket.socket(socket.AF_UNIX) as to:
            to.settimeout(60)
            to.connect(str(self.folder / 'inspect'))
            to.sendall(json.dumps(question).encode() + b'\n')
            answer = b''
            while not answer.endswith(b'\n') and (piece := to.recv(1 << 20)):
                answer += piece
        return json.loads(answer)

    def waiting(self):
        """The number of a job that waits for a clear bed; None: there is none."""
        page = self.get('/api/v1/jobs')
        return next((job['id'] for job in page['jobs'] if job['state'] == 'queued' and page['queue']['bed_occupied']), None)

    def begin(self, job):
        """Tells the inspector what is asked for, then lets the job begin."""
        file = self.folder / f'{job}.gcode'
        file.write_bytes(self.request('GET', f'/api/v1/jobs/{job}/file')[1])
        told = self.ask_inspector(op='job_begin', job=job, path=str(file))
        if not told.get('ok'):
            raise RuntimeError(f'the inspector refuses: {told}')
        self.request('POST', '/api/v1/machine/bed-cleared')

    def ended(self, job):
        """The job, when it has ended; else None."""
        state = self.get(f'/api/v1/jobs/{job}')
        return state if state['state'] in ENDED else None

    def verdict(self, job):
        return self.ask_inspector(op='job_end', job=job, excursions=0)


def tell(words):
    print(words, flush=True)


def serve(printer):
    """Prints what is uploaded, until it is stopped."""
    while True:
        job = printer.wait_until(printer.waiting, 0.5)
        printer.begin(job)
        tell(f'Job {job} prints.')
        end = printer.wait_until(lambda number=job: printer.ended(number), 1)
        tell(f'Job {job} is {end["state"]}{": " + end["error"] if end["error"] else ""}.')
        tell(summary(printer.verdict(job), printer.get('/api/v1/machine')['timing']))


def summary(verdict, timing):
    report = verdict.get('report', {})
    lateness = timing['lateness_ns']
    differences = ''.join(f'\n  {line}' for line in report.get('differences', []))
    return (f'{"Built is what was asked." if report.get("matches") else "Built is NOT what was asked."}{differences}\n'
            f'  steps     {report.get("steps")}\n'
            f'  lateness  p50 {lateness["p50"]} ns  p9999 {lateness["p9999"]} ns  max {lateness["max"]} ns, on the printer\'s own clock')


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('programs')
    parser.add_argument('--port', type=int, default=8080)
    parser.add_argument('--real-time', action='store_true', help='the emulated machine\'s time is this computer\'s, not a count of instructions')
    options = parser.parse_args()
    for ends in (signal.SIGTERM, signal.SIGINT):  # a shell lets what is in its background ignore SIGINT
        signal.signal(ends, lambda *_: sys.exit(0))
    with MetalPrinter(options.programs, options.port, not options.real_time) as printer:
        tell(f'The printer, without an operating system: http://127.0.0.1:{options.port}/#key={printer.key}\n'
             'Jobs are in its memory alone: one prints, one waits. To print:\n'
             f'  curl -H "X-Api-Key: {printer.key}" -F print=true -F file=@FILE.gcode http://127.0.0.1:{options.port}/api/v1/jobs')
        serve(printer)


if __name__ == '__main__':
    main()
