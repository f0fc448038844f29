"""The two boards on which a sketch runs: an Arduino Mega 2560, built by arduino-builder and run in simavr, and ours, by `qduino sim`.

Both say which lines of the sketch the compiler refused, or what the sketch printed.
"""

import pathlib
import re
import shutil
import subprocess

CORE = pathlib.Path("/usr/share/arduino/hardware/arduino")
COLOR = re.compile(r"\x1b\[[0-9;]*m")
REFUSED = re.compile(r"\.ino:(\d+):(?:\d+:)? (?:fatal )?error")


class Outcome:
    def __init__(self, text, refused_lines, said):
        self.text, self.refused_lines, self.said = text, refused_lines, said

    @property
    def is_built(self):
        return self.text is not None


def refused(said):
    lines = sorted({int(line) for line in REFUSED.findall(said)})
    return Outcome(None, lines, said)


class Mega:
    """Debian's core 1.8.7 names DECIMAL_DIG, which Debian's avr-gcc 5.4 does not define for C++: a copy of the core says the same by
    the compiler's own name."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.hardware = self.folder / "hardware"
        shutil.copytree(CORE, self.hardware / "arduino", ignore=shutil.ignore_patterns("libraries", "bootloaders", "firmwares"))
        words = self.hardware / "arduino" / "avr" / "cores" / "arduino" / "WString.cpp"
        words.write_text(re.sub(r"\bDECIMAL_DIG\b", "__DECIMAL_DIG__", words.read_text(encoding="utf-8")), encoding="utf-8")
        for each in ("build", "cache"):
            (self.folder / each).mkdir()

    @staticmethod
    def missing():
        """The programs that are not installed."""
        return [each for each in ("arduino-builder", "avr-g++", "simavr") if not shutil.which(each)]

    def build(self, sketch, libraries=(), timeout=None):
        """arduino-builder's end; `libraries`: folders of libraries, beside the core's own."""
        command = ["arduino-builder", "-hardware", "/usr/share/arduino-builder", "-hardware", str(self.hardware), "-tools", "/usr/bin",
                   "-fqbn", "arduino:avr:mega:cpu=atmega2560", "-build-path", str(self.folder / "build"),
                   "-build-cache", str(self.folder / "cache"), "-warnings", "none"]
        for folder in (CORE / "avr" / "libraries", *libraries) if libraries else ():
            command += ["-libraries", str(folder)]
        return subprocess.run([*command, str(sketch)], capture_output=True, text=True, errors="replace", timeout=timeout, check=False)

    def run(self, sketch):
        built = self.build(sketch)
        if built.returncode:
            return refused(built.stdout + built.stderr)
        elf = self.folder / "build" / (sketch.name + ".elf")
        ran = subprocess.run(["timeout", "60", "simavr", "-m", "atmega2560", "-f", "16000000", str(elf)], capture_output=True, text=True,
                             errors="replace", check=False)
        # simavr writes a line's control characters (its end, too) as dots.
        lines = [re.sub(r"\.\.$", "", COLOR.sub("", line)) for line in (ran.stdout + ran.stderr).splitlines()]
        return Outcome("\n".join(line for line in lines if not line.startswith("Loaded ")), [], "")


class Ours:
    def __init__(self, qduino):
        self.qduino = qduino

    def run(self, sketch):
        command = ["timeout", "300", self.qduino, "sim", str(sketch.parent), "--for", "6", "--plain"]
        ran = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False)
        if ran.returncode and REFUSED.search(ran.stdout + ran.stderr):
            return refused(ran.stdout + ran.stderr)
        return Outcome(ran.stdout, [], ran.stderr)
