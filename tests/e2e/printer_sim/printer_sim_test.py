"""printer-sim as a person runs it: exit codes, report, step file, messages."""

import json
import math
import os
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

PROGRAM = sys.argv.pop(1)


def tower(layers=6, sides=24, middle=75, start=()):
    """A round tower with walls, retractions, fan and comments, as a slicer would write it."""
    lines = ["; generated for a test", "M140 S0", "M104 S200", "G28 ; home", *start, "M109 S200", "G90", "M82", "G92 E0", "G1 Z0.2 F240"]
    e = 0.0
    for layer in range(layers):
        z = 0.2 + layer * 0.2
        lines += [";LAYER_CHANGE", ";Z:%.1f" % z, "G1 Z%.1f F240" % z, "G1 X%.3f Y%.3f F7200" % (middle + 10, middle)]
        if layer == 1:
            lines.append("M106 S127.5")
        lines += ["G1 E%.5f F2400" % e, "G1 F1800", ";TYPE:External perimeter"]
        for side in range(1, sides + 1):
            angle = 2 * math.pi * side / sides
            e += 0.0873
            lines.append("G1 X%.3f Y%.3f E%.5f" % (middle + 10 * math.cos(angle), middle + 10 * math.sin(angle), e))
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


COREXY = """[kinematics]
type = "corexy"
"""

DELTA = """[kinematics]
type = "delta"
delta_radius_mm = 105
arm_length_mm = %s
bed_radius_mm = 90
endstop_offset_x_mm = 0.3
endstop_offset_y_mm = -0.2
"""
DELTA_AXES = "".join("""[axes.%s]
steps_per_mm = 80
max_speed_mm_s = 150
max_acceleration_mm_s2 = 2000
instantaneous_speed_mm_s = 20
home_speed_mm_s = 40
home_retreat_mm = 3
""" % axis for axis in "xyz") + "maximum_mm = 260\nhome_position_mm = 250\n"

SECOND_Z = """[[axes.z.motors]]
step_pin = 30
direction_pin = 31
enable_pin = 32
"""
SECOND_SWITCH = "endstop_pin = 33\n"

PROBE = """[probe]
pin = 34
x_offset_mm = -12
y_offset_mm = 8
trigger_height_mm = 0.7
"""


def delta(arm=215):
    return DELTA % arm + DELTA_AXES


# Where carriages of delta() turn back: at the top of a travel across; twice within 0.75 ms at a
# corner, so that the step there and back is left out; and the same just before a rest, where only
# the filament goes on.
TURNS = {
    "travel": ["G1 X-28.115 Y9.197 F3600", "G1 X-28.114 Y2.279 E0.23", "G1 E-0.8 F2400", "G1 X24.350 Y-0.111 F7200", "G1 E0.8 F2400"],
    "corner": ["G1 X-6.604 Y4.827 F1200", "G1 X-6.830 Y4.827 E0.01 F1200", "G1 X-5.580 Y3.576 E0.06", "G1 X-5.580 Y2.997 E0.02"],
    "rest": ["G1 X24.440 Y-11.057 F6000", "G1 X24.662 Y-11.736 E0.0236 F3000", "G1 X24.670 Y-11.729", "G1 E-0.8 F2400", "G1 E0.8",
             "G1 X24.530 Y-13.004 E0.0423 F3000"],
}

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


# One long line, slow enough that the stepper loop naps between two steps.
LINE = """G28
M109 S200
M83
G1 Z0.2 F300
G1 X20 Y20 F6000
G1 E2 F300
;TYPE:Perimeter
G1 X120 E3.33 F600
G1 Y60 E1.33
M104 S0
"""

