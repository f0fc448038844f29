"""The line of progress of a first build: what it says at which time, and that it comes out at once."""

import io
import os
import pathlib
import pty
import subprocess
import sys
import unittest

TOOLS = pathlib.Path(__file__).resolve().parents[3] / "tools"
sys.path.insert(0, str(TOOLS))
from build_progress import COLUMNS, EVERY_S, Progress, Screen  # noqa: E402


class Words(unittest.TestCase):
    def after(self, *lines, began=0.0, now=0.0):
        progress = Progress(began)
        for line in lines:
            progress.take(line, began)
        return progress.line(now)

    def test_it_has_a_bar_a_count_and_what_is_left(self):
        self.assertEqual(self.after("[86/171] Building x", now=150), "Building once  [##########----------]  86 of 171  about 3 min left")
        self.assertEqual(self.after("[150/171] Building x", now=150), "Building once  [#################---]  150 of 171  about 25 s left")
        self.assertEqual(self.after("[171/171] Linking x", now=150), "Building once  [####################]  171 of 171")

    def test_it_guesses_nothing_from_too_little(self):
        self.assertEqual(self.after("[4/171] x", now=60), "Building once  [--------------------]  4 of 171")
        self.assertEqual(self.after("[40/171] x", now=4), "Building once  [####----------------]  40 of 171")
        self.assertEqual(self.after("[6/171] x", now=60), "Building once  [--------------------]  6 of 171")

    def test_what_is_left_is_counted_by_what_a_step_costs(self):
        """Twenty small steps first, then twenty large ones: half of the steps are a hundredth of the work."""
        link, unity = "Linking CXX static library a.a", "Building CXX object a.dir/Unity/unity_0_cxx.cxx.o"
        steps = [link] * 20 + [unity] * 20
        progress = Progress(0)
        for command in ("ar qc a.a a.dir/Unity/unity_0_cxx.cxx.o", "g++ -o a.dir/Unity/unity_0_cxx.cxx.o -c /b/a.dir/Unity/unity_0_cxx.cxx"):
            for _ in range(20):
                self.assertFalse(progress.take("plan " + command, 0))
        left = {}
        for i, step in enumerate(steps, 1):
            now = 1.0 * min(i, 20) + 20.0 * max(0, i - 20)  # 420 s in all
            progress.take("[%d/40] %s" % (i, step), now)
            left[i] = progress.left_s(now)
        self.assertIsNone(left[20], "not 20 s, as of the steps")
        for i in (22, 30, 39):
            real = 20.0 * (40 - i)
            self.assertAlmostEqual(left[i], real, delta=0.55 * real)
        self.assertEqual(left[40], 0)
        # Another count than was planned: the plan is not of this build.
        progress.take("[20/400] x", 0)
        self.assertAlmostEqual(progress.left_s(100), 1900)

    def test_what_is_no_step_changes_nothing(self):
        progress = Progress(0)
        self.assertTrue(progress.take("[3/7] x", 1))
        for line in ("FAILED: x", "", "[x/7]", "  [4/7] in a compiler's message", "\x1b[31m"):
            self.assertFalse(progress.take(line, 1), line)
        self.assertIn("3 of 7", progress.line(1))

    def test_a_second_run_of_ninja_is_measured_anew(self):
        progress = Progress(0)
        progress.take("[2/2] Re-running CMake", 100)
        progress.take("[0/171] x", 100)
        progress.take("[57/171] x", 130)
        self.assertIn("about 60 s left", progress.line(130))

    def test_it_says_what_else_is_done(self):
        self.assertEqual(self.after(), "Building: it begins ...")
        self.assertEqual(self.after("[7/7] x", "== the page"), "Building: the page ...")

    def test_the_end_is_said_only_of_what_was_built(self):
        progress = Progress(0)
        self.assertEqual(progress.end(3), "")
        progress.take("[0/1] Re-checking globbed directories...", 0)
        self.assertEqual(progress.end(3), "")
        progress.take("[171/171] x", 331)
        self.assertEqual(progress.end(331), "Built in 5 min 31 s.")

    def test_no_line_is_wider_than_the_screen(self):
        self.assertLess(len(self.after("[99999/999999] x", now=9e6)), COLUMNS)


class Screens(unittest.TestCase):
    def shown(self, terminal, instants):
        """What is written, when there is something new at each of the instants (in s)."""
        out, progress = io.StringIO(), Progress(0)
        screen = Screen(out, terminal, 0)
        progress.take("[20/40] x", 0)
        for now in instants:
            screen.show(progress, now, changed=True)
        screen.end(progress, 100)
        return out.getvalue()

    def test_a_terminal_gets_one_line_over_and_over(self):
        shown = self.shown(True, (1, 2))
        self.assertEqual(shown.count("\r"), 3)
        self.assertEqual(shown.count("\033[K"), 3)
        self.assertTrue(shown.endswith("\r\033[KBuilt in 1 min 40 s.\n"))
        self.assertEqual(shown.count("\n"), 1)

    def test_on_a_terminal_the_time_goes_on_without_a_step(self):
        out = io.StringIO()
        screen = Screen(out, True, 0)
        screen.show(Progress(0), 0.2, changed=False)
        self.assertEqual(out.getvalue(), "")
        screen.show(Progress(0), 1.2, changed=False)
        self.assertIn("it begins", out.getvalue())

    def test_a_file_gets_a_plain_line_every_thirty_seconds(self):
        shown = self.shown(False, range(0, 100))
        self.assertEqual(shown.splitlines(), ["Building: 20 of 40 after %s, about %s left" % at for at in (
            ("30 s", "30 s"), ("1 min 0 s", "60 s"), ("1 min 30 s", "2 min"))] + ["Built in 1 min 40 s."])
        self.assertEqual(EVERY_S, 30)


class Process(unittest.TestCase):
    def test_what_it_says_is_seen_while_the_build_goes_on(self):
        """On a terminal, before the input has ended: a buffer in between would keep it."""
        ours, theirs = pty.openpty()
        process = subprocess.Popen([sys.executable, "-B", TOOLS / "build_progress.py"], stdin=subprocess.PIPE, stderr=theirs)
        os.close(theirs)
        self.addCleanup(process.wait)
        self.addCleanup(process.stdin.close)
        process.stdin.write(b"[37/175] Building CXX object\n")
        process.stdin.flush()
        seen = b""
        while b"37 of 175" not in seen:
            seen += os.read(ours, 4096)  # fails when the process ends first
        os.close(ours)


if __name__ == "__main__":
    unittest.main(verbosity=2)
