"""A printer as ./run starts it: the launcher and all its children, on a port and a state folder of its own."""

import http.client
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "service"))
import service  # noqa: E402
from service import wait_until  # noqa: E402

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
MEMORY = "/dev/shm"


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def read(path):
    try:
        with open(path, encoding="utf-8", errors="replace") as file:
            return file.read()
    except OSError:
        return ""


def link_of(path):
    try:
        return os.readlink(path)
    except OSError:
        return None


def holders_of(file):
    """{pid: name} of the processes that have `file` open."""
    holders = {}
    for pid in filter(str.isdigit, os.listdir("/proc")):
        try:
            descriptors = ["/proc/%s/fd/%s" % (pid, fd) for fd in os.listdir("/proc/%s/fd" % pid)]
        except OSError:
            continue
        # One that is closed meanwhile says nothing about the others.
        if any(link_of(each) == file for each in descriptors):
            holders[int(pid)] = read("/proc/%s/comm" % pid).strip()
    holders.pop(os.getpid(), None)
    return holders


class Stack:
    def __init__(self, *options, state=None, port=None, before=()):
        """`before`: what stands before the command. `self.reach` asks from where the printer can be reached."""
        self.state = state or tempfile.mkdtemp(prefix="launcher-e2e-")
        self.port = port or free_port()
        self.options = options
        self.before = list(before)
        self.reach = lambda ask: ask()
        self.said = ""
        self.folders_made = set()
        self.start()

    def start(self):
        command = [os.path.join(os.path.dirname(service.PRINTD), "printer-launcher"), "--state", self.state, "--ui",
                   os.path.join(ROOT, "web", "ui", "dist"), "--port", str(self.port), *self.options]
        self.process = subprocess.Popen(self.before + command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.said = ""
        self.reader = threading.Thread(target=self.listen, args=(self.process.stdout,), daemon=True)
        self.reader.start()

    def listen(self, stream):
        try:
            for line in stream:
                self.said += line
        except ValueError:  # closed, while somebody who outlived the launcher still holds the other end
            pass

    def wait_open(self, timeout_s=90):
        """The address; fails at once, with what was said, when the launcher ends instead."""
        def opened():
            found = re.search(r"Open +(\S+)", self.said)
            if not found and self.process.poll() is not None:
                self.reader.join(timeout=5)
                raise AssertionError("the launcher ended with %d:\n%s" % (self.process.returncode, self.said))
            return found and found[1]
        return wait_until(opened, "the launcher gave its address; it said:\n" + self.said, timeout_s)

    def wait_first_screen(self):
        """All of it, and not the address alone."""
        wait_until(lambda: re.search("--report.*\n", self.said), "the first screen is there; it said:\n" + self.said)

    def wait_end(self, timeout_s=60):
        status = self.process.wait(timeout=timeout_s)
        self.reader.join(timeout=10)
        self.process.stdout.close()
        return status

    def log(self):
        """What the processes said."""
        return read(os.path.join(self.state, "run.log"))

    def report(self):
        """What `./run --report` prints."""
        launcher = os.path.join(os.path.dirname(service.PRINTD), "printer-launcher")
        return subprocess.run([launcher, "--report", "--state", self.state], capture_output=True, text=True, check=True).stdout

    def processes(self):
        """{pid: name} of everything that belongs to this printer."""
        return holders_of(os.path.join(self.state, "run.lock"))

    def folder(self):
        """The folder in memory that its processes use now, by their command lines; None: there is none. Another printer on this machine has
        another."""
        for pid in self.processes():
            found = re.search(MEMORY + r"/(qduinomc\.\w+)/", read("/proc/%d/cmdline" % pid))
            if found:
                self.folders_made.add(found[1])
                return found[1]
        return None

    def folders_left(self):
        """The folders that it made and that are there."""
        self.folder()
        return {name for name in self.folders_made if os.path.exists(os.path.join(MEMORY, name))}

    def pid_of(self, name):
        found = [pid for pid, each in self.processes().items() if each == name[:15]]
        return found[0] if found else None

    def request(self, method, path, body=None, headers=None, timeout_s=20):
        """(status, content); (0, reason) when nobody answers."""
        return self.reach(lambda: self.ask(method, path, body, headers, timeout_s))

    def ask(self, method, path, body, headers, timeout_s):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=timeout_s)
        fields = {"X-Api-Key": read(os.path.join(self.state, "api-key")).strip(), **(headers or {})}
        try:
            connection.request(method, path, body=json.dumps(body).encode() if isinstance(body, dict) else body, headers=fields)
            response = connection.getresponse()
            content = response.read()
            if response.getheader("Content-Type", "").startswith("application/json") and content:
                content = json.loads(content)
            return response.status, content
        except (OSError, http.client.HTTPException) as error:
            return 0, str(error)
        finally:
            connection.close()

    def machine_state(self):
        status, machine = self.request("GET", "/api/v1/machine")
        return machine["state"] if status == 200 else "no answer"

    def stop(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        try:
            return self.wait_end()
        finally:
            for pid in self.processes():  # only after a failure: a test leaves nothing behind
                os.kill(pid, signal.SIGKILL)
            shutil.rmtree(self.state, ignore_errors=True)
