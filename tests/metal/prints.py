"""What the tests of the printer without an operating system share: a part to print, the simulator's word on it, and an upload's form."""
import json
import math
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

COMMENT = b'; a comment that is no part of it, as a slicer writes hundreds of\n'


def multipart(name, data, **fields):
    """(body, headers) of a form with one file, as a slicer sends it."""
    parts = [f'--edge\r\nContent-Disposition: form-data; name="{key}"\r\n\r\n{value}\r\n'.encode() for key, value in fields.items()]
    head = f'--edge\r\nContent-Disposition: form-data; name="file"; filename="{name}"\r\n\r\n'.encode()
    return b''.join(parts) + head + data + b'\r\n--edge--\r\n', {'Content-Type': 'multipart/form-data; boundary=edge'}


def simulated(programs, data):
    """printer-sim's report on a file."""
    with tempfile.TemporaryDirectory() as folder:
        file, report = pathlib.Path(folder) / 'a.gcode', pathlib.Path(folder) / 'report'
        file.write_bytes(data)
        subprocess.run([programs / 'printer-sim', file, '--report', report], check=True, capture_output=True)
        return json.loads(report.read_text())


def cube(layers, side=20.0, centre=100.0, width=0.6, height=0.2):
    """The first layers of a cube as a slicer writes it: three walls, a slanting infill of single moves, retractions between."""
    out, e = ['M104 S200', 'G28', 'G1 Z5 F5000', 'M109 S200', 'G21', 'G90', 'M82', 'G92 E0'], 0.0

    def to(x, y, before):
        nonlocal e
        e += 0.033 * math.dist((x, y), before)
        out.append(f'G1 X{x:.3f} Y{y:.3f} E{e:.5f}')
        return x, y

    def travel(x, y):
        out.extend((f'G1 E{e - 2:.5f} F2400', f'G1 X{x:.3f} Y{y:.3f} F7800', f'G1 E{e:.5f} F2400', 'G1 F3600'))
        return x, y

    for layer in range(layers):
        out.append(f'G1 Z{0.35 + height * layer:.3f} F7800')
        for wall in range(3):
            half = side / 2 - width * (wall + 0.5)
            corners = [(centre + half * x, centre + half * y) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))]
            at = travel(*corners[0])
            for corner in corners[1:]:
                at = to(*corner, at)
        inner, sign = side / 2 - 3 * width, 1 if layer % 2 else -1
        lines = [d * 2.0 for d in range(int(-inner), int(inner) + 1)]
        at = None
        for number, d in enumerate(lines):
            low, high = max(-inner, d - inner), min(inner, d + inner)
            ends = [(centre + sign * x, centre + d - x) for x in ((low, high) if number % 2 else (high, low))]
            at = to(*ends[1], to(*ends[0], at) if at else travel(*ends[0]))
    return '\n'.join([*out, 'M104 S0', 'G1 Z20 F5000', 'M84', '']).encode()


def main(image, programs, packages):
    """Runs the tests of the calling file. Skips them, with exit status 77, without `image` or one of `programs`, and where nobody asked for
    tests of minutes."""
    if not image.exists() or not all(map(shutil.which, programs)):
        print('skipped: needs musl-dev when it is built, and', packages)
        sys.exit(77)
    if os.environ.get('QDUINO_EMULATED') != '1':
        print('skipped: takes minutes; set QDUINO_EMULATED=1, or run ./test --all')
        sys.exit(77)
    unittest.main(verbosity=2)
