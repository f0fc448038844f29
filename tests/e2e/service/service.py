"""What the end-to-end tests of the print service share: real processes, real sockets, nothing but the standard library."""

import base64
import http.client
import json
import os
import random
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time

PRINTD, FAKE_SKETCH, SANITIZED = None, None, False
THOROUGH = "QDUINO_EMULATED" in os.environ  # ./test --all
ENDED = ("done", "cancelled", "failed")
WATCHED = {}  # name: (process, path of its log or None), of what must live while anything is waited for


def configure(arguments):
    """Takes the programs' paths off the command line (CMakeLists.txt puts them there)."""
    global PRINTD, FAKE_SKETCH, SANITIZED
    PRINTD, FAKE_SKETCH, sanitizers = arguments[1:4]
    SANITIZED = sanitizers != ""
    return [arguments[0]] + arguments[4:]


def tail_of(path, size=2000):
    with open(path, "rb") as file:
        file.seek(max(0, os.path.getsize(path) - size))
        return file.read().decode(errors="replace")


def in_vain(what, why):
    """The error of a wait: what for, why it will not come, and what the processes said last."""
    paths = sorted({log for _, log in WATCHED.values() if log and os.path.exists(log)})
    logs = ["\n--- %s\n%s" % (os.path.basename(path), tail_of(path)) for path in paths]
    return AssertionError("waited in vain until %s: %s%s" % (what, why, "".join(logs)))


def check_processes(what):
    for name, (process, _) in WATCHED.items():
        if process.poll() is not None:
            raise in_vain(what, "%s has ended with status %d" % (name, process.returncode))


def wait_until(condition, what, timeout_s=30):
    """The value of `condition` once it is true. Waits, and never asserts how long; but not for what will not come: `condition` may raise
    Hopeless, and a process that has died ends the wait at once."""
    limit_s = timeout_s * (4 if SANITIZED else 1)
    end = time.monotonic() + limit_s
    while time.monotonic() < end:
        check_processes(what)
        try:
            value = condition()
        except Hopeless as hopeless:
            raise in_vain(what, hopeless) from None
        except OSError:
            check_processes(what)  # that says more than "connection refused"
            raise
        if value:
            return value
        time.sleep(0.02)
    raise in_vain(what, "it did not come about within %d s" % limit_s)


class Hopeless(Exception):
    """What is waited for will not come; says why."""


def gcode(size, seed=0):
    """`size` bytes of harmless G-code, different for every seed."""
    generator = random.Random(seed)
    lines = ["; seed %d\n" % seed, "G28\n"]
    length = sum(map(len, lines))
    while length < size - 40:
        lines.append("G1 X%.3f Y%.3f F6000\n" % (generator.uniform(0, 150), generator.uniform(0, 150)))
        length += len(lines[-1])
    lines.append(";" + "-" * (size - length - 2) + "\n")
    return "".join(lines).encode()


class Sketch:
    """The stand-in sketch as a process."""

    def __init__(self, folder, rate):
        self.log = os.path.join(folder, "sketch.log")
        self.link = os.path.join(folder, "link")
        self.process = subprocess.Popen([FAKE_SKETCH, "--link", self.link, "--log", self.log, "--rate", str(rate)])
        WATCHED["the sketch"] = (self.process, self.log)
        wait_until(lambda: os.path.exists(self.link), "the sketch made its link")

    def events(self):
        if not os.path.exists(self.log):
            return []
        with open(self.log, encoding="utf-8", errors="replace") as file:
            return [line.split() for line in file.read().splitlines()]

    def bytes_of(self, run):
        path = "%s.%s" % (self.log, run)
        if not os.path.exists(path):
            return b""
        with open(path, "rb") as file:
            return file.read()

    def stop(self, how=signal.SIGTERM):
        WATCHED.pop("the sketch", None)
        if self.process.poll() is None:
            self.process.send_signal(how)
        self.process.wait()


