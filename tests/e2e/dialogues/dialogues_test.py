"""What people do with a printer while it prints, and between prints: the print service, and the printer in the simulator, as processes.

Public reports of printers' users stand behind these dialogues; each test names some. What was built is asked of the twin, which saw pins alone.
Times are the printer's own: a busy computer makes nothing of it longer. Run by ctest, one test at a time.
"""

import datetime
import glob
import os
import subprocess
import sys
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "service"))
import service  # noqa: E402
from service import WATCHED, Hopeless, Live, Printd, wait_until  # noqa: E402

START = "M140 S0\nM104 S205\nG28\nM109 S205\nG90\nM83\nG92 E0\nG1 Z5 F300\nG1 X30 Y30 F6000\nG1 Z0.3 F300\n"
END = "M104 S0\nG1 Z20 F300\nM84\n"
AT_ONCE_S = 5  # what a person says holds for what is printed so much later; all was said too late by minutes


def there_and_back(count, speed_mm_min, start=START):
    """Lines of 60 mm with 1 mm of filament each."""
    return start + "".join("G1 X%d E1 F%d\n" % (90 if i % 2 == 0 else 30, speed_mm_min) for i in range(count)) + END


class Printer:
    """The simulated printer and its service."""

    def __init__(self, speed, surroundings=None, options=()):
        """`surroundings`: of a folder, the variables that all programs get besides."""
        self.folder = service.Folder()
        wrapper = ["env"] + ["%s=%s" % each for each in (surroundings(self.folder.path) if surroundings else {}).items()]
        self.log = open(os.path.join(self.folder.path, "machine.log"), "ab")
        link, inspect = (os.path.join(self.folder.path, name) for name in ("link", "inspect"))
        self.machine = subprocess.Popen([*wrapper, os.path.join(os.path.dirname(service.PRINTD), "printer-sim"), "--link", link, "--inspect", inspect,
                                         "--speed", str(speed)], stdout=self.log, stderr=self.log)
        WATCHED["the printer"] = (self.machine, self.log.name)
        try:
            wait_until(lambda: os.path.exists(link) and os.path.exists(inspect), "the printer is there")
            self.printd = Printd(self.folder.path, ["--no-confirm-bed", "--inspect", inspect, *options], wrapper=wrapper)
            wait_until(lambda: self.printd.machine()["state"] == "idle", "the printer is idle")
        except BaseException:
            self.machine.kill()
            raise

    def stop(self):
        self.printd.stop()
        WATCHED.pop("the printer", None)
        self.machine.terminate()
        self.machine.wait()
        self.log.close()
        self.folder.remove()

    def say(self, line):
        """A typed line; returns when the printer has answered it."""
        live = Live(self.printd, headers={"X-Api-Key": self.printd.key})
        try:
            assert self.printd.request("POST", "/api/v1/machine/gcode", {"line": line})[0] == 202
            while True:
                reply = live.next_of("reply")
                if reply["kind"] == "error":
                    raise AssertionError("%s: %s" % (line, reply["text"]))
                if reply["text"] == "ok":
                    return
        finally:
            live.close()


class Case(unittest.TestCase):
    speed = 20

    def setUp(self):
        self.printer = Printer(self.speed)
        self.printd = self.printer.printd

    def tearDown(self):
        self.printer.stop()

    def start(self, text, name="part.gcode"):
        status, job, _ = self.printd.upload(name, text.encode(), print="true")
        self.assertEqual(status, 201, job)
        return job

    def wait_for_line(self, job, line):
        """Until it prints there."""
        def there():
            now = self.printd.job(job["id"])
            if now["state"] in service.ENDED:
                raise Hopeless("it is %s: %s" % (now["state"], now["error"]))
            machine = self.printd.machine()
            return machine["state"] == "printing" and machine["line"] >= line

        wait_until(there, "line %d is printed" % line, 120)

    def finish(self, job):
        """The job and the twin's report, when it is done."""
        self.printd.wait_for_job(job["id"], "done", 180)

        def report_of():
            status, report, _ = self.printd.request("GET", "/api/v1/jobs/%d/inspection" % job["id"])
            return report if status == 200 else None

        report = wait_until(report_of, "the twin has reported")
        self.assertTrue(report["matches"], report)
        return self.printd.job(job["id"]), report


class BetweenJobs(Case):
    """Marlin#1268, Prusa-Firmware#3374, DuetWebControl#152: what one job has set slows down the next."""

    def printed_s(self, text):
        return self.finish(self.start(text))[0]["printed_s"]

    def test_limits_of_one_job_slow_down_no_other(self):
        job = there_and_back(30, 6000)
        alone_s = self.printed_s(job)
        for limit in ("M203 X5 Y5", "M201 X50 Y50", "M204 P50 T50", "SET_VELOCITY_LIMIT ACCEL=50", "M220 S50"):
            self.printed_s(START + limit + "\nG1 X40 E1 F1200\n" + END)
            # Warm from the job before, it is quicker; with the limit it would take minutes more.
            self.assertLess(self.printed_s(job), alone_s + 5, "behind " + limit)

    def test_pressure_advance_of_one_job_is_none_of_the_next(self):
        job = there_and_back(20, 6000)
        pushed_mm = self.finish(self.start(job))[1]["filament_mm"]["built_pushed"]
        self.finish(self.start(START + "M900 K0.5\nG1 X40 E1 F1200\n" + END))
        self.assertAlmostEqual(self.finish(self.start(job))[1]["filament_mm"]["built_pushed"], pushed_mm, delta=0.02)


