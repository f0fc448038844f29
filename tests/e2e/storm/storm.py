#!/usr/bin/env python3
"""A storm of kills over a printer that works: at random moments of uploads, prints, pauses and cancels, beside two busy processes and
a busy disk, one of its processes is killed with SIGKILL: service, serial port, name on the network, sketch, supervisor, watcher,
virtual machine, launcher (./run). Two blows more come among them: a serial host fills every queue and then says M112, and the disk of
the state folder becomes full while the service is killed.

    tests/e2e/storm/storm.py --kills 1000 [--seed 7]        some 40 minutes; ./test runs a short one

The printer is started with --lan in a network of its own, and a visitor uploads from another computer of it, by TLS. Without root, or
without network namespaces, it listens for this computer alone.

What has to hold, and who says so:

    heat off within 200 ms of the kill      the twin, which sees pins alone (the pulse of a heater that ended, in CLOCK_MONOTONIC).
                                            Not asked where the virtual machine itself was killed: power failed, and it comes back cold;
                                            nor where a process was killed without which the print goes on
    heat off within 200 ms of an M112       the same; from its last byte on, behind more bytes than all queues hold
    who is killed comes back                /proc: watcher, serial port and name within 10 s
    a full disk stops nobody                pause, hold and login are answered, and the killed service comes back
    memory is bounded                       /proc: the most that the service and the port ever took
    no acknowledged upload lost             every job that was answered with 201 is there at the end, byte for byte (SHA-256)
    nothing printed twice                   the journal: one copy is one attempt, begun durably before its first byte left
    nothing left                            no process, no entry in /dev/shm, none at real-time priority, the computer's settings as before

The time of 200 ms is a bound of safety and no measure of speed: what was seen is printed at the end.
"""

import argparse
import collections
import contextlib
import hashlib
import json
import os
import random
import signal
import shutil
import socket
import sqlite3
import ssl
import subprocess
import sys
import tempfile
import threading
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, "..", folder) for folder in ("launcher", "reach", "service")]
from disk_test import LIBC, mount_small_disk, take_last_block  # noqa: E402
from network import Lan, can_make_networks  # noqa: E402
from stack import Stack, read, service  # noqa: E402

HEAT_OFF_S = 0.2
BACK_S = 10
MEMORY_KB_MAX = 256 * 1024
USER = "qduino-printer"
NAME = "qduino-storm"
# Whom to kill, how often among the others. "watcher": the supervisor's own second process.
VICTIMS = {"printd": 5, "printer": 5, "supervisor": 3, "watcher": 2, "virtual-machine": 2, "launcher": 3, "printer-port": 2}
ON_THE_LAN = {"printer-name": 2}
WITH_A_DISK = {"full disk": 2}
M112 = {"M112 behind a full queue": 2}
# The print goes on without them.
BESIDE = ("printd", "watcher", "printer-port", "printer-name")
COMES_BACK = ("watcher", "printer-port", "printer-name")
SETTINGS = ("/proc/sys/kernel/sched_rt_runtime_us", "/proc/irq/default_smp_affinity")


def job_text(generator, number):
    """Heats at once, homes, and draws for some seconds; different for every number."""
    laps = generator.randint(1, 3)
    lines = ["; storm %d" % number, "M104 S200", "M140 S60", "G28", "G90", "G1 Z1 F240"]
    for lap in range(laps):
        size = generator.uniform(20, 90)
        lines += ["G1 X10 Y10 F7000", "G1 X%.2f Y10" % size, "G1 X%.2f Y%.2f" % (size, size), "G1 X10 Y%.2f Z%.2f" % (size, 1 + lap * 0.1)]
    lines += ["; " + "%0512x" % generator.getrandbits(2048)] * generator.randint(1, 400)  # up to 200 KB to spool
    return ("\n".join(lines + ["M104 S0", "M140 S0", "M84"]) + "\n").encode()


class Load:
    """Two processes that compute and one that writes and syncs, as ordinary processes."""

    def __init__(self):
        self.folder = tempfile.mkdtemp(prefix="storm-load-")
        spin = [sys.executable, "-c", "while True: sum(range(100000))"]
        disk = [sys.executable, "-c", "import os,sys\nwhile True:\n f=open(sys.argv[1],'wb'); [f.write(os.urandom(1<<20)) for _ in range(8)]"
                                      "; f.flush(); os.fsync(f.fileno()); f.close()", os.path.join(self.folder, "load")]
        self.processes = [subprocess.Popen(command) for command in (spin, spin, disk)]

    def stop(self):
        for process in self.processes:
            process.kill()
            process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)


