"""A full disk, and a state folder that vanishes: what must work then works, and the rest is refused with its reason.

The disk is a small file system in memory, mounted for this process alone.
"""

import ctypes
import json
import os
import shutil
import signal
import sys
import unittest

import service
from service import Folder, Printd, Sketch, gcode, wait_until

CLONE_NEWNS, MS_REC, MS_PRIVATE = 0x20000, 0x4000, 1 << 18
LIBC = ctypes.CDLL(None, use_errno=True)
DISK_MIB = 160


def mount_small_disk(path, mib=DISK_MIB):
    """Why it cannot be; None: it is mounted, and seen by this process and its children alone."""
    if os.geteuid() != 0:
        return "only root can mount a small disk: run this test as root"
    if LIBC.unshare(CLONE_NEWNS) != 0 or LIBC.mount(None, b"/", None, MS_REC | MS_PRIVATE, None) != 0:
        return "no mount namespaces here"
    if LIBC.mount(b"small", path.encode(), b"tmpfs", 0, b"mode=0700,size=%dm" % mib) != 0:
        return "no tmpfs can be mounted here"
    return None


def take_last_block(folder):
    """By a file "filler" in `folder`, which grows until its disk is full."""
    with open(os.path.join(folder, "filler"), "ab", buffering=0) as filler:
        for size in (1 << 20, 4096, 1):
            try:
                while filler.write(b"x" * size) == size:
                    pass
            except OSError:
                continue


class FullDisk(unittest.TestCase):
    def setUp(self):
        self.folder = Folder()
        self.addCleanup(self.folder.remove)
        state = os.path.join(self.folder.path, "state")
        os.makedirs(state)
        why = mount_small_disk(state)
        if why:
            self.skipTest(why)
        self.addCleanup(LIBC.umount2, state.encode(), 2)
        self.sketch = Sketch(self.folder.path, 1_000_000)
        self.addCleanup(self.sketch.stop)
        self.printd = Printd(self.folder.path)
        self.addCleanup(self.printd.stop)
        wait_until(lambda: self.printd.machine()["connected"], "the service found the machine")

    def fill(self):
        take_last_block(self.printd.state)
        self.assertEqual(os.statvfs(self.printd.state).f_bavail, 0)

    def login(self):
        return self.printd.request("POST", "/api/v1/session", json.dumps({"key": self.printd.key}), key=False)

    def test_with_the_last_block_taken_its_owner_can_still_act(self):
        first, second = (self.printd.put(name, gcode(5000, seed))[1] for seed, name in enumerate(("a.gcode", "b.gcode")))
        self.fill()
        status, _, headers = self.login()
        self.assertEqual(status, 204)
        cookie = headers["Set-Cookie"].split(";")[0]
        self.assertEqual(self.printd.request("GET", "/api/v1/jobs", headers={"Cookie": cookie}, key=False)[0], 200)
        self.assertEqual(self.printd.request("POST", "/api/v1/queue/hold")[0] // 100, 2)
        self.assertEqual(self.printd.request("DELETE", "/api/v1/jobs/%d" % first["id"])[0], 204)
        self.assertEqual(self.printd.request("POST", "/api/v1/machine/emergency-stop")[0], 202)
        self.fill()  # what was given up, too
        self.assertEqual(self.login()[0], 204)
        self.assertEqual(self.printd.request("POST", "/api/v1/machine/emergency-stop")[0], 202)
        status, answer, _ = self.printd.put("c.gcode", gcode(5000, 3))
        self.assertEqual(status, 507, answer)
        os.unlink(os.path.join(self.printd.state, "filler"))
        wait_until(lambda: self.printd.put("c.gcode", gcode(5000, 3))[0] == 201, "it takes uploads again")
        self.assertEqual(sorted(job["name"] for job in self.printd.jobs()), ["b.gcode", "c.gcode"])
        self.printd.stop()
        self.printd.start()
        self.assertEqual(sorted(job["name"] for job in self.printd.jobs()), ["b.gcode", "c.gcode"])
        self.assertIsNotNone(second)

    def test_a_killed_service_comes_back_on_a_full_disk_and_its_owner_can_act(self):
        for seed in range(12):
            self.printd.put("%d.gcode" % seed, gcode(5000, seed))
        self.printd.process.send_signal(signal.SIGSTOP)  # or the room that it gives up meanwhile is taken, too
        self.fill()
        self.printd.kill()
        self.printd.start()
        wait_until(lambda: self.printd.machine()["connected"], "the service found the machine")
        self.assertTrue(os.path.exists(os.path.join(self.printd.state, "ballast")))
        self.assertEqual(self.login()[0], 204)
        for _ in range(20):
            for path in ("queue/hold", "queue/release"):
                status, answer, _ = self.printd.request("POST", "/api/v1/" + path)
                self.assertEqual(status, 202, (path, answer))
        self.assertFalse(os.path.exists(os.path.join(self.printd.state, "ballast")), "the kept room was needed")
        self.assertEqual(self.printd.request("DELETE", "/api/v1/jobs/%d" % self.printd.jobs()[0]["id"])[0], 204)

    def test_a_state_folder_that_vanishes_is_told(self):
        self.assertEqual(self.printd.request("GET", "/healthz", key=False)[0], 200)
        for entry in os.scandir(self.printd.state):
            shutil.rmtree(entry.path) if entry.is_dir() else os.unlink(entry.path)
        status, answer, _ = self.printd.request("GET", "/healthz", key=False)
        self.assertEqual(status, 503)
        self.assertIn(b"vanished", answer if isinstance(answer, bytes) else answer.encode())


if __name__ == "__main__":
    unittest.main(argv=service.configure(sys.argv), verbosity=2)
