"""qduino and the other programs on a terminal of 80 columns: no line is longer, each command ends with its verdict, a wrong word is answered
with the right one, and what the sketch prints stands in its place."""

import fcntl
import os
import pathlib
import pty
import re
import select
import signal
import struct
import subprocess
import sys
import tempfile
import termios
import time
import unittest

PROGRAM = os.path.abspath(sys.argv.pop(1))
PROGRAMS = os.path.dirname(PROGRAM)
COLUMNS = 80
COMMANDS = ["new", "build", "run", "sim", "check", "trace", "profile", "doctor", "restore", "completion"]
OTHERS = ["printd", "printer", "printer-name", "printer-port", "printer-sim", "virtual-machine", "qduino-supervisor"]
LATE = """
void setup() {}
void loop(1, 2, 10, 0) { delayBusyMicroseconds(15000); waitForNextPeriod(); }
"""
TALKER = """
void setup() {
  Serial.begin(9600);
  Serial.println("setup speaks");
}
void loop(1, 1, 50, 0) {
  static int n = 0;
  Serial.print(n == 0 ? "first" : ", next");
  ++n;
  waitForNextPeriod();
}
"""
REFUSED = """
void setup() {}
void loop(1, 60, 100, 0) { waitForNextPeriod(); }
void loop(2, 41, 100, 0) { waitForNextPeriod(); }
"""
ALONE_ON_ITS_CORE = """
void setup() {}
void loop(1, 100us, 100us, 1) { waitForNextPeriod(); }
void loop(2, 12345us, 123456us, 0) { waitForNextPeriod(); }
"""


def on_terminal(command, folder, environment, timeout_s=600, until=None, colours=False):
    """(status, lines) of a program whose standard streams are a terminal of 80 columns. Ctrl-C ends it when it has printed `until`."""
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 24, COLUMNS, 0, 0))
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=slave, stderr=slave, cwd=folder, env=environment)
    os.close(slave)
    text, end = b"", time.monotonic() + timeout_s
    while True:
        if not select.select([master], [], [], 1)[0]:
            if time.monotonic() > end:
                process.kill()
                raise AssertionError("%s did not end; so far: %s" % (command, text.decode(errors="replace")))
            continue
        try:
            piece = os.read(master, 65536)
        except OSError:  # nobody has it open any more
            break
        if not piece:
            break
        text += piece
        if until and until in text:
            process.send_signal(signal.SIGINT)
            until = None
    os.close(master)
    shown = text.decode(errors="replace")
    if not colours:
        shown = re.sub(r"\x1b\[[0-9;]*[mK]", "", shown)
    return process.wait(), re.sub(r"\r+\n", "\n", shown).split("\n")[:-1]  # println ends with \r\n, as an Arduino's does


