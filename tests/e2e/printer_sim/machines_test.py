"""Every machine that is shipped: its file is right, and a cube printed on it is the cube that was asked for."""

import json
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import tomllib
import unittest

PRINTER_SIM = sys.argv.pop(1)
PRINTER = sys.argv.pop(1)
REPOSITORY = pathlib.Path(__file__).parents[3]
MACHINES = REPOSITORY / "machines"


def middle(machine):
    """The middle of the bed."""
    if machine.get("kinematics", {}).get("type") == "delta":
        return 0.0, 0.0
    axes = machine.get("axes", {})
    bounds = [(axes.get(a, {}).get("minimum_mm", 0), axes.get(a, {}).get("maximum_mm", 150)) for a in "xy"]
    return tuple((low + high) / 2 for low, high in bounds)


def cube(machine, side=10, layers=3):
    """The walls of a cube, layer by layer, with heat, fan and a retraction."""
    x, y = middle(machine)
    low_x, low_y, high_x, high_y = x - side / 2, y - side / 2, x + side / 2, y + side / 2
    lines = ["G28", "M140 S55", "M109 S205", "M190 S55", "G90", "M83", "G92 E0"]
    for layer in range(layers):
        lines += ["G1 Z%.2f F300" % (0.2 + 0.2 * layer), "G1 X%.3f Y%.3f F6000" % (low_x, low_y), "G1 E0.8 F1800"]
        for at in ((high_x, low_y), (high_x, high_y), (low_x, high_y), (low_x, low_y)):
            lines.append("G1 X%.3f Y%.3f E0.35 F2400" % at)
        lines += ["G1 E-0.8 F1800", "M106 S200"]
    return "\n".join(lines + ["M107", "M104 S0", "M140 S0", "M84", ""])


def vase(radius=12, turns=3, sides=90):
    """A spiral: Z rises all the time, as in the vase mode of slicers, around X0 Y0."""
    lines = ["G28", "M109 S205", "G90", "M83", "G92 E0", "G1 X%.3f Y0 Z0.2 F6000" % radius, "G1 E0.8 F1800"]
    for step in range(1, turns * sides + 1):
        x, y = (radius * turn(2 * math.pi * step / sides) for turn in (math.cos, math.sin))
        lines.append("G1 X%.3f Y%.3f Z%.4f E%.5f F2400" % (x, y, 0.2 + 0.2 * step / sides, 0.033 * 2 * math.pi * radius / sides))
    return "\n".join(lines + ["G1 E-0.8 F1800", "M104 S0", "M84", ""])


