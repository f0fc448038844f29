"""Files that other printers have printed wrong in silence, by public reports of their users.

Each is a small program between a start and an end, with the place and the filament that it means:
by hand from its text, not by the printer or by the twin. Both must agree with that.
"""

import json
import os
import subprocess
import sys
import tempfile
import unittest

PROGRAM = sys.argv.pop(1)

START = "M140 S0\nM104 S205\nG28\nM109 S205\nG90\nM83\nG92 E0\nG1 Z5 F300\nG1 X30 Y30 F6000\nG1 Z0.3 F300\n"
END = "M104 S0\nG1 Z20 F300\nM84\n"
LONG = "Horizontal_mount_for_a_race_car_rear_wing_variant_B_v12_stl_id_0_copy_"


def two_objects(first, second):
    """The first is left out when half of it has been made; the second is whole: 1 + 2 mm."""
    return "".join("%s NAME=%s\n%s" % line for line in [
        ("EXCLUDE_OBJECT_DEFINE", first, ""), ("EXCLUDE_OBJECT_DEFINE", second, ""),
        ("EXCLUDE_OBJECT_START", first, "G1 X50 Y30 E1 F1200\n"), ("EXCLUDE_OBJECT", first, "G1 X30 Y30 E1\n"),
        ("EXCLUDE_OBJECT_END", first, ""),
        ("EXCLUDE_OBJECT_START", second, "G1 X100 Y30 F6000\nG1 X120 Y30 E1 F1200\nG1 X100 Y30 E1\n"),
        ("EXCLUDE_OBJECT_END", second, "")])


LAST_OBJECT = "EXCLUDE_OBJECT_START NAME=a\nG1 X50 Y30 E1 F1200\nEXCLUDE_OBJECT NAME=a\nG1 X30 Y30 E1\nEXCLUDE_OBJECT_END NAME=a\nM104 S0\n"
LAST_LABEL = "M486 T2\nM486 S1\nG1 X50 Y30 E1 F1200\nM486 P1\nG1 X30 E1\nM486 S-1\nM104 S0\n"
TENTHS = "G1 X60 Y60 F3000\nG91\n" + "G1 X0.1\n" * 10 + "G90\n"

# name, what stands behind START, where the nozzle ends, filament
BUILT = [
    ("a lift, then homing", LAST_OBJECT + "G91\nG1 Z10 F300\nG90\nG28 X0 Y0\nM84\n", (0, 0, 10.3), 1),
    ("a lift, then homing (M486)", LAST_LABEL + "G91\nG1 Z10 F300\nG90\nG28 X Y\nM84\n", (0, 0, 10.3), 1),
    ("a lift, then motors off", LAST_OBJECT + "G91\nG1 Z10 F300\nG90\nM84\n", (50, 30, 10.3), 1),
    ("a lift, then nothing", LAST_LABEL + "G91\nG1 Z10 F300\nG90\n", (50, 30, 10.3), 1),
    ("a retraction and a lift, then nothing", LAST_OBJECT + "G1 E-2 F1800\nG1 Z10.3 F300\n", (50, 30, 10.3), -1),
    ("the object itself goes up", LAST_OBJECT.replace("G1 X30 Y30 E1\n", "G1 X30 Y30 E1\nG1 Z9\n") + "M84\n", (50, 30, 9), 1),
    ("the object itself goes up, then homing", LAST_OBJECT.replace("G1 X30 Y30 E1\n", "G1 X30 Y30 E1\nG1 Z9\n") + "G28 X0 Y0\nM84\n", (0, 0, 9), 1),
    ("names that differ at their ends", two_objects(LONG + "0", LONG + "1") + END, (100, 30, 20), 3),
    ("names with blanks", two_objects("Ultimate Box 1", "Ultimate Box 2") + END, (100, 30, 20), 3),
    ("quotes in quotes", two_objects("'Bob's part 1'", "'Bob's part 2'") + END, (100, 30, 20), 3),
    ("names of 25 Chinese letters", two_objects("\u76d2" * 24 + "\u4e00", "\u76d2" * 24 + "\u4e8c") + END, (100, 30, 20), 3),
    ("an exponent of a speed", "M82\nG1 X60 E10 F1200\nG1 F1.2e+3\n" + END, (60, 30, 20), 10),
    ("an exponent of a place", "G1 X4e1 Y40 F3000\n" + END, (40, 40, 20), 0),
    ("an exponent of nearly nothing", "G1 X60 E1 F1200\nG1 X60.001 Y3.0e+01 E8.5e-05\nG1 X90 E1\n" + END, (90, 30, 20), 2),
    ("words without blanks", "g1x60y40e1f1200\nG1X90Y30E1\n" + END, (90, 30, 20), 2),
    ("a circle behind ten tenths", TENTHS + "G2 X61 Y60 I10 J0 E2 F1800\n" + END, (61, 60, 20), 2),
    ("a circle behind another name", "G1 X60.1 Y60.1 F3000\nG92 X12.346 Y0.7\nG3 X12.346 Y0.7 I10 J0 E2 F1800\nG92 X60.1 Y60.1\n" + END,
     (60.1, 60.1, 20), 2),
    ("a comment in parentheses", "G1 X60 (say; E5 G28) Y40 E1 F1200\n" + END, (60, 40, 20), 1),
    ("a heater's wait without a number", "M109\nG1 X60 E1 F1200\n" + END, (60, 30, 20), 1),
    ("displays that make no sense", "M73 P0 R99999999999\nM73 P-1\nM73 P101 R0\nM73 P??\nM117 " + "a" * 400 + "\nM300 S P\nG1 X60 E1 F1200\n" + END,
     (60, 30, 20), 1),
    ("tools that a person chooses", "T0\nT?\nTx\nTc\nG1 X60 E1 F1200\n" + END, (60, 30, 20), 1),
    ("the end of the program", "G1 X60 E1 F1200\nM104 S0\nM2\nG1 X90 E1\nG28\n", (60, 30, 0.3), 1),
]