class Terminal(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.held = tempfile.TemporaryDirectory(prefix="q")
        cls.folder = pathlib.Path(cls.held.name)
        cls.environment = dict(os.environ, XDG_CACHE_HOME=str(cls.folder), TERM="xterm")
        for name in ("QDUINO_HOME", "CXX", "CC", "CXXFLAGS", "CFLAGS", "LDFLAGS"):
            cls.environment.pop(name, None)
        for name, content in {"late": LATE, "talker": TALKER, "refused": REFUSED, "alone": ALONE_ON_ITS_CORE}.items():
            (cls.folder / name).mkdir()
            (cls.folder / name / (name + ".ino")).write_text(content, encoding="utf-8")

    @classmethod
    def tearDownClass(cls):
        cls.held.cleanup()

    def program(self, name, *arguments, status=0, until=None):
        ended, lines = on_terminal([os.path.join(PROGRAMS, name), *arguments], self.folder, self.environment, until=until)
        self.assertEqual(ended, status, "\n".join(lines))
        for line in lines:
            self.assertLessEqual(len(line), COLUMNS, "%s %s: %s" % (name, arguments, line))
        return lines

    def qduino(self, *arguments, status=0):
        return self.program("qduino", *arguments, status=status)

    def run_until_it_has_spoken(self):
        """The talker on Linux, ended when its second pass has printed: on a busy machine nobody knows when that is."""
        return self.program("qduino", "run", "talker", "--best-effort", until=b", next")

    def assert_verdict(self, lines, pattern):
        self.assertRegex(lines[-1], "^Verdict: " + pattern)
        self.assertEqual(sum(line.startswith("Verdict: ") for line in lines), 1, lines)

    def test_each_command_ends_with_its_verdict(self):
        self.assert_verdict(self.qduino("build", "late", "--only", "sim"), r"late is built: 3 steps\.$")
        self.assert_verdict(self.qduino("build", "late", "--only", "sim"), r"late is up to date\.$")
        self.assert_verdict(self.qduino("check", "late"), r"late is admitted on 2 cores: 1 VCPU\.$")
        self.assert_verdict(self.qduino("check", "refused", status=2), r"refused is REFUSED on 2 cores: loop 2\.$")
        self.assert_verdict(self.qduino("sim", "refused", status=2), r"refused is REFUSED: no loop of it ran\.$")
        self.assert_verdict(self.qduino("sim", "late", "--for", "1"), r"late: \d+ OVERRUNs \(1 loop, \d+ releases\)\.$")
        self.assert_verdict(self.qduino("sim", "talker", "--for", "0.4"), r"talker: every period was kept \(1 loop, \d+ releases\)\.$")
        self.assert_verdict(self.qduino("trace", "talker", "--for", "0.4"), r"talker: every period was kept")

    def test_a_run_on_linux_ends_with_its_verdict(self):
        lines = self.run_until_it_has_spoken()
        self.assert_verdict(lines, r"talker ran to its end\.$")
        # A busy machine can hold a loop up that has no priority. Then the line goes on with which
        # loop, and for how long.
        kept = r"Periods: (every period was kept|NOT every period was kept|\d+ OVERRUNs?) \(1 loop, \d+ releases?\)[.;]"
        self.assertTrue(any(re.match(kept, line) for line in lines), lines)
        self.assert_verdict(self.qduino("run", "refused", "--best-effort", status=2), r"refused is REFUSED: no loop of it ran\.$")

    def test_doctor_ends_with_its_verdict(self):
        ended, lines = on_terminal([PROGRAM, "doctor"], self.folder, self.environment)
        self.assertIn(ended, (0, 1))
        self.assertLessEqual(max(map(len, lines)), COLUMNS, lines)
        self.assert_verdict(lines, r"(all \d+ are as they should be|.*could be better|.*missing)")

    def test_the_other_commands_fit_too(self):
        self.qduino("new", "fresh")
        self.assertIn("exists already", " ".join(self.qduino("new", "fresh", status=1)))
        self.qduino("restore", "--state", str(self.folder / "none"))
        self.qduino("build", "nowhere", status=1)
        self.qduino("check", "alone")
        self.qduino("sim", "alone", "--for", "1")
        wrong = self.folder / "wrong.toml"
        wrong.write_text("[sim]\nclock = 3\n", encoding="utf-8")
        said = self.qduino("sim", "late", "--board", str(wrong), status=1)
        self.assertIn("'clock' is not known; accepted: cores, seed", " ".join(" ".join(said).split()))
        self.assertGreater(len(said), 1, "a long message is wrapped")

    def test_numbers_are_in_units_for_people(self):
        for command in (("sim", "late", "--for", "1"), ("run", "talker", "--best-effort", "--for", "0.3")):
            text = "\n".join(self.qduino(*command))
            self.assertNotRegex(text, r"\d{4,} ?(ns|us)\b", command)
            self.assertRegex(text, r"\d (ms|us)\b")

    def test_what_the_sketch_prints_stands_in_its_place(self):
        for lines in (self.qduino("sim", "talker", "--for", "0.4"), self.run_until_it_has_spoken()):
            spoken = [i for i, line in enumerate(lines) if line == "setup speaks"]
            said = [i for i, line in enumerate(lines) if re.fullmatch(r"first(, next)+", line)]
            table = next(i for i, line in enumerate(lines) if line.startswith("loop ") and "passes" in line)
            self.assertEqual((len(spoken), len(said)), (1, 1), lines)
            self.assertLess(spoken[0], said[0])
            self.assertLess(said[0], table)
            self.assertIn("release latency", lines[said[0] + 1], "the report begins on a line of its own")

    def test_outcomes_have_colours_unless_nobody_wants_them(self):
        command = [PROGRAM, "check", "refused"]
        shown = "\n".join(on_terminal(command, self.folder, self.environment, colours=True)[1])
        self.assertIn("\x1b[38;5;160mREFUSED\x1b[0m", shown)
        self.assertRegex(shown, "\x1b\\[38;5;32m  loop 1 +\x1b")
        plain = on_terminal(command, self.folder, {**self.environment, "NO_COLOR": "1"}, colours=True)[1]
        self.assertNotIn("\x1b", "\n".join(plain))
        piped = subprocess.run(command, cwd=self.folder, env=self.environment, capture_output=True, text=True, check=False)
        self.assertNotIn("\x1b", piped.stdout + piped.stderr)

    def test_alone_it_shows_its_help(self):
        alone = self.qduino()
        self.assertEqual(alone, self.qduino("--help"))
        self.assertIn("Subcommands:", alone)

    def test_every_help_page_fits(self):
        for command in COMMANDS:
            self.assertIn("--help", "\n".join(self.qduino(command, "--help")))
        for name in OTHERS:
            self.assertIn("--help", "\n".join(self.program(name, "--help")), name)

    def test_a_wrong_word_is_answered_with_the_right_one(self):
        for wrong, right in {"bulid": "build", "docter": "doctor", "chek": "check", "comp": "completion"}.items():
            self.assertIn("Did you mean 'qduino %s'?" % right, "\n".join(self.qduino(wrong, status=109)))
        self.assertNotIn("Did you mean", "\n".join(self.qduino("print", status=109)))
        for command, wrong, right in [("sim", "--fro", "--for"), ("check", "--jason", "--json"), ("build", "--ouput=x", "--output"),
                                      ("run", "--best-efort", "--best-effort")]:
            said = "\n".join(self.qduino(command, "late", wrong, status=109))
            self.assertIn("no such option: " + wrong.split("=")[0], said)
            self.assertIn("Did you mean %s?" % right, said)
        self.assertIn("Did you mean --version?", "\n".join(self.qduino("--versoin", status=109)))
        for name, wrong, right, status in [("printd", "--sate", "--state", 2), ("printer", "--lnik", "--link", 109),
                                           ("printer-sim", "--sped", "--speed", 109), ("virtual-machine", "--pin", "--pins", 109),
                                           ("qduino-supervisor", "--restrat", "--restart", 109)]:
            said = "\n".join(self.program(name, wrong, "x", status=status))
            self.assertIn("Did you mean %s?" % right, said, name)


if __name__ == "__main__":
    unittest.main(verbosity=2)