def complaint(text):
    """What `printer check` says of a machine file, on one line."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "m.toml")
        with open(path, "w", encoding="utf-8") as out:
            out.write(text)
        ended = subprocess.run([PRINTER, "check", path], capture_output=True, text=True, check=False)
        return " ".join(ended.stderr.split())


def accepted_keys(table, kind=None):
    """The keys that the check itself accepts in a table: it lists them beside a key that it does not know."""
    given = {} if kind is None else {"type": "'%s'" % kind}
    for _ in range(40):
        said = complaint("[%s]\n" % table * bool(table) + "".join("%s = %s\n" % each for each in given.items()) + "zz_zz = 1\n")
        if found := re.search(r"'zz_zz' is not known; accepted: (.*)$", said):
            return found[1].split(", ")
        if found := re.search(r"needs '(\w+)'", said):
            given[found[1]] = 1
        elif found := re.search(r"'(\w+)' is \S+; accepted: a number from (\S+) to (\S+)", said):
            given[found[1]] = found[3]
        else:
            return []
    return []


def all_keys(table=""):
    """{table: keys}, of this table and of those within."""
    found = {table: set(accepted_keys(table))}
    if "type" in found[table]:
        for kind in re.findall(r'"(\w+)"', complaint("[%s]\ntype = 'zz'\n" % table)):
            found[table] |= set(accepted_keys(table, kind))
    for key in sorted(found[table]):
        inner = table + "." * bool(table) + key
        if complaint("[%s]\nzz_zz = 1\n" % inner).find("'zz_zz' is not known") >= 0 or key in ("sensor", "kinematics", "probe"):
            found |= all_keys(inner)
    return found


class Page(unittest.TestCase):
    """docs/machine.md against the reader of machine files: neither has a key that the other has not."""

    def test_the_page_has_every_key_and_no_other(self):
        found = all_keys()
        known = set().union(*found.values())
        self.assertIn("steinhart_a", known)
        self.assertGreater(len(known), 60)
        page = (REPOSITORY / "docs" / "machine.md").read_text(encoding="utf-8")
        page = re.sub(r"^## The twin's own$.*?(?=^## )", "", page, flags=re.MULTILINE | re.DOTALL)  # no printer's file has them
        written = {name for path in re.findall(r"`\[*([a-z][a-z0-9_.]*)\]*`", page) for name in path.split(".")}
        tables = {name for table in found for name in table.split(".") if name}
        self.assertEqual(sorted(known - written - tables), [], "the page lacks them")
        rows = re.findall(r"^\| ((?:`[a-z][a-z0-9_]*`(?:, )?)+) \|", page, re.MULTILINE)
        listed = {key for row in rows for key in re.findall(r"`(\w+)`", row)}
        self.assertEqual(sorted(listed - known), [], "no file may have them")


class Machines(unittest.TestCase):
    def test_each_file_is_right(self):
        files = sorted(str(file) for file in MACHINES.glob("*.toml"))
        self.assertGreaterEqual(len(files), 3)
        ended = subprocess.run([PRINTER, "check", *files], capture_output=True, text=True, check=False)
        self.assertEqual(ended.returncode, 0, ended.stderr)
        for file in files:
            self.assertIn(file + ": a machine, ", ended.stdout)

    def test_each_prints_a_cube(self):
        for file in sorted(MACHINES.glob("*.toml")):
            with self.subTest(file.name), tempfile.TemporaryDirectory() as folder:
                job = os.path.join(folder, "cube.gcode")
                with open(job, "w", encoding="utf-8") as out:
                    out.write(cube(tomllib.loads(file.read_text(encoding="utf-8"))))
                ended = subprocess.run([PRINTER_SIM, job, "--machine", str(file)], capture_output=True, text=True, check=False)
                self.assertEqual(ended.returncode, 0, file.name + "\n" + ended.stdout + ended.stderr)

    def test_a_vase_on_a_delta(self):
        """All three carriages move in every line of it, and so does the height."""
        with tempfile.TemporaryDirectory() as folder:
            job, report = os.path.join(folder, "vase.gcode"), os.path.join(folder, "report.json")
            with open(job, "w", encoding="utf-8") as out:
                out.write(vase())
            ended = subprocess.run([PRINTER_SIM, job, "--machine", str(MACHINES / "delta.toml"), "--report", report], capture_output=True, text=True, check=False)
            self.assertEqual(ended.returncode, 0, ended.stdout + ended.stderr)
            with open(report, encoding="utf-8") as file:
                found = json.load(file)
        self.assertTrue(found["matches"])
        self.assertGreater(min(found["steps"][axis] for axis in "xyz"), 20000)
        self.assertLess(max(found["path_deviation_mm_max"][axis] for axis in "xyz"), 0.01)

    def test_a_wrong_file_is_told_with_its_line(self):
        wrong = {
            "[axes.x]\nmax_speed_mm_min = 6000\n": "m.toml:2: [axes.x] 'max_speed_mm_min' is not known: is it 'max_speed_mm_s'",
            "fan_pin = 17\n": "m.toml:1: fan_pin: pin 17 is hot_end.heater_pin already",
            "[bed]\nadc_channel = 0\n": "m.toml:2: [bed] 'adc_channel' is 0, as the hot end's",
        }
        for text, expected in wrong.items():
            self.assertIn(expected, complaint(text))

    def test_what_is_tuned_is_kept_for_the_next_run(self):
        with tempfile.TemporaryDirectory() as folder:
            job, kept = os.path.join(folder, "tune.gcode"), os.path.join(folder, "kept.toml")
            with open(job, "w", encoding="utf-8") as out:
                out.write("M306 T S200\nM500\n")
            ended = subprocess.run([PRINTER_SIM, job, "--kept", kept], capture_output=True, text=True, check=False)
            self.assertEqual(ended.returncode, 0, ended.stdout + ended.stderr)
            self.assertIn("answer    M306 P40.00 C2", ended.stdout)
            with open(kept, "rb") as file:
                found = tomllib.load(file)["hot_end"]["model"]
            self.assertAlmostEqual(found["heat_capacity_j_k"], 22, delta=0.7)
            self.assertAlmostEqual(found["loss_w_k"], 0.09, delta=0.003)
            with open(job, "w", encoding="utf-8") as out:
                out.write("M306\n")
            again = subprocess.run([PRINTER_SIM, job, "--kept", kept], capture_output=True, text=True, check=False)
            line = next(each for each in ended.stdout.splitlines() if "answer    M306" in each)
            self.assertIn(line, again.stdout)


if __name__ == "__main__":
    unittest.main()