LAYER_SCRIPT = "G1 X60 E1 F1200\nG91\nG1 Z1 F300\nG1 Z-1\nG90\nG1 X90 E1 F1200\n" + END
BUILT += [
    ("E relative at G90, as Klipper has it", "SET_VELOCITY_LIMIT ACCEL=2000\n" + LAYER_SCRIPT, (90, 30, 20), 2),
    ("E relative at G90, as RepRapFirmware has it", "M572 D0 S0\n" + LAYER_SCRIPT, (90, 30, 20), 2),
    ("E absolute at G90, as Marlin has it", LAYER_SCRIPT, (90, 30, 20), 1),
]

# name, what stands behind START, the line that is refused, a word of why, a word of the cure
REFUSED = [
    ("motors off in the middle", "G1 X60 E1 F1200\nM84\nG1 X90 E1\n" + END, 13, "motors went off", "G28"),
    ("a machine tool", "G21\nG90\nG54\nS5000 M3\nG0 X42.0 Y22.0\nF333\n", 14, "more than one command", "one command a line"),
    ("an object whose name would be cut", "EXCLUDE_OBJECT_START NAME=" + "x" * 300 + "\n", 11, "would be lost", ""),
]

# bytes, words of the message
NO_GCODE = [
    (b"PK\x03\x04\x14\x00\x00\x00\x08\x00 3D/3dmodel.model", "Export G-code"),
    (b"\x1f\x8b\x08\x00 packed", "Unpack"),
    ("G28\nG1 X10\n".encode("utf-16"), "UTF-16"),
    (START.encode() + bytes(512), "NUL bytes"),
    (b"solid cube\nfacet normal 0 0 1\n", "Slice it"),
    (b"<!DOCTYPE html>\n<html>\n", "web page"),
]


class Silent(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def run_sim(self, content, times=1):
        """The report is of the last of so many `times`, by one printer."""
        job, report = os.path.join(self.folder.name, "job.gcode"), os.path.join(self.folder.name, "report.json")
        with open(job, "wb") as file:
            file.write(content if isinstance(content, bytes) else content.encode())
        done = subprocess.run([PROGRAM, job, "--report", report] + ["--before", job] * (times - 1), capture_output=True, text=True, timeout=100, check=False)
        if done.returncode == 2:
            return done, {}
        with open(report, encoding="utf-8") as file:
            return done, json.load(file)

    def test_what_the_file_means_is_built(self):
        for name, program, place, filament in BUILT:
            with self.subTest(name):
                done, report = self.run_sim(START + program)
                self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
                for axis, expected in zip("xyz", place):
                    self.assertAlmostEqual(report["final_position_mm"][axis], expected, delta=0.0126)
                for each in ("asked", "built"):
                    self.assertAlmostEqual(report["filament_mm"][each], filament, delta=0.02)

    def test_a_job_counts_its_filament_anew_behind_others(self):
        """A third of a step is left over each time. E counts from 0 in each job: there need be no G92 E0."""
        for mode, words in (("M82", (0.1, 0.2034)), ("M83", (0.1, 0.1034))):
            lines = "%s\nG1 X60 E%s F1200\nG1 X90 E%s\n" % (mode, *words)
            for times in (2, 3, 4):
                with self.subTest(mode, times=times):
                    done, report = self.run_sim(START.replace("G92 E0\n", "") + lines + END, times)
                    self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
                    self.assertAlmostEqual(report["filament_mm"]["asked"], 0.2034, places=6)
                    self.assertAlmostEqual(report["filament_mm"]["built"], 0.2034, delta=0.0053)

    def test_a_circle_is_as_long_as_it_is(self):
        """62.8 mm: it takes two seconds, and never no time at all."""
        times = [self.run_sim(START + TENTHS + circle + END)[1]["print_time_s"] for circle in ("", "G2 X61 Y60 I10 J0 E2 F1800\n")]
        self.assertGreater(times[1] - times[0], 1.9)

    def test_what_cannot_be_done_is_refused_with_its_line_and_the_cure(self):
        for name, program, line, why, cure in REFUSED:
            with self.subTest(name):
                done, report = self.run_sim(START + program)
                self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
                self.assertEqual(report["refused"]["line"], line)
                self.assertIn(why, report["refused"]["why"])
                self.assertIn(cure, report["refused"]["cure"])

    def test_what_is_no_gcode_is_called_what_it_is(self):
        for content, words in NO_GCODE:
            with self.subTest(words):
                done, _ = self.run_sim(content)
                self.assertEqual(done.returncode, 2)
                self.assertIn(words, done.stdout + done.stderr)

    def test_whose_meaning_g90_has_is_remarked_with_its_line(self):
        for sign, words in [("SET_VELOCITY_LIMIT ACCEL=2000\n", "line 17: E stays relative at G90, as Klipper means it (line 11)"),
                            ("", "line 16: E is absolute here")]:
            _, report = self.run_sim(START + sign + LAYER_SCRIPT)
            self.assertTrue(any(words in remark for remark in report["remarks"]), report["remarks"])

    def test_the_end_of_the_program_is_remarked_where_more_stands_behind_it(self):
        _, report = self.run_sim(START + "G1 X60 E1 F1200\nM2\nM104 S0\n")
        self.assertTrue(any("line 13: the program has ended" in remark for remark in report["remarks"]), report["remarks"])


if __name__ == "__main__":
    unittest.main()
