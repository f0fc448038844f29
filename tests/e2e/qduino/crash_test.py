"""A sketch that crashes says in which loop and line, why, and what to do: in the simulator and on Linux."""

import unittest

from sketch_case import SketchCase

# The case comes in the environment: one sketch, compiled once. Each crash stands on a line of its
# own.
SKETCH = """\
const int which = atoi(getenv("CRASH_CASE"));
volatile int zero = 0;
int *volatile nowhere = nullptr;
volatile int sink;
int down(int n) {
  volatile char room[2000]; room[n % 2000] = n; return down(n + 1) + room[3];
}
void fail() {
  if (which == 1) sink = 100 / zero;
  if (which == 2) *nowhere = 3;
  if (which == 3) sink = down(1);
  if (which == 4) abort();
  if (which == 5) *(nowhere + 1000000000L) = 3;
}
void setup() {
  Serial.begin(9600);
  Serial.println("begun");
  pinMode(13, OUTPUT);
  safeState(13, LOW);
  if (which < 0) fail();
}
void loop(2, 10, 100, 0) { if (which > 0) fail(); }
"""
CASES = ((1, 9, "it divides by zero", 8), (2, 10, "it follows a null pointer", 11), (3, 6, "its stack is full", 11),
         (4, 12, "gave up with abort", 6), (5, 13, "memory that is not there", 11))


class Crash(SketchCase):
    def test_the_line_and_the_cause_are_named(self):
        self.write("crash/crash.ino", SKETCH)
        self.run_qduino("build", "crash")
        for case, line, why, signal in CASES:
            with self.subTest(case=case, board="sim"):
                done = self.run_qduino("sim", "crash", "--for", "1", status=1, CRASH_CASE=str(case))
                self.assertRegex(done.stderr, r"Verdict: loop 2 died at (\S+, called at )?crash\.ino:%d \(SIG\w+\): .*%s" % (line, why))
                self.assertEqual(done.stdout, "begun\n", "what it had said is not lost")
            with self.subTest(case=case, board="linux"):
                done = self.run_qduino("run", "crash", "--best-effort", "--for", "5", status=128 + signal, CRASH_CASE=str(case))
                self.assertRegex(done.stderr, r"Verdict: loop 2 died at (\S+, called at )?crash\.ino:%d \(SIG\w+\): .*%s" % (line, why))
                self.assertIn("forced to safe states", done.stderr)


if __name__ == "__main__":
    unittest.main()