class Printd:
    """The service as a process, with a client that speaks to it."""

    def __init__(self, folder, options=(), listen="127.0.0.1:0", wrapper=()):
        self.folder = folder
        self.listen = listen
        self.state = os.path.join(folder, "state")
        self.options = list(options)
        self.wrapper = list(wrapper)  # a command that starts it
        self.process = None
        self.start()

    def start(self):
        command = [*self.wrapper, PRINTD, "--state", self.state, "--link", os.path.realpath(os.path.join(self.folder, "link")), "--listen", self.listen,
                   "--print-link"] + self.options
        with open(os.path.join(self.folder, "printd.log"), "ab") as log:
            self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True)
        WATCHED["printd"] = (self.process, log.name)
        address = self.process.stdout.readline()
        if not address:
            raise AssertionError("printd did not start: " + self.log()[-2000:])
        self.line = address
        self.port = int(address.split(":")[2].split("/")[0])
        with open(os.path.join(self.state, "api-key"), encoding="ascii") as file:
            self.key = file.read().strip()

    def log(self):
        with open(os.path.join(self.folder, "printd.log"), encoding="utf-8", errors="replace") as file:
            return file.read()

    def kill(self):
        WATCHED.pop("printd", None)
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()

    def stop(self):
        WATCHED.pop("printd", None)
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        status = self.process.wait(timeout=60)
        self.process.stdout.close()
        return status

    def request(self, method, path, body=None, headers=None, key=True, timeout_s=60):
        """(status, parsed JSON or bytes, headers) of one request."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=timeout_s)
        fields = dict(headers or {})
        if key:
            fields["X-Api-Key"] = self.key
        if isinstance(body, dict):
            body = json.dumps(body).encode()
        try:
            connection.request(method, path, body=body, headers=fields)
            response = connection.getresponse()
            content = response.read()
            if response.getheader("Content-Type", "").startswith("application/json") and content:
                content = json.loads(content)
            return response.status, content, dict(response.getheaders())
        finally:
            connection.close()

    def jobs(self):
        return self.request("GET", "/api/v1/jobs")[1]["jobs"]

    def job(self, number):
        return self.request("GET", "/api/v1/jobs/%d" % number)[1]

    def state_of(self, number):
        return self.job(number)["state"]

    def machine(self):
        return self.request("GET", "/api/v1/machine")[1]

    def queue_hold(self):
        """Why the queue stands still; None when it does not."""
        queue = self.request("GET", "/api/v1/jobs")[1]["queue"]
        if queue["bed_occupied"]:
            return "nobody has said that the bed is clear"
        return queue["reason"] or "no reason given" if queue["held"] else None

    def bed_is_clear(self):
        status, answer, _ = self.request("POST", "/api/v1/machine/bed-cleared")
        if status != 202:
            raise AssertionError("bed-cleared: %d %s" % (status, answer))

    def check_hope(self, job, state, since):
        """Raises Hopeless when this job will not be in `state`: it has ended otherwise, or stands in a queue that is held."""
        if job["state"] in ENDED:
            raise Hopeless("it is %s%s" % (job["state"], job["error"] and ": " + job["error"]))
        waits = job["state"] == "queued" and state not in ("queued", "held") and time.monotonic() > since + 1
        if waits and self.queue_hold() and self.state_of(job["id"]) == "queued":
            raise Hopeless("it is queued, and the queue is held: %s" % self.queue_hold())

    def wait_for_job(self, number, state, timeout_s=30):
        """Until the job is in `state`. Fails at once, with the job's own error, when it never will be."""
        since = time.monotonic()

        def reached():
            job = self.job(number)
            if job["state"] != state:
                self.check_hope(job, state, since)
            return job["state"] == state

        wait_until(reached, "job %d is %s" % (number, state), timeout_s)

    def upload(self, name, content, **fields):
        boundary = "----e2e%d" % random.getrandbits(64)
        parts = ["--%s\r\nContent-Disposition: form-data; name=\"%s\"\r\n\r\n%s\r\n" % (boundary, field, value)
                 for field, value in fields.items()]
        parts.append("--%s\r\nContent-Disposition: form-data; name=\"file\"; filename=\"%s\"\r\n\r\n" % (boundary, name))
        body = "".join(parts).encode() + content + ("\r\n--%s--\r\n" % boundary).encode()
        return self.request("POST", "/api/v1/jobs", body, {"Content-Type": "multipart/form-data; boundary=" + boundary})

    def put(self, name, content, start=False):
        return self.request("PUT", "/api/v1/jobs/" + name, content, {"Print-After-Upload": "?1"} if start else {})

    def raw(self, data, finish=True, timeout_s=20):
        """Bytes to a socket; whatever comes back until the peer closes."""
        with socket.create_connection(("127.0.0.1", self.port), timeout=timeout_s) as connection:
            connection.sendall(data)
            if finish:
                connection.shutdown(socket.SHUT_WR)
            answer = b""
            try:
                while piece := connection.recv(65536):
                    answer += piece
            except ConnectionResetError:
                pass
            return answer

    def resident_kb_max(self):
        with open("/proc/%d/status" % self.process.pid, encoding="ascii") as file:
            return int(next(line for line in file if line.startswith("VmHWM")).split()[1])


