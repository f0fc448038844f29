"""The Arduino IDE's builder makes the same program as qduino; its pane shows the verdict; its uploader a refusal and its reason."""

import os
import stat
import subprocess
import unittest

from ide_builder import IdeBuilder, builder_place, clean_environment
from sketch_case import PROGRAM, SketchCase

# What an Arduino does and a plain compiler here does not: a `long` of 32 bits, ARDUINO, a function
# before it is written, in another tab, and a global that the C library has as well.
MINE = """
#include <Shift.h>
#include "beside.h"
uint8_t clock[2] = {3, 4};
void setup() {
  Serial.begin(9600);
  Serial.println(sizeof(long));
  Serial.println(ARDUINO);
  Serial.println(sum(clock[0], BESIDE));
  Serial.println(sign_of(0xFFFFFFFFul));
}
void loop(1, 30, 100, 0) { waitForNextPeriod(); }
void loop(2, 20ms, 200ms, 0) { waitForNextPeriod(); }
"""
LIBRARY = {"library.properties": "name=Shift\nversion=1.0.0\nauthor=us\nmaintainer=us\ncategory=Other\ndot_a_linkage=true\n", "src/Shift.h": "long sign_of(unsigned long bits);\n",
           "src/Shift.cpp": "#include <Arduino.h>\n#include <Shift.h>\nlong sign_of(unsigned long bits) { return (long)bits; }\n"}
SAID = "4\n10819\n7\n-1\n"


@unittest.skipUnless(builder_place(), "Debian's arduino-builder is not here")
class Ide(SketchCase):
    def setUp(self):
        super().setUp()
        self.environment = dict(clean_environment(self.folder / "cache"), CXXFLAGS="-O0")
        self.ide = IdeBuilder(PROGRAM, self.folder / "Arduino", self.environment)
        self.build = self.folder / "build"

    def made(self, sketch, libraries=()):
        done = self.ide.build(sketch, self.build, libraries)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done

    def test_a_program_of_the_ide_does_what_qduinos_does(self):
        self.ide.install("--to", "pi@there")
        sketch = self.write("Mine/Mine.ino", MINE)
        self.write("Mine/second.ino", "int sum(int a, int b) { return a + b; }\n")
        self.write("Mine/beside.h", "#define BESIDE 4\n")
        for name, text in LIBRARY.items():
            self.write("libraries/Shift/" + name, text)
        done = self.made(sketch, [self.folder / "libraries"])
        self.assertIn("Verdict: Mine is admitted on 2 cores: 2 VCPUs.", done.stderr)
        self.assertRegex(done.stdout, r"Sketch uses \d{6,} bytes")
        for program in ("Mine-sim", "Mine-linux"):
            ran = subprocess.run([self.build / program, "--for", "1", *(["--best-effort"] if program == "Mine-linux" else [])],
                                 capture_output=True, text=True, timeout=300, check=False, env=self.environment)
            self.assertEqual(ran.stdout.replace("\r", ""), SAID, ran.stderr)
        if os.environ.get("QDUINO_EMULATED"):
            # A library is not compiled again. (A sketch is: the builder writes its text anew.)
            [of_library] = self.build.glob("libraries/**/*.o")
            before = of_library.stat().st_mtime_ns
            self.made(sketch, [self.folder / "libraries"])
            self.assertEqual(of_library.stat().st_mtime_ns, before)

        # The other computer gets the sources, and the library that the IDE found.
        fake = self.write("ssh", "#!/bin/sh\necho \"$2\" >&2\ntar -tz | sort\n")
        fake.chmod(fake.stat().st_mode | stat.S_IXUSR)
        sent = self.ide.upload("to_pi_there", self.build, "Mine.ino", QDUINO_SSH=str(fake))
        self.assertEqual((sent.returncode, sent.stderr.splitlines()[-1]), (0, "pi@there"), sent.stderr)
        files = [line for line in sent.stdout.splitlines() if not line.endswith("/")]
        self.assertEqual(files, ["./Mine/Mine.ino", "./Mine/beside.h", "./Mine/libraries/Shift/library.properties",
                                 "./Mine/libraries/Shift/src/Shift.cpp", "./Mine/libraries/Shift/src/Shift.h", "./Mine/second.ino"])

        # A mistake is shown where it is.
        self.write("Mine/second.ino", "int sum(int a, int b) {\n  return a + c;\n}\n")
        wrong = self.ide.build(sketch, self.build, [self.folder / "libraries"])
        self.assertEqual(wrong.returncode, 1)
        self.assertRegex(wrong.stderr, r"second\.ino:2:\d+: error: .c. was not declared")

    def test_a_refusal_is_said_by_verify_and_ends_an_upload(self):
        self.ide.install()
        sketch = self.write("Greedy/Greedy.ino", "void setup() {}\nvoid loop(1, 60, 100, 0) {}\nvoid loop(2, 60, 100, 0) {}\n")
        done = self.made(sketch)  # another computer may admit it
        self.assertIn("loop 2 (60 ms in 100 ms) is refused on core 0", done.stderr)
        self.assertIn("An upload to a computer like this would be refused.", done.stderr)
        refused = self.ide.upload("here", self.build, "Greedy.ino")
        self.assertEqual(refused.returncode, 2)
        self.assertIn("loop 2 (60 ms in 100 ms) is refused on core 0", refused.stdout)
        self.assertIn("Verdict: Greedy is REFUSED, and was not started.\n", refused.stderr)

    def test_the_board_is_removed(self):
        self.ide.install()
        self.assertTrue((self.folder / "Arduino" / "hardware" / "qduino").exists())
        self.run_qduino("ide", "remove", self.folder / "Arduino")
        self.assertFalse((self.folder / "Arduino" / "hardware" / "qduino").exists())
        self.assertIn("platform.txt", self.run_qduino("ide", "link", "x", status=1).stderr)
        self.run_qduino("ide", "fly", status=105)


if __name__ == "__main__":
    unittest.main()