class Storm:
    def __init__(self, seed, kills):
        self.random = random.Random(seed)
        self.victims = dict(VICTIMS, **M112)
        self.lan = None if can_make_networks() else Lan(["printer", "visitor"])
        self.state = tempfile.mkdtemp(prefix="storm-")
        self.has_disk = mount_small_disk(self.state, 160 + kills // 2) is None  # room for every upload
        os.chmod(self.state, 0o755)
        options, before = ["--serial-port", "pty"], []
        if os.geteuid() == 0:
            options += ["--run-as", USER]
        if self.lan:
            options += ["--lan", "--name", NAME]
            before = ["nsenter", "--net=/run/netns/" + self.lan.spaces["printer"]]
            self.victims.update(ON_THE_LAN)
        if self.has_disk:
            self.victims.update(WITH_A_DISK)
        self.stack = Stack(*options, state=self.state, before=before)
        if self.lan:
            self.stack.reach = lambda ask: self.lan.on("printer", ask)
        self.memory_kb = collections.Counter()
        self.refused = 0
        self.hands = threading.Lock()  # of who operates the printer
        self.acknowledged = {}  # job → SHA-256
        self.heat_off_ms = collections.defaultdict(list)
        self.kills = collections.Counter()
        self.failures = []
        self.stopping = threading.Event()
        self.uploads = 0

    def fail(self, what):
        self.failures.append(what)
        print("FAILED: " + what, flush=True)

    # ---- what people do meanwhile ----------------------------------------------------------------

    def upload_on(self):
        generator = random.Random(self.random.random())
        while not self.stopping.is_set():
            self.uploads += 1
            content = job_text(generator, self.uploads)
            name = "storm%d.gcode" % self.uploads
            fields = {"Print-After-Upload": "?1"} if generator.random() < 0.6 else {}
            status, job = self.stack.request("PUT", "/api/v1/jobs/" + name, content, fields)
            if status == 201:
                self.acknowledged[job["id"]] = hashlib.sha256(content).hexdigest()
            time.sleep(generator.uniform(0.3, 3) if len(self.acknowledged) < 400 else 3)

    def visit(self):
        """From another computer, by TLS, believing the printer's own certificate alone."""
        generator = random.Random(self.random.random())
        number = 0
        while self.lan and not self.stopping.is_set():
            time.sleep(generator.uniform(1, 4))
            number += 1
            content = job_text(generator, 100_000 + number)
            try:
                job = self.upload_by_tls("visit%d.gcode" % number, content)
            except (OSError, ValueError):
                continue
            self.acknowledged[job] = hashlib.sha256(content).hexdigest()

    def upload_by_tls(self, name, content):
        """The job's number; ValueError: it was not taken."""
        context = ssl.create_default_context(cafile=os.path.join(self.state, "tls", "certificate.pem"))
        here = self.lan.address["printer"]
        head = "PUT /api/v1/jobs/%s HTTP/1.1\r\nHost: %s:%d\r\nX-Api-Key: %s\r\nContent-Length: %d\r\nConnection: close\r\n\r\n" % (
            name, here, self.stack.port, read(os.path.join(self.state, "api-key")).strip(), len(content))
        answer = b""
        with context.wrap_socket(self.lan.connect("visitor", here, self.stack.port), server_hostname=here) as wire:
            wire.sendall(head.encode() + content)
            while piece := wire.recv(65536):
                answer += piece
        head, _, body = answer.partition(b"\r\n\r\n")
        if not head.startswith(b"HTTP/1.1 201"):
            raise ValueError(head)
        return json.loads(body)["id"]

    def operate(self):
        generator = random.Random(self.random.random())
        while not self.stopping.is_set():
            with self.hands:
                for path in ("/api/v1/machine/bed-cleared", "/api/v1/queue/release", "/api/v1/machine/clear-fault"):
                    self.stack.request("POST", path)
                what = generator.choices(("pause", "resume", "cancel", "nothing"), (2, 8, 1, 12))[0]
                if what != "nothing":
                    self.stack.request("POST", "/api/v1/machine/" + what)
            time.sleep(generator.uniform(0.05, 0.6))

    # ---- the kills -------------------------------------------------------------------------------

    def victim_pid(self, victim):
        processes = self.stack.processes()
        if victim == "launcher":
            return self.stack.process.pid if self.stack.process.poll() is None else None
        named = {"supervisor": "qduino-supervisor", "watcher": "heat-watch"}.get(victim, victim)[:15]
        found = [pid for pid, name in processes.items() if name == named]
        return min(found) if found else None

    def ask_twin(self):
        """The twin's heaters, and none when there is no answer."""
        folder = self.stack.folder()
        try:
            with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
                connection.settimeout(2)
                connection.connect("/dev/shm/%s/inspect" % folder)
                connection.sendall(b'{"op":"state"}\n')
                return json.loads(connection.makefile().readline())
        except (OSError, ValueError):
            return None

    def heat_after(self, victim, killed_at, was_hot):
        """Waits until the twin has seen both heaters off; counts how long that took."""
        end = time.monotonic() + 10
        while time.monotonic() < end:
            state = self.ask_twin()
            if state and all(state[name]["duty"] == 0 for name in ("hot_end", "bed")):
                off_s = max(state[name]["off_since_s"] for name in ("hot_end", "bed"))
                return self.count_heat(victim, off_s - killed_at, was_hot)
            if not state and victim == "launcher":  # it has ended: its last words
                return self.count_last_words(killed_at, was_hot)
            time.sleep(0.01)
        self.fail("%s killed: no heat-off seen within 10 s" % victim)

    def count_heat(self, victim, took_s, was_hot):
        if not was_hot:
            return
        self.heat_off_ms[victim].append(max(took_s, 0) * 1000)
        if took_s > HEAT_OFF_S:
            self.fail("%s killed: heat off after %.0f ms" % (victim, took_s * 1000))

    def count_last_words(self, killed_at, was_hot):
        self.stack.reader.join(timeout=30)
        words = self.stack.said + self.stack.log()  # the machine speaks into the log
        if "left ON" in words:
            self.fail("launcher killed: the machine ended with a heater on")
        times = [float(line.split()[-2]) for line in words.splitlines() if " off since " in line]
        if was_hot and not times:
            self.fail("launcher killed: no last word of the machine:\n" + words[-600:])
        elif was_hot:
            self.count_heat("launcher", max(times) - killed_at, True)

    def say_m112(self):
        """More than all queues hold, and then M112. The instant when its last byte was taken; None: there is no port now."""
        try:
            port = os.open(os.path.join(self.state, "serial"), os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError:
            return None
        rest = b"G4 P1\n" * 50_000 + b"M112\n"
        until = time.monotonic() + 10
        try:
            while rest and time.monotonic() < until:
                try:
                    rest = rest[os.write(port, rest[:4096]):]
                except BlockingIOError:
                    time.sleep(0.001)
            return None if rest else time.monotonic()
        except OSError:
            return None
        finally:
            os.close(port)

    def stop_by_m112(self, victim):
        def listeners():
            return [self.victim_pid(name) for name in ("printer-port", "printer")]
        with self.hands:  # nobody clears the fault before it was seen
            before, there = self.ask_twin(), listeners()
            if not before or None in there or self.stack.machine_state() in ("no answer", "disconnected", "starting", "faulted"):
                return False
            said_at = self.say_m112()
            if said_at is None or listeners() != there:  # nobody has heard it
                return False
            self.kills[victim] += 1
            self.heat_after(victim, said_at, is_hot(before))
        return True

    def answered_on_a_full_disk(self, path, body=None):
        status, said = self.stack.request("POST", path, body)
        if status // 100 != 2 and status != 409:
            self.fail("with a full disk %s is answered by %d: %s" % (path, status, said))

    def wait_for_kept_room(self):
        """The disk was full a moment ago, and has room again: the service takes some for the next time within a second."""
        until = time.monotonic() + BACK_S
        while not os.path.exists(os.path.join(self.state, "ballast")):
            if time.monotonic() > until:
                return self.fail("the disk has room, and the service has kept none of it for a full disk for %d s" % BACK_S)
            time.sleep(0.05)
        return None

    def fill_disk(self, victim):
        """Takes the last block, kills the service, and asks for what must work then."""
        login = {"key": read(os.path.join(self.state, "api-key")).strip()}
        try:
            self.wait_for_kept_room()
            pid = self.victim_pid("printd")
            if pid is None:
                return False
            os.kill(pid, signal.SIGSTOP)  # or the room that it gives up meanwhile would be taken, too
            take_last_block(self.state)
            os.kill(pid, signal.SIGKILL)
            self.wait_alive()
            for path, body in (("/api/v1/queue/hold", None), ("/api/v1/machine/pause", None), ("/api/v1/session", login)):
                self.answered_on_a_full_disk(path, body)
            take_last_block(self.state)  # what was given up, too
            self.answered_on_a_full_disk("/api/v1/session", login)
        except ProcessLookupError:
            return False
        finally:
            with contextlib.suppress(FileNotFoundError):
                os.unlink(os.path.join(self.state, "filler"))
        self.kills[victim] += 1
        return True

    def note_memory(self):
        for name in ("printd", "printer-port"):
            for pid, each in self.stack.processes().items():
                peak = [line.split()[1] for line in read("/proc/%d/status" % pid).splitlines() if line.startswith("VmHWM")]
                if each == name and peak:
                    self.memory_kb[name] = max(self.memory_kb[name], int(peak[0]))

    def kill_one(self):
        victim = self.random.choices(list(self.victims), self.victims.values())[0]
        self.note_memory()
        if victim in M112:
            return self.stop_by_m112(victim)
        if victim in WITH_A_DISK:
            return self.fill_disk(victim)
        pid = self.victim_pid(victim)
        if pid is None:
            return False
        before = self.ask_twin() if victim not in (*BESIDE, "virtual-machine") else None
        was_hot = is_hot(before)
        killed_at = time.monotonic()
        try:
            os.kill(pid, signal.SIGKILL)
        except ProcessLookupError:  # it has ended by itself, meanwhile: with the one that was killed last
            return False
        self.kills[victim] += 1
        if victim == "launcher":
            self.stack.process.wait()
        if before:
            self.heat_after(victim, killed_at, was_hot)
        if victim in COMES_BACK:
            self.await_another(victim, pid)
        if victim == "launcher":
            self.stack.wait_end()
            self.stack.start()
        return True

    def await_another(self, victim, old):
        end = time.monotonic() + BACK_S
        while time.monotonic() < end:
            if self.victim_pid(victim) not in (None, old):
                return
            time.sleep(0.05)
        self.fail("%s killed: no other was started within %d s" % (victim, BACK_S))

    def wait_alive(self):
        """Until the printer answers and is connected. Fails with what the launcher said."""
        end = time.monotonic() + 90
        while time.monotonic() < end:
            if self.stack.process.poll() is not None:
                self.stack.reader.join(timeout=5)
                if " is refused on core" in self.stack.said:  # the computer's interrupts took too much when it was measured
                    self.refused += 1
                    self.stack.start()
                    continue
                raise AssertionError("the launcher has ended with %s:\n" % self.stack.process.returncode + self.stack.said[-3000:])
            if self.stack.machine_state() not in ("no answer", "disconnected", "starting"):
                return
            time.sleep(0.1)
        raise AssertionError("the printer did not come back:\n" + self.stack.said[-3000:])

    def run(self, kills):
        self.stack.wait_open()
        self.wait_alive()
        people = [threading.Thread(target=work, daemon=True) for work in (self.upload_on, self.visit, self.operate)]
        for person in people:
            person.start()
        started = time.monotonic()
        while sum(self.kills.values()) < kills:
            # Mostly in quick succession; now and then long enough for a job to be printed to its
            # end.
            time.sleep(self.random.expovariate(1 / 0.7) if self.random.random() < 0.97 else self.random.uniform(10, 22))
            if self.kill_one() and sum(self.kills.values()) % 10 == 0:
                print("%4d kills, %4d uploads acknowledged, %5.0f s" % (sum(self.kills.values()), len(self.acknowledged),
                                                                      time.monotonic() - started), flush=True)
            if self.random.random() < 0.5:
                self.wait_alive()
        self.stopping.set()
        for person in people:
            person.join(timeout=60)
        self.wait_alive()

    def remove(self):
        """What it has made beside the printer."""
        if self.has_disk:
            LIBC.umount2(self.state.encode(), 2)
        shutil.rmtree(self.state, ignore_errors=True)
        if self.lan:
            self.lan.remove()

    # ---- what has to hold at the end -------------------------------------------------------------

    def check_uploads(self):
        for job, digest in sorted(self.acknowledged.items()):
            status, content = self.stack.request("GET", "/api/v1/jobs/%d/file" % job)
            if status != 200 or hashlib.sha256(content).hexdigest() != digest:
                self.fail("job %d was acknowledged, and now %s" % (job, status if status != 200 else "has other bytes"))

    def check_journal(self):
        """After the service has ended. (printed jobs, attempts)"""
        with sqlite3.connect("file:%s?mode=ro" % os.path.join(self.stack.state, "journal.sqlite"), uri=True) as journal:
            rows = journal.execute("SELECT job, outcome FROM runs ORDER BY id").fetchall()
        # Every job has one copy, and nobody starts a failed one again: one attempt each is all
        # there may be.
        for job, attempts in collections.Counter(job for job, _ in rows).items():
            if attempts > 1:
                self.fail("job %d has one copy, and was begun %d times" % (job, attempts))
        return sum(outcome == "completed" for _, outcome in rows), len(rows)

    def check_memory(self):
        for name, peak_kb in self.memory_kb.items():
            print("memory: %s took %.1f MB at most" % (name, peak_kb / 1024))
            if peak_kb > MEMORY_KB_MAX:
                self.fail("%s took %d KB" % (name, peak_kb))

    def check_nothing_left(self, settings):
        if self.stack.processes():
            self.fail("processes left: %s" % self.stack.processes())
        if self.stack.folders_left():
            self.fail("left in memory: %s" % self.stack.folders_left())
        for path, before in settings.items():
            if read(path) != before:
                self.fail("%s is %s and was %s" % (path, read(path).strip(), before.strip()))
        if read("/run/qduino/settings.state"):
            self.fail("a change of the computer was not undone")


def is_hot(twin):
    return bool(twin) and any(twin[name]["duty"] > 0 for name in ("hot_end", "bed"))


def real_time_processes():
    """{pid: name} of ordinary programs at a real-time policy (kernel threads have no command line)."""
    found = {}
    for pid in filter(str.isdigit, os.listdir("/proc")):
        for thread in os.listdir("/proc/%s/task" % pid) if os.path.exists("/proc/%s/task" % pid) else ():
            fields = read("/proc/%s/task/%s/stat" % (pid, thread)).rpartition(")")[2].split()
            if len(fields) > 38 and int(fields[38]) in (1, 2, 6) and read("/proc/%s/cmdline" % pid):
                found[int(pid)] = read("/proc/%s/comm" % pid).strip()
    return found


def main():
    parser = argparse.ArgumentParser(description="Kills the printer's processes at random moments, and checks what has to hold.")
    parser.add_argument("--programs", default="build/release/bin", help="folder of the printer's programs")
    parser.add_argument("--kills", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=random.randrange(1 << 30))
    arguments = parser.parse_args()
    service.PRINTD = os.path.abspath(os.path.join(arguments.programs, "printd"))
    print("storm: seed %d" % arguments.seed, flush=True)
    settings = {path: read(path) for path in SETTINGS}
    real_time_before = set(real_time_processes())
    storm = Storm(arguments.seed, arguments.kills)
    load = Load()
    try:
        storm.run(arguments.kills)
        storm.check_uploads()
        storm.check_memory()
        storm.stack.process.send_signal(signal.SIGTERM)
        storm.stack.wait_end()
        printed, attempts = storm.check_journal()
        storm.check_nothing_left(settings)
        left = {pid: name for pid, name in real_time_processes().items() if pid not in real_time_before}
        if left:
            storm.fail("left at real-time priority: %s" % left)
        print("kills: %s" % dict(storm.kills))
        print("a sketch that came back was refused by admission: %d times" % storm.refused)
        print("uploads acknowledged %d, attempts to print %d, printed to the end %d" % (len(storm.acknowledged), attempts, printed))
        for victim, times in sorted(storm.heat_off_ms.items()):
            times.sort()
            print("heat off after %-24s: %3d times hot, median %5.1f ms, worst %5.1f ms" %
                  (victim, len(times), times[len(times) // 2], times[-1]))
    finally:
        load.stop()
        storm.stopping.set()
        storm.stack.stop()
        storm.remove()
    print("%d kills, %d failures" % (sum(storm.kills.values()), len(storm.failures)))
    return 1 if storm.failures else 0


if __name__ == "__main__":
    sys.exit(main())
