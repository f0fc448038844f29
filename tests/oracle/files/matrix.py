"""Every G-code file of a folder on every kinematics, without filters and with them: does the twin say that it was built
as asked, and is every step within 50 ns of the dense integration?

    matrix.py PRINTER_SIM JUDGE_STEPS [FOLDER]

One line per cell; it ends with 0 when all are right. Without a folder it takes a small file of its own, which is a
test. The machines have room for a file of a 150 mm bed: the delta is so large because its X0 Y0 is in the middle.
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

SIDEWAYS = "max_speed_mm_s = %d\nmax_acceleration_mm_s2 = %d\n"
MACHINES = {
    "cartesian": 'name = "Cartesian"\n',
    "corexy": 'name = "CoreXY"\n[kinematics]\ntype = "corexy"\n'
    + "".join("[axes.%s]\nmaximum_mm = 160\n" % axis + SIDEWAYS % (250, 4000) for axis in "xy")
    + "[axes.z]\nsteps_per_mm = 800\nmaximum_mm = 160\nhome_retreat_mm = 2\n" + SIDEWAYS % (12, 100),
    "delta": 'name = "Delta"\n[kinematics]\ntype = "delta"\ndelta_radius_mm = 250\narm_length_mm = 560\nbed_radius_mm = 215\n'
    + "".join("[axes.%s]\nsteps_per_mm = 100\n" % axis + SIDEWAYS % (200, 3000) for axis in "xyz")
    + "maximum_mm = 300\nhome_speed_mm_s = 60\nhome_retreat_mm = 4\n[park]\nx_mm = 0\ny_mm = 150\n",
}
FILTERS = {
    "plain": "",
    "filtered": '[axes.x.shaper]\ntype = "mzv"\nfrequency_hz = 42\n[axes.y.shaper]\ntype = "ei"\nfrequency_hz = 55\n'
    "[pressure_advance]\nseconds = 0.05\n",
}


def small_file():
    """Two layers of walls, a zigzag and a corner that is filled by diagonals, both narrower and narrower, with
    retractions, travels and an arc."""
    lines = ["G28", "M109 S205", "G90", "M83", "G92 E0"]
    for z in (0.2, 0.4):
        lines += ["G1 Z%.2f F300" % z, "G1 X65 Y65 F6000", "G1 E0.8 F1200"]
        lines += ["G1 X%d Y%d E0.7 F2400" % corner for corner in ((85, 65), (85, 85), (65, 85), (65, 65))]
        for line in range(30):
            half, at = 0.3 * (30 - line), 66 + 0.55 * line
            ends = (75 - half, 75 + half) if line % 2 else (75 + half, 75 - half)
            lines += ["G0 X%.3f Y%.3f F7200" % (ends[0], at), "G1 X%.3f Y%.3f E%.4f F2400" % (ends[1], at, 0.066 * half)]
        for line in range(24):
            side = 0.27 * (25 - line)
            ends = ((60 - side, 70), (60, 70 - side)) if line % 2 else ((60, 70 - side), (60 - side, 70))
            lines += ["G0 X%.3f Y%.3f F7200" % ends[0], "G1 X%.3f Y%.3f E%.4f F1800" % (*ends[1], 0.047 * side)]
        lines += ["G1 E-0.8 F1200", "G0 X70 Y80", "G1 E0.8 F1200", "G2 X80 Y80 I5 J-2 E0.4 F1800", "G1 E-0.8 F1200"]
    return "\n".join(lines + ["M104 S0", "M84", ""])


def run(*command):
    return subprocess.run([str(each) for each in command], capture_output=True, text=True, check=False)


def cell(printer_sim, judge, file, machine, folder):
    """Both verdicts in words, and whether both are good."""
    report = pathlib.Path(folder) / "report.json"
    report.unlink(missing_ok=True)
    printed = run(printer_sim, file, "--machine", machine, "--report", report)
    found = json.loads(report.read_text(encoding="utf-8")) if report.exists() else {}
    if found.get("refused"):
        said = "refused: " + found["refused"]["why"]
    elif printed.returncode == 0:
        off = found["estimated_s"] / found["print_time_s"] - 1
        said = "match, %.0f s, estimate %+.2f %%" % (found["print_time_s"], 100 * off)
    else:
        said = "DIFFERS: " + "; ".join(found.get("differences", []) or [printed.stderr.strip()])
    judged = run(judge, file, "--machine", machine)
    return said, (judged.stdout or judged.stderr).strip(), printed.returncode == 0 and judged.returncode == 0


def main():
    printer_sim, judge = (os.path.abspath(each) for each in sys.argv[1:3])
    wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        if len(sys.argv) > 3:
            files = sorted(pathlib.Path(sys.argv[3]).glob("*.gcode"))
        else:
            files = [pathlib.Path(folder) / "small.gcode"]
            files[0].write_text(small_file(), encoding="utf-8")
        machine = pathlib.Path(folder) / "machine.toml"
        for file in files:
            for kinematics, text in MACHINES.items():
                for filters, more in FILTERS.items():
                    machine.write_text(text + more, encoding="utf-8")
                    began = time.monotonic()
                    said, judged, good = cell(printer_sim, judge, file, machine, folder)
                    took = time.monotonic() - began
                    print("%-26s %-9s %-8s | %s | %s | %.0f s" % (file.name, kinematics, filters, said, judged, took), flush=True)
                    wrong += not good
    return 1 if wrong or not files else 0


if __name__ == "__main__":
    sys.exit(main())