class Endings(Case):
    """PrusaSlicer#12900, Prusa-Link#948, Marlin#22640: cut-off files, and files that leave the heat on."""

    def warnings_of(self, job):
        return " ".join(warning["message"] for warning in job["facts"]["warnings"])

    def assert_the_head_is_out_of_the_way(self):
        """Above the part, and beside it."""
        machine = self.printd.machine()
        self.assertEqual(machine["hot_end"]["target_c"], 0)
        self.assertGreater(machine["position_mm"]["z"], 2, "up")
        self.assertFalse(30 <= machine["position_mm"]["x"] <= 90 and machine["position_mm"]["y"] == 30, machine["position_mm"])

    def test_a_file_that_was_cut_off_is_remarked_and_left_cold(self):
        job = self.start(START + "G1 X90 E1 F1200\nG1 X30 E1\nG1 X6")
        self.assertIn("cut off", self.warnings_of(job))
        self.assertIn("ends with the hot end on", self.warnings_of(job))
        self.finish(job)
        # Its last move leads beside the part: from there the next one could lead through it.
        self.assert_the_head_is_out_of_the_way()

    def test_a_cancelled_print_leaves_no_nozzle_in_the_part(self):
        job = self.start(there_and_back(40, 600))
        self.wait_for_line(job, START.count("\n") + 3)
        self.assertEqual(self.printd.request("POST", "/api/v1/machine/cancel")[0], 202)
        self.printd.wait_for_job(job["id"], "cancelled", 60)
        self.assert_the_head_is_out_of_the_way()

    def test_a_file_without_an_end_leaves_no_nozzle_in_the_part(self):
        job = self.start(START + "G1 X90 E1 F1200\n")
        self.assertNotIn("cut off", self.warnings_of(job))
        self.assertIn("ends with the hot end on", self.warnings_of(job))
        self.finish(job)
        self.assert_the_head_is_out_of_the_way()


class WhileItPrints(Case):
    """Octoprint-Cancelobject#52, OrcaSlicer#2027; Prusa-Firmware#3359, Klipper#50: said while it prints."""
    speed = 10

    def two_objects(self, names, layers):
        """Four lines of 40 mm with 1 mm of filament in each object of a layer."""
        text = START + "".join("EXCLUDE_OBJECT_DEFINE NAME=%s\n" % name for name in names)
        for layer in range(layers):
            text += "G1 Z%.2f F600\n;LAYER:%d\n" % (0.3 + 0.2 * layer, layer)
            for name, y in zip(names, (30, 60)):
                text += "EXCLUDE_OBJECT_START NAME=%s\nG1 X30 Y%d F6000\n" % (name, y)
                text += "".join("G1 X%d E1 F3000\n" % (70 if i % 2 == 0 else 30) for i in range(4))
                text += "EXCLUDE_OBJECT_END NAME=%s\n" % name
        return text + END

    def exclude_in_the_first_layers(self, names):
        layers = 30
        job = self.start(self.two_objects(names, layers))
        self.wait_for_line(job, START.count("\n") + 6)
        self.printer.say("EXCLUDE_OBJECT NAME=" + names[0])
        reached = self.printd.machine()["layer"]
        self.assertLess(reached, layers - 10, "said early, or this says nothing")
        built_mm = self.finish(job)[1]["filament_mm"]["built"]
        other_mm = 4 * layers  # B is whole; A has what was laid down until then, and what was planned ahead
        self.assertGreaterEqual(built_mm, other_mm - 0.1)
        self.assertLessEqual(built_mm, other_mm + 4 * (reached + 2), "typed in layer %d" % reached)

    def test_an_object_is_left_out_from_there_on(self):
        self.exclude_in_the_first_layers(("lid", "box"))

    def test_copies_are_told_apart_by_the_ends_of_their_long_names(self):
        self.exclude_in_the_first_layers(("x" * 67 + "_id_0_copy_0", "x" * 67 + "_id_0_copy_1"))

    def test_twice_as_fast_from_there_on(self):
        job = self.start(there_and_back(40, 600))  # 6 s a line
        self.wait_for_line(job, START.count("\n") + 3)
        before = self.printd.machine()["progress"]
        whole_s = before["elapsed_s"] + before["remaining_s"]
        self.printer.say("M220 S200")
        said_s = self.printd.machine()["print_time_s"]
        printed_s = self.finish(job)[0]["printed_s"]
        self.assertLess(said_s, whole_s - 60, "said early, or this says nothing")
        self.assertLess(printed_s, said_s + (whole_s - before["elapsed_s"]) / 2 + AT_ONCE_S + 0.05 * whole_s)

    def test_twice_as_much_filament_from_there_on(self):
        lines = 40
        job = self.start(there_and_back(lines, 600))
        first = START.count("\n")
        self.wait_for_line(job, first + 3)
        self.printer.say("M221 S200")
        done = self.printd.machine()["line"] - first
        self.assertLess(done, lines - 10, "said early, or this says nothing")
        built_mm = self.finish(job)[1]["filament_mm"]["built"]
        self.assertGreaterEqual(built_mm, done + 2 * (lines - done - 2))
        self.assertLessEqual(built_mm, 2 * lines)


