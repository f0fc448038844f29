"""No test leaves a real-time task behind, whoever of those who started it is killed, and when.

As ./test does: bash starts ctest, ctest starts the guarded test, and that starts a sketch that owns a core, its supervisor and a task that
spins in front of it. One of them is killed at a moment that nobody chose. All of it is bounded by itself as well: the sketch ends after
20 s, the spinner after 5.
"""

import json
import os
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import guarded  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD, ROUNDS, PATIENCE_S = sys.argv.pop(1), 12, 30


def wait_until(condition, what, timeout_s=PATIENCE_S):
    until = time.monotonic() + timeout_s
    while not (value := condition()):
        if time.monotonic() > until:
            raise AssertionError("in vain for %d s: %s" % (timeout_s, what))
        time.sleep(0.02)
    return value


def parent_of(pid):
    with open("/proc/%d/stat" % pid, encoding="utf-8", errors="replace") as file:
        return int(file.read().rsplit(")", 1)[1].split()[1])


def line_of(pid):
    """The command line of a process; empty when it has ended."""
    try:
        with open("/proc/%d/cmdline" % pid, "rb") as file:
            return file.read().replace(b"\0", b" ").decode(errors="replace")
    except OSError:
        return ""


class Guard(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.mark = "guard-test.%d.%d" % (os.getpid(), time.monotonic_ns())
        self.environment = dict(os.environ, GTEST_FILTER="Dying.*", GTEST_REPEAT="40")
        self.environment[guarded.MARK] = ":".join(filter(None, (os.environ.get(guarded.MARK), self.mark)))
        self.addCleanup(guarded.bury, self.mark)

    def left(self):
        return guarded.real_time_tasks(guarded.marked(self.mark))

    def command_of(self, name):
        """As the build starts a test."""
        shown = subprocess.run(["ctest", "--test-dir", BUILD, "--show-only=json-v1", "-R", "^%s$" % name], capture_output=True, text=True, check=True)
        return json.loads(shown.stdout)["tests"][0]["command"]

    def chain(self, command):
        """bash, ctest (by the function that ./test has) and the test; in a build folder of its own, whose log is nobody's."""
        words = " ".join('"%s"' % word for word in command)
        (self.folder / "CTestTestfile.cmake").write_text("add_test(such %s)\n" % words, encoding="utf-8")
        script = "cd '%s'; . tools/dependencies.sh; run_ctest --test-dir '%s' >/dev/null 2>&1; true" % (ROOT, self.folder)
        return subprocess.Popen(["bash", "-c", script], env=self.environment)

    def ancestors(self, pid, top):
        """From the process to `top`, both of them."""
        line = [pid]
        while line[-1] != top and line[-1] > 1:
            line.append(parent_of(line[-1]))
        return line

    def test_nothing_is_left_whoever_is_killed_and_when(self):
        if os.geteuid() != 0 or os.cpu_count() < 2:
            self.skipTest("needs root and two cores")
        command = self.command_of("scenario-real-host")
        seed = random.randrange(1 << 32)
        generator = random.Random(seed)
        for round_number in range(ROUNDS):
            with self.subTest(seed=seed, round=round_number):
                shell = self.chain(command)
                self.addCleanup(shell.wait)
                self.addCleanup(shell.kill)
                wait_until(self.left, "the test has a real-time task")
                time.sleep(generator.uniform(0, 1))
                # The victim is bash, ctest, the test's guard or the test itself, whichever live.
                tests = [pid for pid in guarded.marked(self.mark) if line_of(pid).startswith(command[-2])]
                above = self.ancestors(tests[0], shell.pid) if tests else [shell.pid]
                victim = generator.choice(above)
                name = line_of(victim)
                os.kill(victim, signal.SIGKILL)
                wait_until(lambda: not self.left(), "no real-time task is left after the end of %s" % name)
                wait_until(lambda: not guarded.marked(self.mark), "nothing at all is left after the end of %s" % name)
                shell.wait()

    def test_a_test_that_ends_well_takes_what_it_left_with_it(self):
        leaves = "import subprocess, sys; subprocess.Popen(['sleep', '600'], start_new_session=True); print('said'); sys.exit(7)"
        done = subprocess.run([sys.executable, guarded.__file__, sys.executable, "-c", leaves], env=self.environment, capture_output=True, text=True,
                              timeout=60, check=False)
        self.assertEqual((done.returncode, done.stdout, done.stderr), (7, "said\n", ""))
        self.assertEqual(guarded.marked(self.mark), [])

    def test_its_status_is_the_tests(self):
        for script, status in (("raise SystemExit(0)", 0), ("import os; os.abort()", 128 + signal.SIGABRT)):
            done = subprocess.run([sys.executable, guarded.__file__, sys.executable, "-c", script], timeout=60, check=False)
            self.assertEqual(done.returncode, status)
        none = subprocess.run([sys.executable, guarded.__file__, "/no/such/program"], capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual((none.returncode, none.stderr), (127, "/no/such/program: No such file or directory\n"))


if __name__ == "__main__":
    unittest.main(verbosity=2)
