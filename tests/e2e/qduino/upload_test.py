"""qduino upload and monitor: a sketch that runs on by itself, its Serial, another one in its place, a refusal; here and over a real sshd."""

import os
import pathlib
import platform
import pwd
import select
import shutil
import socket
import subprocess
import sys
import tempfile
import termios
import time
import tty
import unittest
import urllib.error
import urllib.request

from sketch_case import PROGRAM, SketchCase

SSHD = sys.argv.pop(1)

# It answers once it has said all that it has to say.
TALKER = """
int count = 0;
void setup() { if (getenv("DIE")) abort(); Serial.begin(115200); Serial.println("begun"); }
void loop() {
  if (count < 3) { Serial.print("n:"); Serial.println(++count); }
  else while (Serial.available()) { char c = Serial.read(); if (c != '\\n') { Serial.print("heard "); Serial.println(c); } }
  delay(10);
}
"""
# Two curves whose values are known from the number of the line.
SAW = """
int n = 0;
void setup() { Serial.begin(115200); }
void loop() { Serial.print("up:"); Serial.print(n); Serial.print(",down:"); Serial.println(-n); n = (n + 1) % 100; delay(10); }
"""
TOO_MUCH = "void setup() {}\nvoid loop(1, 60, 100, 0) {}\nvoid loop(2, 60, 100, 0) {}\n"


class SerialProgram:
    """Opens a serial port and sets it as the Arduino IDE's Serial Monitor does: raw, at a speed."""

    def __init__(self, path):
        self.port = os.open(path, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self.port, termios.TCSANOW)  # nothing that has come is thrown away
        settings = termios.tcgetattr(self.port)
        settings[4:6] = termios.B9600, termios.B9600
        termios.tcsetattr(self.port, termios.TCSANOW, settings)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.close(self.port)

    def say(self, text):
        os.write(self.port, text.encode())

    def line(self):
        text = b""
        while not text.endswith(b"\n"):
            self.wait()
            text += os.read(self.port, 1)
        return text.decode()

    def wait(self):
        if not select.select([self.port], [], [], 20)[0]:
            raise AssertionError("the port says nothing for 20 s")