class Live:
    """A WebSocket client: just enough of RFC 6455 to listen. `behind`: sent with the handshake, in one piece.
    `connection`: another socket than a plain one to the service."""

    def __init__(self, printd, path="/api/v1/live", headers=None, behind=b"", connection=None):
        self.socket = connection or socket.create_connection(("127.0.0.1", printd.port), timeout=20)
        nonce = base64.b64encode(os.urandom(16)).decode()
        fields = {"Host": "127.0.0.1:%d" % printd.port, "Upgrade": "websocket", "Connection": "Upgrade",
                  "Sec-WebSocket-Key": nonce, "Sec-WebSocket-Version": "13"}
        fields.update(headers or {})
        lines = ["GET %s HTTP/1.1" % path] + ["%s: %s" % field for field in fields.items()]
        self.socket.sendall(("\r\n".join(lines) + "\r\n\r\n").encode() + behind)
        self.held = b""
        while b"\r\n\r\n" not in self.held:
            piece = self.socket.recv(4096)
            if not piece:
                break
            self.held += piece
        head, _, self.held = self.held.partition(b"\r\n\r\n")
        self.status = int(head.split()[1])

    def _take(self, count):
        while len(self.held) < count:
            piece = self.socket.recv(65536)
            if not piece:
                raise EOFError
            self.held += piece
        taken, self.held = self.held[:count], self.held[count:]
        return taken

    @staticmethod
    def ping(payload):
        """A client's ping frame (at most 125 bytes), masked as it has to be."""
        mask = os.urandom(4)
        return bytes([0x89, 0x80 | len(payload)]) + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(payload))

    def next_frame(self):
        """The next frame: its opcode and its payload."""
        first, second = self._take(2)
        length = second & 127
        if length == 126:
            length = struct.unpack(">H", self._take(2))[0]
        elif length == 127:
            length = struct.unpack(">Q", self._take(8))[0]
        payload = self._take(length)
        if first & 15 == 8:
            raise EOFError
        return first & 15, payload

    def next(self):
        """The next text message, parsed."""
        while True:
            opcode, payload = self.next_frame()
            if opcode == 1:
                return json.loads(payload)

    def next_of(self, kind, timeout_s=60):
        end = time.monotonic() + timeout_s
        while time.monotonic() < end:
            message = self.next()
            if message["type"] == kind:
                return message
        raise AssertionError("no message of type " + kind)

    def close(self):
        self.socket.close()


class Folder:
    """A folder of its own for one test, gone afterwards."""

    def __init__(self):
        self.path = tempfile.mkdtemp(prefix="printd-e2e-")

    def remove(self):
        shutil.rmtree(self.path, ignore_errors=True)


def curl(*arguments):
    """Runs the real curl; its output."""
    done = subprocess.run(["curl", "-s", "-S", "--max-time", "120", *arguments], capture_output=True, check=False)
    if done.returncode:
        print(done.stderr.decode(), file=sys.stderr)
    return done.stdout
