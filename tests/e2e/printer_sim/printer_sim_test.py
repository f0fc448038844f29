"""printer-sim as a person runs it: exit codes, report, step file, messages."""

import json
import math
import os
import subprocess
import sys
import tempfile
import unittest

PROGRAM = sys.argv.pop(1)


def tower(layers=6, sides=24):
    """A round tower with walls, retractions, fan and comments, as a slicer would write it."""
    lines = ["; generated for a test", "M140 S0", "M104 S200", "G28 ; home", "M109 S200", "G90", "M82", "G92 E0", "G1 Z0.2 F240"]
    e = 0.0
    for layer in range(layers):
        z = 0.2 + layer * 0.2
        lines += [";LAYER_CHANGE", ";Z:%.1f" % z, "G1 Z%.1f F240" % z, "G1 X%.3f Y75 F7200" % 85]
        if layer == 1:
            lines.append("M106 S127.5")
        lines += ["G1 E%.5f F2400" % e, "G1 F1800", ";TYPE:External perimeter"]
        for side in range(1, sides + 1):
            angle = 2 * math.pi * side / sides
            e += 0.0873
            lines.append("G1 X%.3f Y%.3f E%.5f" % (75 + 10 * math.cos(angle), 75 + 10 * math.sin(angle), e))
        lines += ["G1 E%.5f F2400" % (e - 0.8)]
    return "\n".join(lines + ["M107", "M104 S0", "G28 X0", "M84", ""])


def machine_file(**steps):
    """An i3 of other scales than the reference machine's, with a macro."""
    scales = {"x": 100, "y": 100, "z": 400, "e": 141.5, **steps}
    limits = {"x": (180, 3000), "y": (180, 3000), "z": (12, 200), "e": (60, 5000)}
    lines = ['name = "Scaled"']
    for axis, (speed, acceleration) in limits.items():
        lines += ["[axes.%s]" % axis, "steps_per_mm = %s" % scales[axis], "max_speed_mm_s = %s" % speed]
        lines += ["max_acceleration_mm_s2 = %s" % acceleration]
    return "\n".join(lines + ["[macros]", 'PRINT_START = """', "G28", "M190 S{BED=0}", "M109 S{EXTRUDER}", '"""', ""])


DIALECT = """; the dialect, in one plate
EXCLUDE_OBJECT_DEFINE NAME=lid CENTER=10,10 POLYGON=[[%s]]
PRINT_START EXTRUDER=200
SET_VELOCITY_LIMIT ACCEL=1500
SET_PRESSURE_ADVANCE ADVANCE=0.04
M206 X-1 Y-1
SET_GCODE_OFFSET Z=0.1
M92 E140
M207 S0.8 Z0.3 F2400
M208 S0.05
G1 Z0.2 F600
M83
G1 X30 Y30 F7200 S0
G17
G3 X50 Y50 I0 J20 E1.2 F1800
G2 X50 Y50 I-10 E2
G5 X70 Y40 I10 J0 P-10 Q5 E0.8
G10
G1 X80 Y40 F7200
G11
G18
G3 X90 Z0.2 K0 I5 E0.6 F900
G17
G1 Z0.2 F600
M200 D1.75
G1 X60 Y60 E3.6 F1800
M200 D0
EXCLUDE_OBJECT NAME=lid
EXCLUDE_OBJECT_START NAME=lid
G1 X10 Y10 Z0.4 E5
EXCLUDE_OBJECT_END NAME=lid
M221 S95
G1 X20 Y60 E1.5
G92 X Y E0
M104 S0 T1
M0 look at it
G1 X8
M600
G1 X5 Y5 E0.3
M104 S0
G28 X0 U0
G1 X2
M84 X Y E
""" % ("[1.5,2.5]," * 400)


