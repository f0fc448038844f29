"""The Arduino IDE 1.8 itself, unmodified, in an X server without a screen: it verifies and uploads as its buttons do, and shows Serial.

Debian's packages are not installed. They are laid over /usr in a mount namespace, which ends with each command. ./test --all unpacks them.
"""

import os
import pathlib
import shutil
import subprocess
import unittest
import zipfile

from ide_builder import ROOT, clean_environment
from sketch_case import PROGRAM, SketchCase

UNPACKED = ROOT / "build" / "arduino-ide" / "usr"
OVER_USR = [] if shutil.which("arduino") and shutil.which("Xvfb") else [
    "unshare", "--mount", "sh", "-c", f'mount -t overlay overlay -o lowerdir={UNPACKED}:/usr /usr && exec "$@"', "sh"]
MINE = """
#include <Shift.h>
void setup() {
  Serial.begin(9600);
  Serial.println(sign_of(0xFFFFFFFFul));
}
void loop(1, 1, 100, 0) { waitForNextPeriod(); }
"""
LIBRARY = {"library.properties": "name=Shift\nversion=1.0.0\nauthor=us\nmaintainer=us\nsentence=s\nparagraph=p\ncategory=Other\nurl=u\narchitectures=*\n",
           "src/Shift.h": "long sign_of(unsigned long bits);\n",
           "src/Shift.cpp": "#include <Shift.h>\nlong sign_of(unsigned long bits) { return (long)bits; }\n"}
TALKS = """
void setup() {
  Serial.begin(9600);
  Serial.println("the sketch talks");
}
void loop() {
  if (Serial.available()) {
    Serial.print("heard:");
    Serial.println(Serial.readStringUntil('\\n'));
  }
  delay(5);
}
"""
REASON = "loop 2 (60 ms in 100 ms) is refused on core 0"


def what_is_missing():
    if not os.environ.get("QDUINO_EMULATED"):
        return "it takes a minute: ./test --all"
    if OVER_USR and not (UNPACKED / "bin" / "arduino").exists():
        return "Debian's arduino is neither installed nor unpacked"
    if not shutil.which("java"):
        return "there is no Java: apt-get install default-jre"
    if OVER_USR and subprocess.run([*OVER_USR, "true"], capture_output=True, check=False).returncode != 0:
        return "the unpacked IDE cannot be laid over /usr: that takes root, and a kernel with overlayfs"
    return ""


@unittest.skipIf(what_is_missing(), what_is_missing())
class IdeItself(SketchCase):
    def setUp(self):
        super().setUp()
        home = self.folder / "home"
        home.mkdir()
        # Java asks the password file for the home folder, not $HOME.
        self.environment = dict(clean_environment(self.folder / "cache"), CXXFLAGS="-O0", HOME=str(home), DISPLAY=self.display(),
                                JAVA_TOOL_OPTIONS=f"-Duser.home={home}")
        self.addCleanup(self.run_qduino, "upload", "--stop")
        self.run_qduino("ide", "install")

    def display(self):
        server = subprocess.Popen([*OVER_USR, "Xvfb", "-displayfd", "1", "-nolisten", "tcp"], stdout=subprocess.PIPE,
                                  stderr=subprocess.DEVNULL, text=True)
        self.addCleanup(server.communicate, timeout=100)
        self.addCleanup(server.terminate)
        number = server.stdout.readline().strip()
        if not number:
            self.skipTest("an X server does not start here")
        return ":" + number

    def sketch(self, name, text):
        return self.write(f"home/Arduino/{name}/{name}.ino", text)

    def ide(self, action, sketch, status):
        done = subprocess.run([*OVER_USR, "arduino", action, "--board", "qduino:linux:here", sketch], env=self.environment,
                              capture_output=True, text=True, timeout=800, check=False)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return done.stderr

    def test_it_verifies_and_uploads_and_shows_the_verdict(self):
        for name, text in LIBRARY.items():
            self.write("home/Arduino/libraries/Shift/" + name, text)
        mine = self.sketch("Mine", MINE)
        self.assertIn("Verdict: Mine is admitted on 2 cores: 1 VCPU.", self.ide("--verify", mine, 0))
        self.ide("--upload", mine, 0)
        monitor = subprocess.Popen([PROGRAM, "monitor"], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True, env=self.environment)
        self.addCleanup(monitor.communicate, timeout=100)
        self.addCleanup(monitor.terminate)
        self.assertEqual(monitor.stdout.readline(), "-1\n")

        # Another computer may admit it, so it verifies; and it cannot be uploaded here.
        greedy = self.sketch("Greedy", "void setup() {}\nvoid loop(1, 60, 100, 0) {}\nvoid loop(2, 60, 100, 0) {}\n")
        said = self.ide("--verify", greedy, 0)
        self.assertIn(REASON, said)
        self.assertIn("An upload to a computer like this would be refused.", said)
        said = self.ide("--upload", greedy, 1)
        self.assertIn("Verdict: Greedy is REFUSED, and was not started. Mine runs on.", said)
        self.assertIn("An error occurred while uploading the sketch", said)

    def hands(self):
        """An agent that works in the IDE as its user's hands do."""
        source = pathlib.Path(__file__).with_name("IdeHands.java")
        compiled = subprocess.run(["javac", "-d", self.folder / "hands", source], capture_output=True, text=True, check=False)
        self.assertEqual(compiled.returncode, 0, compiled.stderr)
        archive = self.folder / "hands.jar"
        with zipfile.ZipFile(archive, "w") as jar:
            jar.writestr("META-INF/MANIFEST.MF", "Manifest-Version: 1.0\nPremain-Class: IdeHands\n\n")
            for made in (self.folder / "hands").iterdir():
                jar.write(made, made.name)
        return archive

    @unittest.skipUnless(shutil.which("javac"), "there is no javac: apt-get install default-jdk-headless")
    def test_its_serial_monitor_shows_the_sketch_and_what_is_typed_arrives(self):
        hands = self.hands()
        talks = self.sketch("Talks", TALKS)
        self.run_qduino("upload", talks.parent, "--best-effort")
        port = pathlib.Path(self.environment["XDG_STATE_HOME"]) / "qduino/board/port-here"
        # Options on its command line are kept, and it ends: so its window has the port chosen.
        subprocess.run([*OVER_USR, "arduino", "--board", "qduino:linux:here", "--port", port, "--save-prefs"], env=self.environment,
                       capture_output=True, timeout=600, check=True)
        done = subprocess.run([*OVER_USR, "arduino", talks], capture_output=True, text=True, timeout=800, check=False, env=dict(
            self.environment, JAVA_TOOL_OPTIONS=f"{self.environment['JAVA_TOOL_OPTIONS']} -javaagent:{hands}=talks|hello|heard:hello"))
        self.assertEqual(done.stdout, "window: this computer\nshown: talks\nshown: heard:hello\n", done.stderr)


if __name__ == "__main__":
    unittest.main()
