"""The printer on the Linux board, end to end and in real time: virtual machine, supervisor, sketch, print service.

What was built is asked of the twin, which saw pins alone. Run by ctest, one test at a time.
"""

import json
import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "service"))
import service  # noqa: E402
from service import Printd, wait_until  # noqa: E402


def square_job(laps, corner=60):
    """Homes, then runs around a square with Z rising: about 2.6 s a lap."""
    lines = ["G28", "G90", "G1 Z1 F240", "G1 X20 Y20 F5400"]
    for lap in range(laps):
        z = 1 + lap * 0.05
        lines += ["G1 X%d Y20" % corner, "G1 X%d Y%d Z%.3f" % (corner, corner, z), "G1 X20 Y%d" % corner, "G1 X20 Y20"]
    return ("\n".join(lines) + "\nM84\n").encode()


def large_job(size, seed):
    """About `size` bytes of good G-code, different for every seed."""
    return b"; job %d\nG28\n" % seed + b"G1 X10 Y10 F3000\nG1 X100 Y100\n" * (size // 30)


def heating_job():
    """Heats from its first line on, while it homes and moves."""
    return b"M104 S200\nM140 S60\nG28\n" + b"G1 X10 F3000\nG1 X100\n" * 200


class Printer:
    """All processes of one printer, on pins and a link of their own."""

    def __init__(self, faults=()):
        self.programs = os.path.dirname(service.PRINTD)
        self.folder = tempfile.mkdtemp(prefix="printer-e2e-")
        self.memory = tempfile.mkdtemp(prefix="printer-e2e-", dir="/dev/shm")
        self.pins = os.path.join(self.memory, "pins")
        self.link = os.path.join(self.memory, "link")
        self.inspect = os.path.join(self.memory, "inspect")
        self.log = open(os.path.join(self.folder, "machine.log"), "ab")
        self.machine = self.program("virtual-machine", "--pins", self.pins, "--inspect", self.inspect,
                                    *[word for fault in faults for word in ("--fault", fault)])
        wait_until(lambda: os.path.exists(self.pins) and os.path.exists(self.inspect), "the machine is there")
        self.supervisor = self.program("qduino-supervisor", "--pins", self.pins, "--link", self.link, "--restart", "--",
                                       os.path.join(self.programs, "printer"), "--pins", self.pins, "--link", self.link)
        wait_until(lambda: os.path.exists(self.link), "the sketch made its link")
        os.symlink(self.link, os.path.join(self.folder, "link"))
        self.printd = Printd(self.folder, ["--inspect", self.inspect])
        self.wait_for_state("idle")

    def program(self, name, *arguments):
        return subprocess.Popen([os.path.join(self.programs, name), *arguments], stdout=self.log, stderr=self.log)

    def wait_for_state(self, state):
        wait_until(lambda: self.printd.machine()["state"] == state, "the printer is " + state)

    def wait_for_job(self, number, state, timeout_s=120):
        wait_until(lambda: self.printd.state_of(number) == state, "job %d is %s" % (number, state), timeout_s)

    def ask_twin(self, **question):
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
            connection.settimeout(10)
            connection.connect(self.inspect)
            connection.sendall(json.dumps(question).encode() + b"\n")
            return json.loads(connection.makefile().readline())

    def heater_duties(self):
        state = self.ask_twin(op="state")
        return {name: state[name]["duty"] for name in ("hot_end", "bed")}

    def sketch_pid(self):
        children = subprocess.run(["pgrep", "-P", str(self.supervisor.pid)], capture_output=True, text=True, check=False)
        return int(children.stdout.split()[0]) if children.stdout.split() else None

    def inspection(self, number):
        status, report, _ = self.printd.request("GET", "/api/v1/jobs/%d/inspection" % number)
        return report if status == 200 else None

    def stop(self):
        self.printd.stop()
        for process in (self.supervisor, self.machine):
            process.send_signal(signal.SIGTERM)
            process.wait(timeout=30)
        self.log.close()
        shutil.rmtree(self.folder)
        shutil.rmtree(self.memory)


class Case(unittest.TestCase):
    faults = ()

    def setUp(self):
        self.printer = Printer(self.faults)
        self.printd = self.printer.printd

    def tearDown(self):
        self.printer.stop()

    def upload(self, content, name="part.gcode"):
        status, job, _ = self.printd.upload(name, content, print="true")
        self.assertEqual(status, 201, job)
        return job["id"]

    def assert_built_as_asked(self, number):
        report = wait_until(lambda: self.printer.inspection(number), "the twin has reported")
        self.assertTrue(report["matches"], report.get("differences"))
        self.assertEqual(sum(report["lost_steps"].values()) if isinstance(report["lost_steps"], dict)
                         else report["lost_steps"], 0)


class Prints(Case):
    def test_a_job_prints_while_uploads_arrive(self):
        number = self.upload(square_job(8))
        generator = random.Random(7)
        waiting = []

        def send():
            for i in range(12):
                time.sleep(generator.uniform(0.1, 1.5))
                content = large_job(int(10 ** generator.uniform(4.7, 7.3)), i)
                waiting.append(self.printd.put("later%d.gcode" % i, content)[1]["id"])

        sender = threading.Thread(target=send)
        sender.start()
        self.printer.wait_for_job(number, "done")
        sender.join()
        self.assert_built_as_asked(number)
        self.assertEqual(len(set(waiting)), 12)
        states = [self.printd.state_of(each) for each in waiting]
        self.assertEqual(states, ["held"] * 12, "what was not asked to print waits for a person")

    def test_a_line_too_hot_is_refused_before_anything_moves(self):
        status, answer, _ = self.printd.upload("hot.gcode", b"G28\nM104 S999\n", print="true")
        self.assertEqual(status, 422)
        self.assertEqual(answer["error"]["line"], 2)
        self.assertIn("999", answer["error"]["message"])
        self.assertEqual(self.printd.jobs(), [])


class KilledService(Case):
    def test_the_print_goes_on_and_is_printed_once(self):
        number = self.upload(square_job(12))
        then = self.upload(square_job(1), "next.gcode")
        generator = random.Random(11)
        for _ in range(6):
            time.sleep(generator.uniform(0.3, 4))
            self.printd.kill()
            time.sleep(generator.uniform(0, 1))
            self.printd.start()
        self.printer.wait_for_job(number, "done")
        self.assert_built_as_asked(number)
        self.printer.wait_for_job(then, "done")
        self.assert_built_as_asked(then)


class KilledSketch(Case):
    kills = 10

    def test_heat_goes_off_the_job_fails_and_the_queue_stays(self):
        generator = random.Random(13)
        was_hot = 0
        for _ in range(self.kills):
            number = self.upload(heating_job())
            other = self.upload(square_job(1), "other.gcode")
            wait_until(lambda: self.printd.state_of(number) == "printing", "it prints")
            time.sleep(generator.uniform(0, 4))  # anywhere: before it heats, while it homes, while it moves
            was_hot += self.printer.heater_duties()["hot_end"] > 0
            os.kill(self.printer.sketch_pid(), signal.SIGKILL)
            time.sleep(1)
            duties = self.printer.heater_duties()
            self.assertEqual(duties, {"hot_end": 0, "bed": 0}, "a second later no heater is on")
            self.printer.wait_for_job(number, "failed")
            self.assertIn(self.printd.state_of(other), ("queued", "held"))
            self.assertTrue(self.printd.job(number)["error"])
            self.printer.wait_for_state("idle")  # the supervisor has started it anew
            for each in (number, other):
                self.assertEqual(self.printd.request("DELETE", "/api/v1/jobs/%d" % each)[0], 204)
            self.assertEqual(self.printd.request("POST", "/api/v1/queue/release")[0] // 100, 2)
        self.assertGreaterEqual(was_hot, self.kills // 2, "most kills came while a heater was on")


class SilentSensor(Case):
    faults = ("bus_silent@12",)

    def test_heat_is_cut_and_the_job_fails_with_the_reason(self):
        number = self.upload(heating_job())
        self.printer.wait_for_job(number, "failed")
        self.assertIn("does not answer", self.printd.job(number)["error"])
        self.assertEqual(self.printer.heater_duties(), {"hot_end": 0, "bed": 0})
        self.assertEqual(self.printd.machine()["state"], "faulted")


if __name__ == "__main__":
    unittest.main(argv=service.configure(sys.argv), verbosity=2)