# The stepper loop takes 0.7 ms too much once, which the nap before a step hides 0.5 ms of.
LATE = """[sim]
tick_period = "4 ms"
tick_cost = "2 us"
[sim.costs]
pin_write = "100 ns"
[[sim.fault.loop]]
loop = 2
extra = "700 us"
from = "%.6f s"
until = "%.6f s"
"""


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
        self.assertAlmostEqual(result["estimated_s"] / result["print_time_s"], 1, delta=0.005)
        self.assertAlmostEqual(sum(result["activities_s"].values()), result["estimated_s"], places=3)
        self.assertRegex(done.stdout, r"estimated [0-9.]+ s before the print, -?[0-9.]+ % off")
        # The sketch states its own chains; each was gone through, and stayed within its bound.
        said = " ".join(done.stdout.split())
        for name in ("thermistors to heaters", "emergency byte to pins"):
            self.assertRegex(said, r"Chain %s: reaction \S+ \S+ at worst, bound \S+ \S+ \([1-9]" % name)
        self.assertNotIn("BEYOND IT", said)
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
        self.assertFalse(any("SET_PRESSURE_ADVANCE" in remark for remark in result["remarks"]), result["remarks"])

    def test_shaped_and_advanced_plates_are_built_as_asked(self):
        """Shapers, pressure advance and a limited jerk, alone and together; of the machine file and of the job."""
        filters = {
            "shapers": '[axes.x.shaper]\ntype = "mzv"\nfrequency_hz = 40\n[axes.y.shaper]\ntype = "2hump_ei"\nfrequency_hz = 60\n',
            "advance": "[pressure_advance]\nseconds = 0.05\n",
        }
        jerk = "jerk_mm_s3 = 100000\n"
        words = "M593 F45 D0.1\nM900 K0.04\nSET_INPUT_SHAPER SHAPER_TYPE_Y=ei\n"
        machines = {
            "shapers": filters["shapers"],
            "advance": filters["advance"],
            "jerk": jerk,
            "all": jerk + filters["shapers"] + filters["advance"],
            "none": "",
        }
        for name, text in machines.items():
            machine = self.path(name + ".toml", text)
            for job in (tower(4), words + tower(4)):
                done = self.run_sim(self.path("tower.gcode", job), "--machine", machine)
                self.assertEqual(done.returncode, 0, name + done.stdout + done.stderr)

    def test_the_twin_sees_a_wrong_shaper_and_a_lost_advance(self):
        job = self.path("tower.gcode", tower(12))
        asked = self.path("asked.toml", "[pressure_advance]\nseconds = 0.08\n")
        plain = self.path("plain.toml", "")
        done = self.run_sim(job, "--machine", plain, "--twin-machine", asked)
        self.assertEqual(done.returncode, 1, done.stdout)
        self.assertIn("of what pressure advance asks for", done.stdout)
        shaper = '[axes.%s.shaper]\ntype = "mzv"\nfrequency_hz = %d\n'
        fine = self.path("fine.toml", shaper % ("x", 60) + shaper % ("y", 60))
        wrong = self.path("wrong.toml", shaper % ("x", 12) + shaper % ("y", 12))
        self.assertEqual(self.run_sim(job, "--machine", fine, "--twin-machine", fine).returncode, 0)
        done = self.run_sim(job, "--machine", wrong, "--twin-machine", fine)
        self.assertEqual(done.returncode, 1, done.stdout)
        self.assertIn("left the asked path", done.stdout)

    def test_the_twins_own_machine_shows_a_wrong_number_of_the_printers(self):
        job, right = self.path("tower.gcode", tower(2)), self.path("right.toml", machine_file())
        self.assertEqual(self.run_sim(job, "--machine", right, "--twin-machine", right).returncode, 0)
        for axis, steps in [("x", 101), ("y", 99.5), ("z", 404), ("e", 143)]:
            wrong = self.path("wrong.toml", machine_file(**{axis: steps}))
            done = self.run_sim(job, "--machine", wrong, "--twin-machine", right)
            self.assertEqual(done.returncode, 1, axis + done.stdout + done.stderr)
            self.assertIn("NOT what was asked", done.stdout, axis)

    def verdict(self, job, machine, twin=None):
        """What printer-sim says of a job on `machine`, with a twin of its own numbers."""
        files = ["--machine", self.path("machine.toml", machine), "--twin-machine", self.path("twin.toml", twin or machine)]
        return self.run_sim(self.path("job.gcode", job), *files)

    def assert_built(self, done):
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("Built is what was asked", done.stdout)

    def assert_not_built(self, done, words="NOT what was asked"):
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        self.assertIn(words, done.stdout)

    def test_other_kinematics_build_what_was_asked(self):
        curve = ["G1 Z3 F600", "G1 X60 Y60 F6000", "G3 X60 Y60 I10 J0", "G28 X", "G1 X20 Y30.006", "G28 Y"]
        self.assert_built(self.verdict(tower(start=curve), COREXY))
        self.assert_built(self.verdict(tower(middle=5, start=["G1 Z20 F6000", "G1 X70 Y-40", "G2 X-60 Y30 I-65 J35"]), delta()))

    def test_where_carriages_turn_back_the_place_on_the_path_is_known(self):
        """Half a step, and what is left out at a turn: never as much as one step and a half."""
        for name, ways in TURNS.items():
            height = "11.2" if name == "corner" else "9.4" if name == "travel" else "10"
            job = "\n".join(["M104 S200", "G28", "M109 S200", "G90", "M83", "G1 Z%s F6000" % height, *ways, ""])
            for gap in (0, 0.00075):
                with self.subTest(name, gap=gap):
                    machine = self.path("machine.toml", "reversal_gap_s = %s\n" % gap + delta())
                    result, _ = self.reported(self.path("job.gcode", job), "--machine", machine)
                    worst = result["path_deviation_mm_max"]
                    self.assertLess(max(worst[axis] for axis in "xyz") * 80, 0.55 if gap == 0 else 0.9)
                    self.assertLess(worst["e"], 0.04)

    def test_a_wrong_number_of_the_kinematics_shows(self):
        self.assert_not_built(self.verdict(tower(2), COREXY + "[axes.y]\ndirection_inverted = true\n", COREXY))
        self.assert_not_built(self.verdict(tower(2), "", COREXY))
        self.assert_not_built(self.verdict(tower(2, middle=0), delta(215.1), delta()))

    def test_a_delta_says_what_it_does_not_reach(self):
        for line, words in [("G1 X80 Y80", "reaches 90 mm around X 0, Y 0"), ("G1 X85 Y0", "a carriage above its switch"),
                            ("G1 Z300", "reaches from 0 to 260 mm")]:
            self.assert_not_built(self.verdict("G28\n" + line + " F3000\n", delta()), words)

    def test_homing_and_pausing_at_the_switches(self):
        for machine in ["", COREXY]:
            for job in ["G28\nG28\n", "G28\nM0\nM0\nG28\n", "G28\nM0\nG28 Z\nM0\nM0\nG28 X\n"]:
                self.assert_built(self.verdict(job + "G1 X20 Y20 Z1 F3000\n", machine))
        # A delta's carriages have no room up there for the way to the park place.
        self.assert_built(self.verdict("G28\nM0\nG28\nG1 Z100 F3000\nG1 X10 Y10\nM0\nG1 X20\n", delta()))

    def test_two_motors_lift_one_axis_and_each_finds_its_own_switch(self):
        both = SECOND_Z + SECOND_SWITCH
        self.assert_built(self.verdict(tower(2), both))
        self.assert_built(self.verdict(tower(2), SECOND_Z))
        self.assert_not_built(self.verdict(tower(2), "", both), "steps beside the first motor of Z")
        self.assert_not_built(self.verdict(tower(2), SECOND_Z, both), "beside the switch of its end of Z")

    def test_the_bed_is_measured_and_followed(self):
        ways = ["G29", "G1 Z0.3 F240", "G1 X20 Y20 F6000", "G1 X125 Y110", "G1 Z4", "G1 X30 Y115", "M420 S0", "G1 X50", "M420 S1 Z6", "G1 X60"]
        for surface in ["bilinear", "bicubic"]:
            mesh = '[bed_mesh]\nsurface = "%s"\nminimum_y_mm = 25\nfade_end_mm = 8\n' % surface
            self.assert_built(self.verdict(tower(2, start=ways), PROBE + mesh))
        self.assert_built(self.verdict(tower(2, middle=0, start=["G29", "G1 Z0.3 F6000", "G1 X40 Y-30"]), delta() + PROBE))
        # Behind a shaper the twin looks ahead: beyond a G29 the bed is not known.
        shaped = '[axes.x.shaper]\ntype = "zv"\nfrequency_hz = 47\n[skew]\nxz = 0.003\nyz = -0.005\n'
        self.assert_built(self.verdict(tower(2, start=["G29"]), PROBE + "[bed_mesh]\nminimum_y_mm = 25\n" + shaped))
        self.assert_built(self.verdict(tower(2, start=["BED_MESH_CALIBRATE", "BED_MESH_PROFILE SAVE=a", "BED_MESH_CLEAR", "G1 Z1",
                                                       "BED_MESH_PROFILE LOAD=a"]), COREXY + PROBE))

    def test_layers_are_those_of_the_file_on_a_bed_that_leans(self):
        machine = self.path("machine.toml", PROBE + "[bed_mesh]\nminimum_y_mm = 25\nfade_end_mm = 8\n")
        job = self.path("job.gcode", tower(3, start=["G29"]))
        result, _ = self.reported(job, "--machine", machine, "--heights")
        self.assertEqual(result["layers"], 3)

    def test_a_bed_that_is_kept_is_followed_at_the_next_start(self):
        machine, kept = self.path("machine.toml", PROBE + "[bed_mesh]\nminimum_y_mm = 25\n"), self.path("kept.toml", "")
        flat, _ = self.reported(self.path("flat.gcode", tower(2)), "--machine", machine)
        load = self.path("load.gcode", tower(2, start=["BED_MESH_PROFILE LOAD=glass"]))
        lost = self.run_sim(load, "--machine", machine, "--kept", kept)
        self.assertEqual(lost.returncode, 1)
        self.assertIn("there is no profile glass of the bed", lost.stdout)
        probe = self.path("probe.gcode", "G28\nG29\nBED_MESH_PROFILE SAVE=glass\nM420 S0\nM500\n")
        probed, _ = self.reported(probe, "--machine", machine, "--kept", kept)
        self.assertLess(abs(probed["estimated_s"] / probed["print_time_s"] - 1), 0.04)
        loaded, _ = self.reported(load, "--machine", machine, "--kept", kept)
        self.assertGreater(loaded["steps"]["z"], flat["steps"]["z"] + 200)
        # M420 S1 follows the bed in force at M500: by its name, or without one.
        nameless = self.path("nameless.toml", "")
        self.reported(self.path("probe.gcode", "G28\nG29\nM500\n"), "--machine", machine, "--kept", nameless)
        for each in [kept, nameless]:
            on, _ = self.reported(self.path("on.gcode", tower(2, start=["M420 S1"])), "--machine", machine, "--kept", each)
            self.assertEqual(on["steps"]["z"], loaded["steps"]["z"], each)

    def test_a_wrong_number_of_the_bed_shows(self):
        job, right = tower(2, start=["G29"]), PROBE + "[bed_mesh]\nminimum_y_mm = 25\n"
        self.assert_built(self.verdict(job, right))
        for wrong in [right.replace("height_mm = 0.7", "height_mm = 0.8"), right + "fade_end_mm = 2\nfade_start_mm = 0.1\n",
                      right.replace("x_offset_mm = -12", "x_offset_mm = 12")]:
            self.assert_not_built(self.verdict(job, wrong, right))

    def test_axes_are_put_straight(self):
        job = tower(2, start=["G1 Z2 F600", "M852 I0.01 J-0.004 K0.003", "G1 X40 Y90 Z12 F3000", "G28 X", "SET_SKEW XY=140.4,142.8,99.8"])
        self.assert_built(self.verdict(job, "[skew]\nxy = 0.002\n"))
        self.assert_built(self.verdict(job, COREXY))
        # A delta is homed high up, where the skew is large: the switches' places are not corrected.
        self.assert_built(self.verdict(tower(2, middle=0), delta() + "[skew]\nxz = 0.003\nyz = -0.005\n"))
        self.assert_not_built(self.verdict(tower(2), "[skew]\nxy = 0.002\n", "[skew]\nxy = -0.002\n"))

    def reported(self, *arguments):
        report = self.path("report.json")
        done = self.run_sim(*arguments, "--report", report)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        with open(report, encoding="utf-8") as file:
            return json.load(file), done.stdout

    def test_a_late_step_is_a_thick_spot_with_its_line(self):
        job = self.path("line.gcode", LINE)
        steps = self.path("steps.csv")
        right, _ = self.reported(job, "--heights", "--steps", steps)
        self.assertEqual(right["layer_height"]["late_spots"], 0)
        self.assertLess(right["layer_height"]["error_mm"]["p50"], 0.002)
        # The step at which X crosses 70 mm, half way along line 8.
        with open(steps, encoding="utf-8") as file:
            rows = [row.split(",") for row in file.read().split()[1:]]
        begin = next(i for i, row in enumerate(rows) if row[1] == "E")
        x = 20 * 80
        for time, axis, direction in rows[begin:]:
            x += int(direction) if axis == "X" else 0
            if x == 70 * 80:
                break
        at_s = int(time) * 1e-9
        board = self.path("late.toml", LATE % (at_s - 0.0006, at_s + 0.0005))
        picture = self.path("late.svg")
        late, words = self.reported(job, "--picture", picture, "--board", board)
        self.assertEqual(late["layer_height"]["late_spots"], 1, late["layer_height"])
        spot = late["layer_height"]["worst_late_spots"][0]
        self.assertEqual(spot["line"], 8)
        self.assertAlmostEqual(spot["x_mm"], 70, delta=0.1)
        self.assertAlmostEqual(spot["late_s"], 2e-4, delta=1e-4)
        self.assertIn("late      line 8", words)
        with open(picture, encoding="utf-8") as file:
            drawn = file.read()
        self.assertEqual(drawn.count('class="late"'), 3, "in the legend and in both views")
        self.assertIn("line 8:", drawn)
        writes = late["board"]["cores"][1]["pin_writes"]
        self.assertAlmostEqual(writes["share"], writes["per_s"] * 100e-9, delta=1e-9)
        self.assertGreater(late["board"]["step_ns"], 200)
        self.assertIn("pin writes", words)

    def test_a_picture_has_the_part_its_times_and_its_faults(self):
        job, picture = self.path("tower.gcode", tower(4)), self.path("tower.svg")
        for more, words in [((), "From above"), (("--layer", "2"), "Layer 2 from above")]:
            result, _ = self.reported(job, "--picture", picture, *more)
            root = xml.etree.ElementTree.parse(picture).getroot()
            texts = " ".join(element.text or "" for element in root.iter("{http://www.w3.org/2000/svg}text"))
            for said in [words, "tower.gcode", "External perimeter", "peak step rate X", "Built is what was asked"]:
                self.assertIn(said, texts)
            images = list(root.iter("{http://www.w3.org/2000/svg}image"))
            self.assertEqual(len(images), 2)
            self.assertTrue(images[0].get("href").startswith("data:image/png;base64,iVBORw0KGgo"))
        self.assertEqual({each["name"] for each in result["features"]}, {"", "External perimeter"})
        self.assertAlmostEqual(
            sum(each["seconds"] for each in result["features"]) + result["rested_s"], result["print_time_s"], delta=1.1)
        self.assertGreater(result["peak_steps_s"]["x"], 2000)
        done = self.run_sim(job, "--picture", picture, "--layer", "40")
        self.assertEqual(done.returncode, 2)
        self.assertIn("no layer 40", done.stderr)

    def test_the_twins_melt_is_its_own(self):
        """More pressure in the nozzle is more error where the speed changes; the printer's file has no melt."""
        lines = ["G28", "M109 S200", "M83", "G1 Z0.2 F300", "G1 X10 Y10 F6000", "G1 E4 F300", "G1 F4800"]
        for leg in range(40):  # sharp corners
            lines += ["G1 X%d E0.67" % (30 if leg % 2 == 0 else 10), "G1 Y%d E0.1" % (13 + 3 * leg)]
        job = self.path("zigzag.gcode", "\n".join(lines + ["M104 S0", ""]))
        errors = []
        for seconds in (0.01, 0.2):
            twin = self.path("twin.toml", machine_file() + "\n[melt]\npressure_s = %s\n" % seconds)
            machine = self.path("machine.toml", machine_file())
            result, _ = self.reported(job, "--machine", machine, "--twin-machine", twin, "--heights")
            errors.append(result["layer_height"]["error_mm"]["p99"])
        self.assertGreater(errors[1], 2 * errors[0])
        done = self.run_sim(job, "--machine", twin)
        self.assertEqual(done.returncode, 2)
        self.assertIn("'melt' is not known", done.stderr)

    def test_bad_arguments_are_named(self):
        job = self.path("job.gcode", "G28\n")
        machine = self.path("machine.toml", "[axes.x]\nspeed = 3\n")
        board = self.path("board.toml", "[sim]\nspeed = 3\n")
        for arguments, words in [
            (["/nonexistent.gcode"], "/nonexistent.gcode"),
            ([job, "--machine", machine], "machine.toml:2: [axes.x] 'speed'"),
            ([job, "--fault", "gremlins"], "gremlins"),
            ([job, "--steps", "/nonexistent/steps.csv"], "/nonexistent/steps.csv"),
            ([job, "--picture", "a.jpg"], "a.jpg"),
            ([job, "--board", board], "board.toml:2: [sim] 'speed'"),
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