class UploadCase(SketchCase):
    shared = tempfile.TemporaryDirectory()  # the sketches are built once

    def setUp(self):
        super().setUp()
        self.folder = pathlib.Path(self.shared.name)
        self.environment |= {"XDG_CACHE_HOME": str(self.folder / "cache"), "XDG_STATE_HOME": str(self.folder / "state"), "CXXFLAGS": "-O0"}
        for name, text in (("talker", TALKER), ("saw", SAW), ("greedy", TOO_MUCH)):
            if not (self.folder / name).exists():
                self.write(f"{name}/{name}.ino", text)
        self.addCleanup(self.stop)

    def stop(self):
        subprocess.run([PROGRAM, "upload", "--stop"], env=self.environment, capture_output=True, timeout=300, check=False)

    def monitor(self, *options):
        """A monitor whose input and output this test holds."""
        done = subprocess.Popen([PROGRAM, "monitor", *options], env=self.environment, cwd=self.folder, stdin=subprocess.PIPE,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(self.end, done)
        return done

    @staticmethod
    def end(monitor):
        monitor.kill()
        monitor.communicate()

    def hear(self, monitor, *options):
        """What the sketch says, up to its answer to what was typed."""
        monitor.stdin.write("x\n")
        monitor.stdin.flush()
        lines = []
        while not lines or not lines[-1].endswith("heard x\n"):
            lines.append(monitor.stdout.readline())
            self.assertNotEqual(lines[-1], "", monitor.poll())
        return lines


class Here(UploadCase):
    def test_an_uploaded_sketch_runs_on_and_another_takes_its_place(self):
        self.assertIn("no sketch was uploaded", self.run_qduino("monitor", status=1).stderr)
        done = self.run_qduino("upload", "talker", "--best-effort")
        self.assertIn("admitted on 2 cores", done.stdout)
        self.assertTrue(done.stderr.endswith("Verdict: talker runs: 'qduino monitor' shows its Serial.\n"), done.stderr)

        first, second = self.monitor(), self.monitor("--timestamps")
        heard = self.hear(first)
        self.assertEqual(heard[:1], ["begun\n"])
        self.assertEqual([line for line in heard if line.startswith("n:")], ["n:1\n", "n:2\n", "n:3\n"])
        for line in self.hear(second)[:4]:
            self.assertRegex(line, r"^\d\d:\d\d:\d\d\.\d{3} -> \w")
        second.send_signal(2)
        self.assertEqual(second.wait(timeout=100), 0)

        # A sketch that is refused changes nothing.
        refused = self.run_qduino("upload", "greedy", "--best-effort", status=2)
        self.assertIn("loop 2 (60 ms in 100 ms) is refused on core 0", refused.stdout)
        self.assertIn("Verdict: greedy is REFUSED, and was not started. talker runs on.\n", refused.stderr)
        self.assertEqual(self.hear(first)[-1], "heard x\n")

        self.assertIn("talker runs, in the place of talker", self.run_qduino("upload", "talker", "--best-effort").stderr)
        self.assertEqual(first.wait(timeout=100), 0)
        self.assertIn("The sketch has ended.", first.stderr.read())
        self.assertEqual(self.monitor().stdout.readline(), "begun\n")
        self.assertIn("talker is stopped", self.run_qduino("upload", "--stop").stderr)
        self.assertIn("no uploaded sketch", self.run_qduino("upload", "--stop").stderr)

    def test_a_program_that_wants_a_serial_port_gets_one_that_outlives_uploads(self):
        link = self.folder / "port"
        monitor = self.monitor("--tty", "port")
        self.assertRegex(monitor.stdout.readline(), r"^Serial is port, that is /dev/pts/\d+\. ")
        with SerialProgram(link) as early:  # nothing was uploaded yet
            self.run_qduino("upload", "talker", "--best-effort")
            self.assertEqual(early.line(), "begun\r\n")
            early.say("x\n")
            while not early.line().endswith("heard x\r\n"):
                pass
            self.run_qduino("upload", "talker", "--best-effort")
            while early.line() != "begun\r\n":
                pass
        with SerialProgram(link) as late:  # a line may have been on its way to the one before
            while late.line() != "begun\r\n":
                pass
            self.assertEqual(late.line(), "n:1\r\n")
        # Another name's owner is left alone: it is no link.
        self.assertIn("is there, and is no link", self.run_qduino("monitor", "--tty", "talker/talker.ino", status=1).stderr)
        self.assertEqual((self.folder / "talker" / "talker.ino").read_text(encoding="utf-8"), TALKER)
        monitor.send_signal(2)
        self.assertEqual(monitor.wait(timeout=100), 0)
        self.assertFalse(link.is_symlink())

    def test_a_sketch_that_ends_at_once_is_no_success(self):
        self.assertIn("talker DIED of signal 6", self.run_qduino("upload", "talker", "--best-effort", status=134, DIE="1").stderr)
        self.run_qduino("monitor", status=1)

    def test_the_plotter_is_served_to_those_who_know_its_address(self):
        self.run_qduino("upload", "talker", "--best-effort")
        plotter = self.monitor("--plot")
        address = plotter.stdout.readline().strip()
        self.assertRegex(address, r"^http://127\.0\.0\.1:\d+/\?key=[0-9a-f]{32}$")
        with urllib.request.urlopen(address, timeout=100) as page:
            self.assertIn("<title>Plotter", page.read().decode())
        with urllib.request.urlopen(address.replace("/?", "/lines?"), timeout=100) as lines:
            said = [lines.readline().decode() for _ in range(8)]
        self.assertEqual([line for line in said if line.strip()], ['data: "begun"\n', 'data: "n:1"\n', 'data: "n:2"\n', 'data: "n:3"\n'])
        with self.assertRaises(urllib.error.HTTPError) as wrong:
            urllib.request.urlopen(address[:-4], timeout=100)
        self.assertEqual(wrong.exception.code, 403)
        wrong.exception.close()

    @unittest.skipUnless(shutil.which("node"), "no node")
    def test_the_plotter_draws_in_a_browser(self):
        self.run_qduino("upload", "saw", "--best-effort")
        address = self.monitor("--plot").stdout.readline().strip()
        script = pathlib.Path(__file__).with_name("plotter_in_browser.mjs")
        done = subprocess.run(["node", script, address], capture_output=True, text=True, timeout=800, check=False)
        if done.returncode == 77:
            self.skipTest(done.stdout)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertRegex(done.stdout, r"the plotter drew \d+ lines")


@unittest.skipUnless(os.environ.get("QDUINO_EMULATED"), "everything is built once more there: ./test --all")
@unittest.skipUnless(os.path.exists(SSHD), "Debian's openssh-server is not here")
class There(UploadCase):
    """Over a real sshd at a port of this test's own, which knows one key."""

    def setUp(self):
        super().setUp()
        for key in ("host", "mine"):
            subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", self.folder / key], check=True, timeout=150)
        shutil.copy(self.folder / "mine.pub", self.folder / "known")
        (self.folder / "bin").mkdir()
        (self.folder / "bin" / "qduino").symlink_to(PROGRAM)
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        # What the sketch there finds: a state and a cache of its own.
        there = {"XDG_STATE_HOME": self.folder / "there", "XDG_CACHE_HOME": self.folder / "cache", "HOME": self.folder / "home",
                 "PATH": f"{self.folder}/bin:/usr/bin:/bin"}
        config = self.write("sshd_config", f"""
            Port {self.port}
            ListenAddress 127.0.0.1
            HostKey {self.folder}/host
            AuthorizedKeysFile {self.folder}/known
            StrictModes no
            UsePAM no
            PidFile none
            SetEnv {" ".join(f'"{name}={value}"' for name, value in there.items())}
        """)
        libraries = pathlib.Path(SSHD).parents[1] / "lib" / f"{platform.machine()}-linux-gnu"  # where it was unpacked, not installed
        self.sshd = subprocess.Popen([*self.with_a_user_for_sshd(), SSHD, "-D", "-e", "-f", config], stdin=subprocess.DEVNULL,
                                     stderr=subprocess.PIPE, text=True, env=dict(os.environ, LD_LIBRARY_PATH=str(libraries)))
        self.addCleanup(self.end_sshd)
        self.environment["QDUINO_SSH"] = (f"ssh -F none -i {self.folder}/mine -p {self.port} -o StrictHostKeyChecking=no "
                                          f"-o UserKnownHostsFile={self.folder}/hosts -o LogLevel=ERROR -o BatchMode=yes")
        self.host = pwd.getpwuid(os.geteuid()).pw_name + "@127.0.0.1"
        self.wait_for_sshd()

    def with_a_user_for_sshd(self):
        """Root's sshd wants a user sshd and a folder, which the package would make. It has them in a mount namespace of its own."""
        if os.geteuid() != 0:
            return []
        users = pathlib.Path("/etc/passwd").read_text(encoding="utf-8")
        if "\nsshd:" not in users:
            users += "sshd:x:65533:65534::/run/sshd:/usr/sbin/nologin\n"
        more = self.write("passwd", users)
        return ["unshare", "--mount", "sh", "-c", f"mount --bind {more} /etc/passwd && mount -t tmpfs none /run && mkdir /run/sshd && "
                'exec "$0" "$@"']

    def wait_for_sshd(self):
        while self.sshd.poll() is None:
            with socket.socket() as look:
                if look.connect_ex(("127.0.0.1", self.port)) == 0:
                    return
            time.sleep(0.02)
        self.skipTest("sshd does not start here: " + self.sshd.stderr.read())

    def end_sshd(self):
        subprocess.run([PROGRAM, "upload", "--stop", "--to", self.host], env=self.environment, capture_output=True, timeout=300, check=False)
        self.sshd.terminate()
        self.sshd.communicate(timeout=100)

    def test_a_sketch_and_its_library_are_sent_built_judged_and_heard(self):
        self.write("libraries/Twice/Twice.h", "int twice(int n);\n")
        self.write("libraries/Twice/Twice.cpp", '#include "Twice.h"\nint twice(int n) { return 2 * n; }\n')
        self.write("doubler/doubler.ino", "#include <Twice.h>\n" + TALKER.replace("println(++count)", "println(twice(++count))"))
        done = self.run_qduino("upload", "doubler", "--to", self.host, "--best-effort")
        self.assertIn("Twice: Twice.cpp", done.stderr)
        self.assertIn("admitted on 2 cores", done.stdout)
        self.assertIn("Verdict: doubler runs", done.stderr)
        self.run_qduino("monitor", status=1)  # here nothing runs
        monitor = self.monitor("--to", self.host)
        heard = self.hear(monitor)
        self.assertEqual([line for line in heard if line.startswith("n:")], ["n:2\n", "n:4\n", "n:6\n"])

        refused = self.run_qduino("upload", "greedy", "--to", self.host, "--best-effort", status=2)
        self.assertIn("loop 2 (60 ms in 100 ms) is refused on core 0", refused.stdout)
        self.assertIn("doubler runs on.", refused.stderr)
        self.write("wrong/wrong.ino", "void setup() { nonsense; }\nvoid loop() {}\n")
        self.assertRegex(self.run_qduino("upload", "wrong", "--to", self.host, status=1).stderr, r"wrong\.ino:1:\d+: error")
        self.assertIn("doubler is stopped", self.run_qduino("upload", "--stop", "--to", self.host).stderr)
        self.assertEqual(monitor.wait(timeout=100), 0)

        # A key that nobody there knows; and a name that would be an option.
        self.environment["QDUINO_SSH"] = self.environment["QDUINO_SSH"].replace(f"-i {self.folder}/mine", f"-i {self.folder}/host")
        failed = self.run_qduino("upload", "doubler", "--to", self.host, status=1)
        self.assertIn("ssh cannot reach " + self.host, failed.stderr)
        self.assertIn("is no computer", self.run_qduino("upload", "doubler", "--to", "-oProxyCommand=x", status=105).stderr)


if __name__ == "__main__":
    unittest.main()