class Clocks(Case):
    """Klipper#175 and #392, OctoPi#606, Buddy#708: a computer without a clock of its own learns the time in mid-print."""
    speed = 20

    def setUp(self):
        found = glob.glob("/usr/lib/*/faketime/libfaketimeMT.so.1")
        if not found or service.SANITIZED:
            self.skipTest("it takes libfaketime, and programs without sanitizers")
        self.printer = Printer(self.speed, lambda folder: self.fake(folder, found[0]), ["--keep-days", "30"])
        self.printd = self.printer.printd

    def fake(self, folder, library):
        self.clock = os.path.join(folder, "clock")
        self.set_clock("+0")
        # What Linux counts since the start does not jump with the date.
        return {"LD_PRELOAD": library, "FAKETIME_TIMESTAMP_FILE": self.clock, "FAKETIME_NO_CACHE": "1", "FAKETIME_DONT_FAKE_MONOTONIC": "1",
                "FAKETIME_DONT_RESET": "1"}

    def set_clock(self, shift):
        with open(self.clock + ".new", "w", encoding="ascii") as file:
            file.write(shift + "\n")
        os.replace(self.clock + ".new", self.clock)

    def date_s(self, job):
        """When it ended, by the service's clock; so it is known that the clock was moved at all."""
        return datetime.datetime.fromisoformat(self.printd.job(job["id"])["ended"].replace("Z", "+00:00")).timestamp()

    def test_a_clock_that_jumps_changes_no_print_and_deletes_nothing(self):
        first = self.start("G28\n", "before.gcode")
        self.printd.wait_for_job(first["id"], "done", 60)
        job = self.start(there_and_back(30, 600))
        line = START.count("\n")
        whole_s = []
        for shift in ("+3650d", "-3650d", "+13h", "-13h"):
            line += 6
            self.wait_for_line(job, line)
            before = self.printd.machine()["progress"]
            self.set_clock(shift)
            self.wait_for_line(job, line + 1)
            behind = self.printd.machine()["progress"]
            self.assertGreaterEqual(behind["elapsed_s"], before["elapsed_s"])
            self.assertLess(behind["elapsed_s"], before["elapsed_s"] + 60, shift)
            whole_s += [each["elapsed_s"] + each["remaining_s"] for each in (before, behind)]
        self.assertLess(max(whole_s) - min(whole_s), 0.1 * whole_s[0], whole_s)
        self.set_clock("+3650d")
        done, _ = self.finish(job)
        self.assertAlmostEqual(done["printed_s"], whole_s[-1], delta=0.1 * whole_s[-1])
        self.assertGreater(self.date_s(job) - time.time(), 3600 * 86400)
        # Ten years are more than the thirty days that jobs are kept: no clock is believed so far.
        time.sleep(2)
        self.assertEqual(self.printd.state_of(first["id"]), "done")
        self.assertEqual(self.printd.request("GET", "/api/v1/jobs/%d/file" % first["id"])[0], 200)


class Booleans(Case):
    """OctoPrint's clients in Python say `True`."""

    def test_print_true_starts_in_any_case(self):
        for said in ("True", "TRUE", "yes", "1"):
            status, answer, _ = self.octoprint(said)
            self.assertEqual(status, 201, answer)
            number = int(answer["files"]["local"]["refs"]["resource"].rsplit("/", 1)[1])
            self.printd.wait_for_job(number, "done", 60)
        status, answer, _ = self.octoprint("perhaps")
        self.assertEqual(status, 400, answer)
        status, answer, _ = self.octoprint("False")
        self.assertEqual(self.printd.state_of(int(answer["files"]["local"]["refs"]["resource"].rsplit("/", 1)[1])), "held")

    def octoprint(self, said):
        boundary = "dialogue"
        body = ("--%s\r\nContent-Disposition: form-data; name=\"print\"\r\n\r\n%s\r\n--%s\r\nContent-Disposition: form-data; name=\"file\"; "
                "filename=\"a.gcode\"\r\n\r\nG28\n\r\n--%s--\r\n" % (boundary, said, boundary, boundary)).encode()
        return self.printd.request("POST", "/api/files/local", body, {"Content-Type": "multipart/form-data; boundary=" + boundary})


if __name__ == "__main__":
    unittest.main(argv=service.configure(sys.argv))