class PrinterSim(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name, content=None):
        path = os.path.join(self.folder.name, name)
        if content is not None:
            with open(path, "w", encoding="utf-8") as file:
                file.write(content)
        return path

    def run_sim(self, *arguments):
        return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, timeout=100, check=False)

    def test_a_tower_is_built_as_asked_and_twice_the_same(self):
        job, report = self.path("tower.gcode", tower()), self.path("report.json")
        steps = [self.path("a.csv"), self.path("b.csv")]
        for each in steps:
            done = self.run_sim(job, "--report", report, "--steps", each)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        with open(steps[0], "rb") as first, open(steps[1], "rb") as second:
            content = first.read()
            self.assertEqual(content, second.read())
        rows = content.decode().splitlines()
        self.assertEqual(rows[0], "time_ns,axis,direction")
        with open(report, encoding="utf-8") as file:
            result = json.load(file)
        self.assertTrue(result["completed"])
        self.assertEqual(result["lost_steps"], 0)
        self.assertLessEqual(max(result["path_deviation_mm_max"][a] for a in "xy"), 0.0125)
        self.assertLessEqual(result["path_deviation_mm_max"]["z"], 0.0005)
        self.assertAlmostEqual(result["filament_mm"]["built"] / result["filament_mm"]["asked"], 1, delta=5e-4)
        self.assertEqual(result["unknown_codes"], [])
        self.assertGreater(result["temperature_c"]["min"], 190)
        self.assertLess(result["temperature_c"]["max"], 210)
        for index, axis in enumerate("xyze"):
            counted = sum(1 for row in rows[1:] if row.split(",")[1] == "XYZE"[index])
            self.assertEqual(counted, result["steps"][axis])
        times = [int(row.split(",")[0]) for row in rows[1:]]
        self.assertEqual(times, sorted(times))

    def test_what_cannot_be_printed_says_why(self):
        cases = [
            ("out.gcode", "G28\nG1 X500 F3000\n", 1, "line 2"),
            ("hot.gcode", "M104 S999\n", 1, "999"),
            ("cold.gcode", "G28\nG1 X5 E5 F3000\n", 1, "Heat first: M109"),
            ("homeless.gcode", "M109 S200\nG1 X5 F3000\n", 1, "line 2  G1 X5 F3000"),
            ("tools.gcode", "G28\nM104 S0 T1\nT1\n", 1, "one tool"),
            ("macro.gcode", "G28\nG90\nPRINT_START\n", 1, "[macros]"),
            ("picture.gcode", "\x00\x01\x02PNG", 2, "picture.gcode"),
        ]
        for name, content, status, words in cases:
            done = self.run_sim(self.path(name, content))
            self.assertEqual(done.returncode, status, name)
            self.assertIn(words, done.stdout + done.stderr, name)
            if status == 1:
                self.assertIn("Refused before anything was heated", done.stdout, name)

    def test_a_plate_of_the_dialect_is_built_as_asked(self):
        """Arcs in two planes, a spline, firmware retraction, mm3, a calibrated drive, offsets, a macro, an object left out."""
        report = self.path("report.json")
        job, machine = self.path("dialect.gcode", DIALECT), self.path("machine.toml", machine_file())
        done = self.run_sim(job, "--machine", machine, "--report", report)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        with open(report, encoding="utf-8") as file:
            result = json.load(file)
        self.assertIsNone(result["refused"])
        self.assertGreater(max(result["curve_deviation_mm_max"][a] for a in "xyz"), 0.001)
        self.assertEqual(sum(result["unexplained_steps"].values()), 0)
        self.assertEqual(sum("the job paused, and was resumed" in remark for remark in result["remarks"]), 2)
        self.assertTrue(any("SET_PRESSURE_ADVANCE" in remark for remark in result["remarks"]), result["remarks"])

    def test_the_twins_own_machine_shows_a_wrong_number_of_the_printers(self):
        job, right = self.path("tower.gcode", tower(2)), self.path("right.toml", machine_file())
        self.assertEqual(self.run_sim(job, "--machine", right, "--twin-machine", right).returncode, 0)
        for axis, steps in [("x", 101), ("y", 99.5), ("z", 404), ("e", 143)]:
            wrong = self.path("wrong.toml", machine_file(**{axis: steps}))
            done = self.run_sim(job, "--machine", wrong, "--twin-machine", right)
            self.assertEqual(done.returncode, 1, axis + done.stdout + done.stderr)
            self.assertIn("NOT what was asked", done.stdout, axis)

    def test_bad_arguments_are_named(self):
        job = self.path("job.gcode", "G28\n")
        machine = self.path("machine.toml", "[axes.x]\nspeed = 3\n")
        for arguments, words in [
            (["/nonexistent.gcode"], "/nonexistent.gcode"),
            ([job, "--machine", machine], "machine.toml:2: [axes.x] 'speed'"),
            ([job, "--fault", "gremlins"], "gremlins"),
            ([job, "--steps", "/nonexistent/steps.csv"], "/nonexistent/steps.csv"),
            ([], "which file?"),
        ]:
            done = self.run_sim(*arguments)
            self.assertEqual(done.returncode, 2, arguments)
            self.assertIn(words, done.stderr)

    def test_a_broken_machine_fails_the_job(self):
        done = self.run_sim(self.path("tower.gcode", tower(30)), "--fault", "motor_disconnected:x@190")
        self.assertEqual(done.returncode, 1)
        self.assertIn("NOT what was asked", done.stdout)
        done = self.run_sim(self.path("tower.gcode", tower()), "--fault", "sensor_stuck:hot_end@20")
        self.assertEqual(done.returncode, 1)
        self.assertIn("does not heat up", done.stdout)


if __name__ == "__main__":
    unittest.main(verbosity=2)
