"""A sketch that spins: its run ends at --for, at Ctrl-C and at SIGTERM, and says which line it was."""

import shutil
import signal
import subprocess
import tempfile
import time
import unittest

from sketch_case import SketchCase

# The case comes in the environment: one sketch, compiled once. Each spin stands on a line of its
# own.
SKETCH = """\
volatile bool flag = false;
bool plain = false;
const int which = atoi(getenv("SPIN_CASE"));

void set_flag() { flag = true; }
void spin_here() {
  while (true);
}

void spin(int number) {
  if (number == 1)
    while (true);
  if (number == 2)
    while (!Serial.available());
  if (number == 3)
    while (!flag);
  if (number == 4)
    while (!plain);
  if (number == 5)
    while (Serial.read() < 0);
}

void setup() {
  while (!Serial);
  Serial.begin(9600);
  Serial.println("ready");
  if (which >= 10 && which < 20) spin(which - 10);
  if (which == 20) while (true) delay(10);
  pinMode(7, OUTPUT);
  attachInterrupt(7, which == 30 ? spin_here : set_flag, RISING);
}

void loop(1, 20, 100, 0) {
  spin(which);
  Serial.println("on");
  delay(400);
}

void loop(2, 1, 50, 0) {
  static int beats = 0;
  if (++beats == 11) digitalWrite(7, HIGH);
  waitForNextPeriod();
}
"""
LINES = {number: index for number, index in zip(range(1, 6), (12, 14, 16, 18, 20))}


class Spins(SketchCase):
    program = None

    def setUp(self):
        super().setUp()
        if Spins.program is None:  # once for all
            self.write("spin/spin.ino", SKETCH)
            self.run_qduino("build", "spin", "--only", "sim", "--output", "made")
            kept = tempfile.TemporaryDirectory()
            self.addClassCleanup(kept.cleanup)
            Spins.program = shutil.copy2(self.folder / "made" / "spin-sim", kept.name)

    def run_case(self, case, *options):
        done = subprocess.run([self.program, *options], env=dict(self.environment, SPIN_CASE=str(case)), stdin=subprocess.DEVNULL,
                              capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done

    def test_a_loop_that_spins_ends_at_its_time_and_is_named(self):
        for case in (1, 2, 4, 5):
            done = self.run_case(case, "--for", "10")
            self.assertIn(f"Verdict: spin: loop 1 spins at spin.ino:{LINES[case]}, since 0 ns; ", done.stderr)
            self.assertRegex(done.stderr, r"\n {3}2 +20[01] +20[01] +0 ", f"case {case}: loop 2 keeps its periods")
            self.assertEqual(done.stdout.split(), ["ready"])

    def test_a_handler_ends_a_spin_where_it_sets_the_flag(self):
        done = self.run_case(3, "--for", "1")
        self.assertNotIn("spins at", done.stderr)
        self.assertIn(f"loop 1 ran on at spin.ino:{LINES[3]} ", done.stderr)
        self.assertIn("on", done.stdout)

    def test_a_handler_that_spins_uses_its_own_budget(self):
        done = self.run_case(30, "--for", "5")
        self.assertIn("a handler on io 33 spins at spin.ino:7, since 500 ms; every period was kept", done.stderr)

    def test_a_setup_that_spins_is_left_at_its_time_and_named(self):
        for case in (1, 2, 3, 4, 5):
            done = self.run_case(10 + case, "--for", "3")
            self.assertIn(f"Verdict: spin: setup() has not ended in 3 s: it spins at spin.ino:{LINES[case]}. No loop of it ran.",
                          done.stderr)
        self.assertIn("Verdict: spin: setup() has not ended in 3 s. No loop", self.run_case(20, "--for", "3").stderr)

    def test_the_same_spin_is_the_same_run(self):
        hashes = {self.run_case(case, "--for", "2").stderr.split("trace hash ")[1][:16] for case in (1, 3, 1, 3)}
        self.assertEqual(len(hashes), 2)

    def test_signals_end_it(self):
        for case, number in ((1, signal.SIGINT), (2, signal.SIGTERM), (4, signal.SIGTERM), (11, signal.SIGINT), (14, signal.SIGTERM)):
            running = subprocess.Popen([self.program, "--for", "1e8", "--speed", "1"], env=dict(self.environment, SPIN_CASE=str(case)),
                                       stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
            time.sleep(1)
            running.send_signal(number)
            _, errors = running.communicate(timeout=30)
            self.assertEqual(running.returncode, 0, errors)
            self.assertIn(f"spins at spin.ino:{LINES[case % 10]}", errors)

    def test_a_check_does_not_hang_in_setup(self):
        checked = subprocess.run([self.program, "--check"], env=dict(self.environment, SPIN_CASE="11"), capture_output=True, text=True,
                                 timeout=60, check=False)
        self.assertEqual(checked.returncode, 1, checked.stderr)
        self.assertIn("setup() does not end", checked.stderr)
        self.assertIn("it spins at spin.ino:12", checked.stderr)


if __name__ == "__main__":
    unittest.main()
