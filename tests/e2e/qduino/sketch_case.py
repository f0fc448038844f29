"""A folder of its own for each test, sketches in it, and qduino as a person runs it there. The program is the test's first argument."""

import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

PROGRAM = sys.argv.pop(1)


class SketchCase(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.environment = dict(os.environ, XDG_CACHE_HOME=str(self.folder / "cache"), LC_ALL="C.UTF-8")
        for name in ("QDUINO_HOME", "CXX", "CC", "CXXFLAGS", "CFLAGS", "LDFLAGS"):
            self.environment.pop(name, None)

    def write(self, name, content):
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content, encoding="utf-8")
        return path

    def run_qduino(self, *arguments, status=0, **environment):
        done = subprocess.run([PROGRAM, *map(str, arguments)], cwd=self.folder, env=dict(self.environment, **environment),
                              capture_output=True, text=True, timeout=600, check=False)
        self.assertEqual(done.returncode, status, f"{arguments}\n{done.stdout}\n{done.stderr}")
        return done

    def trace_on_linux(self, *options):
        """Two loops for a second, traced by the kernel; one spends its budget. They ask for little: a busy computer admits them, too. In a mount
        namespace of its own: what is mounted there goes with the command."""
        with_tracefs = ["unshare", "--mount", "sh", "-c", 'mount -t tracefs tracefs /sys/kernel/tracing && exec "$@"', "sh"]
        if subprocess.run([*with_tracefs, "true"], capture_output=True, check=False).returncode != 0:
            self.skipTest("the kernel's tracer cannot be had: it takes root, and a kernel with tracefs")
        self.write("busy/busy.ino", """
            void setup() {}
            void loop(1, 1, 20, 0) { delayBusyMicroseconds(200); waitForNextPeriod(); }
            void loop(2, 10, 200, 0) { delayBusyMicroseconds(30000); waitForNextPeriod(); }
        """)
        done = subprocess.run([*with_tracefs, PROGRAM, "trace", "busy", "--linux", "--for", "1", *options], cwd=self.folder,
                              env=self.environment, capture_output=True, text=True, timeout=600, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
