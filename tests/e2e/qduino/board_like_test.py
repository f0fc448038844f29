"""The simulator as a board: Serial takes its time, an interrupt may go and come, the board's own loops alarm nobody, and a run ends when it
is to. One sketch, compiled once; its case comes in the environment."""

import os
import re
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

from sketch_case import SketchCase

SKETCH = """\
const int which = atoi(getenv("BOARD_CASE"));
volatile int pulses;
volatile unsigned long work;

void count() { pulses = pulses + 1; }
void other() {}

void setup() {
  Serial.begin(which == 5 ? 2000000 : 9600);
  pinMode(2, OUTPUT);
  pinMode(8, OUTPUT);
  attachInterrupt(digitalPinToInterrupt(2), count, FALLING);
}

void flow() {
  for (int i = 0; i < 10; i++) { digitalWrite(2, HIGH); delay(5); digitalWrite(2, LOW); delay(5); }
  detachInterrupt(digitalPinToInterrupt(2));
  Serial.println(pulses);
  pulses = 0;
  attachInterrupt(digitalPinToInterrupt(2), count, FALLING);
  delay(500);
}

void loop() {
  if (which == 1) Serial.println(millis());              // no delay at all
  if (which == 2) flow();
  if (which == 3) { attachInterrupt(digitalPinToInterrupt(2), other, FALLING); delay(100); }
  if (which == 4) { tone(8, 440, 200); delay(500); noTone(8); delay(100); }
  if (which == 5) Serial.println("a line for somebody who does not read");
  if (which == 6) { for (unsigned long i = 0; i < 4000; i++) work = work + i; digitalRead(3); }
  if (which == 7) { Serial.println("something"); delay(1); }
  if (which == 8) { tone(8, 440); delay(1000); }
}
"""


class BoardLike(SketchCase):
    program = None

    def setUp(self):
        super().setUp()
        if BoardLike.program is None:
            self.write("board/board.ino", SKETCH)
            self.run_qduino("build", "board", "--only", "sim", "--output", "made")
            kept = tempfile.TemporaryDirectory()
            self.addClassCleanup(kept.cleanup)
            BoardLike.program = shutil.copy2(self.folder / "made" / "board-sim", kept.name)

    def environment_of(self, case):
        return dict(self.environment, BOARD_CASE=str(case))

    def run_case(self, case, *options, status=0, **how):
        how = {"stdout": subprocess.PIPE, **how}
        done = subprocess.run([self.program, *options], env=self.environment_of(case), stdin=subprocess.DEVNULL, stderr=subprocess.PIPE,
                              text=True, timeout=120, check=False, **how)
        self.assertEqual(done.returncode, status, done.stderr)
        return done

    def start(self, case, *options, **how):
        started = subprocess.Popen([self.program, *options], env=self.environment_of(case), stdin=subprocess.DEVNULL,
                                   stderr=subprocess.PIPE, text=True, **how)
        self.addCleanup(started.kill)
        return started

    def test_a_sketch_without_a_delay_prints_no_more_than_the_wire_takes(self):
        done = self.run_case(1, "--for", "10")
        self.assertIn(len(done.stdout.replace("\n", "\r\n")), range(9500, 9700), "960 bytes in each second")
        self.assertRegex(done.stderr, r"Serial at 9600 baud had no room for \d+\.\d+ s: loop 1 waited")

    def test_a_handler_that_setup_attached_may_go_and_come(self):
        self.assertEqual(self.run_case(2, "--for", "3").stdout.split(), ["10"] * 5)

    def test_another_handler_is_refused_by_a_word(self):
        self.assertIn("takes back the handler that setup() attached", self.run_case(3, "--for", "1").stderr)

    def test_a_tone_is_no_missed_period(self):
        for case in (4, 8):
            errors = self.run_case(case, "--for", "7").stderr
            self.assertIn("every period was kept", errors)
            for alarm in ("undeclared", "OVERRUN", "has not ended"):
                self.assertNotIn(alarm, errors)

    def test_output_that_is_lost_is_a_status(self):
        with open("/dev/full", "wb") as full:
            errors = self.run_case(7, "--for", "2", status=1, stdout=full).stderr
        self.assertIn("what the sketch wrote to standard output is lost: No space left on device", errors)
        closed = self.run_case(7, "--for", "2", status=1, stdout=None, preexec_fn=lambda: os.close(1)).stderr
        self.assertIn("is lost: Bad file descriptor", closed)

    def test_a_reader_that_has_gone_lost_nothing(self):
        run = self.start(7, "--for", "20", stdout=subprocess.PIPE)
        run.stdout.readline()
        run.stdout.close()
        errors = run.stderr.read()
        run.stderr.close()
        self.assertEqual(run.wait(60), 0, errors)
        self.assertNotIn("lost", errors)

    def ends(self, run, number):
        time.sleep(1)
        run.send_signal(number)
        _, errors = run.communicate(timeout=20)
        return errors

    def test_a_signal_ends_whatever_it_does(self):
        self.assertIn("Verdict: board: every period was kept", self.ends(self.start(6, "--for", "1e9", stdout=subprocess.DEVNULL),
                                                                         signal.SIGTERM))
        self.assertIn("Verdict: board", self.ends(self.start(1, "--for", "1e9", "--speed", "1", stdout=subprocess.DEVNULL), signal.SIGINT))

    def test_a_signal_ends_one_that_waits_for_its_reader(self):
        inlet, outlet = os.pipe()
        self.addCleanup(os.close, inlet)
        run = self.start(5, "--for", "1e9", stdout=outlet)
        os.close(outlet)
        self.assertIn("Verdict: ", self.ends(run, signal.SIGTERM))

    def orphan(self, *before):
        """The number of a run whose parent has been killed."""
        parent = subprocess.Popen(["sh", "-c", 'trap "" INT; "$@" >/dev/null 2>&1 & echo $!; wait', "sh", *before, self.program, "--for", "1e9",
                                   "--speed", "1"], env=self.environment_of(7), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True)
        number = int(parent.stdout.readline())
        time.sleep(1)
        parent.kill()
        parent.communicate()
        return number

    @staticmethod
    def lives(number):
        try:
            with open("/proc/%d/stat" % number, encoding="utf-8") as stat:
                return not re.search(r"\) [ZX] ", stat.read())
        except FileNotFoundError:
            return False

    def test_a_run_ends_with_its_parent_unless_nohup_says_otherwise(self):
        number = self.orphan()
        limit = time.monotonic() + 20
        while self.lives(number) and time.monotonic() < limit:
            time.sleep(0.1)
        self.assertFalse(self.lives(number))
        kept = self.orphan("nohup")
        try:
            time.sleep(1)
            self.assertTrue(self.lives(kept))
        finally:
            os.kill(kept, signal.SIGKILL)


if __name__ == "__main__":
    unittest.main()
