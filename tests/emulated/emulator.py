"""One machine in QEMU: its console, its monitor (QMP), and the wires at its pins (the qtest protocol).

    console  what the program prints; every line is kept
    QMP      docs/interop/qmp-spec: {"execute": …}; here for the power button and for finding the GPIO chip
    qtest    docs/devel/qtest: "set_irq_in DEVICE unnamed-gpio-in N LEVEL" sets an input pin from outside;
             after "irq_intercept_out DEVICE" every change of an output pin is told as "IRQ raise N" or "IRQ lower N"

There is no timing in it: a wait ends with what it waits for, or fails at the machine's deadline.
"""
import json
import os
import pathlib
import queue
import re
import socket
import subprocess
import threading
import time


class Failed(Exception):
    """The machine did not do what it should."""


class Lines:
    """A stream's lines, read by a thread into a queue. None at its end."""

    def __init__(self, stream, keep=None):
        self.queue = queue.Queue()
        self.keep = keep
        threading.Thread(target=self.read, args=(stream,), daemon=True).start()

    def read(self, stream):
        try:
            for line in stream:
                text = line.decode(errors='replace').rstrip('\r\n')
                if self.keep is not None:
                    self.keep.append(text)
                self.queue.put(text)
        except (OSError, ValueError):
            pass
        self.queue.put(None)

    def next(self, deadline, waiting_for):
        try:
            line = self.queue.get(timeout=max(0.0, deadline - time.monotonic()))
        except queue.Empty:
            raise Failed(f'no {waiting_for} within the time limit') from None
        if line is None:
            raise Failed(f'the machine ended before {waiting_for}')
        return line


class Machine:
    def __init__(self, command, folder, limit_s):
        self.deadline = time.monotonic() + limit_s
        self.console = []
        paths = {name: pathlib.Path(folder) / name for name in ('qmp', 'qtest')}
        listening = {name: socket.socket(socket.AF_UNIX) for name in paths}
        for name, path in paths.items():
            path.unlink(missing_ok=True)
            listening[name].bind(str(path))
            listening[name].listen(1)
            listening[name].settimeout(20)
        self.process = subprocess.Popen(
            [*command, '-display', 'none', '-nodefaults', '-no-reboot', '-serial', 'stdio',
             '-qmp', f'unix:{paths["qmp"]}', '-qtest', f'unix:{paths["qtest"]}', '-qtest-log', 'none'],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            preexec_fn=lambda: os.nice(10))
        self.printed = Lines(self.process.stdout, self.console)
        self.levels = {}
        try:
            self.qmp, self.qtest = (listening[name].accept()[0] for name in ('qmp', 'qtest'))
        except TimeoutError:
            self.end()
            raise Failed('QEMU did not start:\n' + '\n'.join(self.console)) from None
        finally:
            for connection in listening.values():
                connection.close()
        self.told = Lines(self.qmp.makefile('rb'))
        self.wires = Lines(self.qtest.makefile('rb'))
        self.execute('qmp_capabilities')

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.end()

    def end(self):
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()
        for name in ('qmp', 'qtest'):
            if hasattr(self, name):
                getattr(self, name).close()

    # ---- console

    def expect(self, pattern):
        """Waits for a line that matches; returns the match."""
        while True:
            found = re.search(pattern, self.printed.next(self.deadline, f'line "{pattern}"'))
            if found:
                return found

    def wait_until_off(self):
        """Waits until the machine has turned itself off."""
        try:
            self.process.wait(max(0.0, self.deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            raise Failed('the machine does not turn itself off') from None
        while self.printed.queue.get(timeout=5) is not None:
            pass

    # ---- monitor

    def execute(self, command, **arguments):
        self.qmp.sendall(json.dumps({'execute': command, 'arguments': arguments}).encode() + b'\n')
        while True:
            answer = json.loads(self.told.next(self.deadline, f'answer to {command}'))
            if 'error' in answer:
                raise Failed(f'{command}: {answer["error"]["desc"]}')
            if 'return' in answer:
                return answer['return']

    def device(self, kind):
        """The path of the machine's one device of a type."""
        inside = self.execute('qom-list', path='/machine/unattached')
        found = [member['name'] for member in inside if member['type'] == f'child<{kind}>']
        if len(found) != 1:
            raise Failed(f'{len(found)} devices of type {kind} in this machine, expected 1')
        return f'/machine/unattached/{found[0]}'

    # ---- wires

    def ask_qtest(self, line):
        self.qtest.sendall(line.encode() + b'\n')
        while True:
            answer = self.wires.next(self.deadline, f'answer to {line}')
            if answer.startswith('IRQ '):
                self.note(answer)
            elif answer.startswith('OK'):
                return
            else:
                raise Failed(f'qtest: {line}: {answer}')

    def note(self, line):
        _, change, number = line.split()
        self.levels[int(number)] = change == 'raise'

    def watch_outputs(self, device):
        self.ask_qtest(f'irq_intercept_out {device}')

    def set_input(self, device, pin, level):
        self.ask_qtest(f'set_irq_in {device} unnamed-gpio-in {pin} {int(level)}')

    def expect_output(self, pin, level):
        """Waits until the chip's output `pin` has that level."""
        while self.levels.get(pin, False) != level:
            self.note(self.wires.next(self.deadline, f'change of output pin {pin} to {int(level)}'))
