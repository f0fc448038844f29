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
HEADERS = ("Arduino_CAN.h", "Ethernet.h", "SD.h")
SKETCH = "".join(f"#include <{name}>\n" for name in HEADERS) + """\
volatile bool flag = false;
bool plain = false;
const int which = atoi(getenv("SPIN_CASE"));

EthernetServer server(0);
EthernetClient client;
EthernetUDP udp;
File file;
unsigned long turns = 0;

// What a loop asks the host's system for, in vain.
bool ask(int number) {
  if (number == 40) return server.available();
  if (number == 41) return server.accept();
  if (number == 42) return client.connect("127.0.0.1", 1);
  if (number == 43) return client.read() >= 0;
  if (number == 44) return udp.parsePacket() != 0;
  if (number == 45) return Ethernet.localIP() == INADDR_NONE;
  if (number == 46) return CAN.available() != 0;
  if (number == 47) return file.available() != 0;
  if (number == 48) return SD.exists("never");
  if (number == 49) return Serial1.read() >= 0;
  return Serial.available() != 0;
}

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
  if (number >= 40 && number < 60)
    while (!ask(number));
  while (number >= 60) {  // a classic loop
    if (ask(number - 20) || millis() > 900) break;
    turns++;
  }
}

void setup() {
  while (!Serial);
  Serial.begin(9600);
  if (which >= 40) {
    Serial1.begin(9600);
    server.begin();
    udp.begin(0);
    SD.begin();
    file = SD.open("empty", FILE_WRITE);
  }
  Serial.println("ready");
  if (which >= 10 && which < 20) spin(which - 10);
  if (which == 20) while (true) delay(10);
  pinMode(7, OUTPUT);
  attachInterrupt(7, which == 30 ? spin_here : set_flag, RISING);
}

void loop(1, 20, 100, 0) {
  spin(which);
  Serial.println(which >= 60 ? String(turns).c_str() : "on");
  delay(400);
}

void loop(2, 1, 50, 0) {
  static int beats = 0;
  if (++beats == 11) digitalWrite(7, HIGH);
  waitForNextPeriod();
}
"""
FIRST = 1 + SKETCH.splitlines().index("  if (number == 1)")
LINES = {number: FIRST + 1 + 2 * index for index, number in enumerate((1, 2, 3, 4, 5, "host"))}
HANDLER = 1 + SKETCH.splitlines().index("  while (true);")
HOST = range(40, 51)  # the cases of ask()


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
        done = subprocess.run([self.program, *options], env=dict(self.environment, SPIN_CASE=str(case), QDUINO_SD=str(self.folder)),
                              stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=300, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done

    def test_a_loop_that_spins_ends_at_its_time_and_is_named(self):
        for case in (1, 2, 4, 5):
            done = self.run_case(case, "--for", "10")
            self.assertIn(f"Verdict: spin: loop 1 spins at spin.ino:{LINES[case]}, since 0 ns; ", done.stderr)
            self.assertRegex(done.stderr, r"\n {3}2 +20[01] +20[01] +0 ", f"case {case}: loop 2 keeps its periods")
            self.assertEqual(done.stdout.split(), ["ready"])

    def test_a_question_to_the_host_over_and_over_ends_and_is_named(self):
        for case in HOST:
            done = self.run_case(case, "--for", "10")
            self.assertRegex(done.stderr, rf"Verdict: spin: loop 1 spins at .*spin\.ino:\d+, since 0 ns; (NOT )?every period was kept", f"case {case}")

    def test_a_classic_loop_asks_the_host_no_more_than_it_can_answer(self):
        for case in (40, 48, 50):
            turns = int(self.run_case(case + 20, "--for", "1").stdout.split()[1])
            self.assertLess(turns, 200_000, f"case {case}")
            self.assertGreater(turns, 1_000)

    def test_a_handler_ends_a_spin_where_it_sets_the_flag(self):
        done = self.run_case(3, "--for", "1")
        self.assertNotIn("spins at", done.stderr)
        self.assertIn(f"loop 1 ran on at spin.ino:{LINES[3]} ", done.stderr)
        self.assertIn("on", done.stdout)

    def test_a_handler_that_spins_uses_its_own_budget(self):
        done = self.run_case(30, "--for", "5")
        self.assertIn(f"a handler on io 33 spins at spin.ino:{HANDLER}, since 500 ms; every period was kept", done.stderr)

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
            _, errors = running.communicate(timeout=150)
            self.assertEqual(running.returncode, 0, errors)
            self.assertIn(f"spins at spin.ino:{LINES[case % 10]}", errors)

    def test_a_check_does_not_hang_in_setup(self):
        checked = subprocess.run([self.program, "--check"], env=dict(self.environment, SPIN_CASE="11"), capture_output=True, text=True,
                                 timeout=300, check=False)
        self.assertEqual(checked.returncode, 1, checked.stderr)
        self.assertIn("setup() does not end", checked.stderr)
        self.assertIn(f"it spins at spin.ino:{LINES[1]}", checked.stderr)


if __name__ == "__main__":
    unittest.main()
