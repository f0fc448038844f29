"""Sketches booted by `qduino metal run`, for the tests of this folder: what a witness outside saw at the pins, what came over the serial
line, and what the guarantee report says. The first word of the test's command line is the qduino to test.

main() skips the whole test, with exit status 77, where qduino was built without images or no emulator is installed: it says which."""
import os
import pathlib
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
HERE = ROOT / 'tests/metal'
SKIPPED = 77
QDUINO = str(pathlib.Path(sys.argv.pop(1)).resolve())
CACHE = tempfile.mkdtemp(prefix='qduino-metal-')
ENVIRONMENT = {**os.environ, 'XDG_CACHE_HOME': CACHE}


def metal(*words):
    return [QDUINO, 'metal', *map(str, words)]


def read_to(stream, word):
    """The lines up to one that begins with `word`, or to the end."""
    lines = [stream.readline()]
    while lines[-1] and not lines[-1].startswith(word):
        lines.append(stream.readline())
    return b''.join(lines)


class Run:
    """One boot, from outside."""

    def __init__(self, sketch, *options, said=None, driven=None, visit=None, goodbye=None):
        """`said`: bytes to say on the serial line when the sketch has said that it is ready; `driven`: on the wire to its pins, when its loops run;
        `visit`: a function to call when it is ready. Its time is this computer's and not the machine's, so with it no `--for` ends the run: the
        bytes `goodbye` do, which the sketch has to understand; or, without them, a signal, which leaves no report."""
        record = pathlib.Path(CACHE) / 'record'
        with subprocess.Popen(metal('run', sketch, '--record', record, '--deterministic', *options), stdin=subprocess.PIPE,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=ENVIRONMENT, bufsize=0) as process:
            before = b''
            if said or visit:
                before += read_to(process.stdout, b'ready')
            if said:
                process.stdin.write(said)
                process.stdin.flush()
            if visit:
                try:
                    visit()
                    if goodbye:
                        process.stdin.write(goodbye)
                finally:
                    if not goodbye or sys.exc_info()[0]:
                        process.terminate()
            with socket.socket(socket.AF_UNIX) as wire:  # open to the end: a machine drops what a closed one still holds
                if driven:
                    before += read_to(process.stdout, b'line')
                    wire.connect(f'{CACHE}/wire')
                    wire.sendall(driven)
                rest, report = process.communicate(timeout=200)
        self.status = process.returncode
        self.serial = (before + rest).decode(errors='replace')
        self.report = report.decode(errors='replace')
        self.record = record.read_bytes() if record.exists() else b''
        self.pins = [(byte & 0x7f, byte >> 7) for byte in self.record]

    def levels(self, pin):
        return [level for at, level in self.pins if at == pin]

    def rises(self, pin):
        return self.levels(pin).count(1)

    def seconds(self):
        """So long did the loops run, from the report at the end."""
        return float(re.search(r'Charged in (\S+) us', self.report)[1]) / 1e6

    def came_to(self, core):
        """(timer, devices): interrupts of a core while the loops ran, from the report at the end."""
        last = self.report.rsplit(f'  core {core}:', 1)[1]
        found = re.search(r'timer (\d+), devices (\d+)', last)
        return int(found[1]), int(found[2])


def changed(sketch, name, *changes):
    """A copy of a sketch in which each (old, new) of `changes` was replaced: a mutant."""
    folder = pathlib.Path(CACHE) / name
    shutil.copytree(sketch, folder, dirs_exist_ok=True)
    source = folder / f'{name}.ino'
    (folder / f'{sketch.name}.ino').rename(source)
    text = source.read_text()
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    source.write_text(text)
    return folder


def missing(**packages):
    """What to install of `packages`, program=package; empty when all programs are there."""
    lacking = [package for program, package in packages.items() if not shutil.which(program.replace('_', '-').replace('x86-64', 'x86_64'))]
    return 'as root, run: apt-get install ' + ' '.join(lacking) if lacking else ''


def main(when_asked=False, **packages):
    """`when_asked`: a test of minutes, which `./test --all` runs."""
    if when_asked and os.environ.get('QDUINO_EMULATED') != '1':
        print('skipped: takes a minute; set QDUINO_EMULATED=1, or run ./test --all')
        sys.exit(SKIPPED)
    try:
        built = subprocess.run(metal('build', ROOT / 'sketches/blink'), capture_output=True, timeout=200, check=False, env=ENVIRONMENT)
        reason = built.stderr.decode() if b'musl-dev' in built.stderr else missing(**packages)
        if reason:
            print('skipped:', reason)
            sys.exit(SKIPPED)
        unittest.main(verbosity=2)
    finally:
        shutil.rmtree(CACHE, ignore_errors=True)
