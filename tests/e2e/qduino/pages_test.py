"""What qduino says of itself: help pages fit a terminal and have an example; the manual page has the same options; completion scripts work."""

import re
import shutil
import subprocess
import sys
import unittest

PROGRAM, PAGE = sys.argv.pop(1), sys.argv.pop(1)
COMMANDS = ["new", "build", "size", "run", "sim", "check", "trace", "profile", "vcpu", "metal", "lib", "upload", "monitor", "ide", "doctor", "restore", "completion"]


def run(*command, **options):
    return subprocess.run(command, capture_output=True, text=True, timeout=150, check=False, **options)


def help_of(*command):
    return run(PROGRAM, *command, "--help").stdout


def options_in_help(text):
    """Every option at the beginning of its line: {'--for', '-o', …}, without --help, which all have."""
    lines = [match[1] for match in re.finditer(r"^  (-[\w,-]+)", text, re.M)]
    return {name for line in lines for name in line.split(",")} - {"-h", "--help"}


def sections_of_page():
    """{'new': {options}, …} from the .Ss sections of the manual page."""
    with open(PAGE, encoding="utf-8") as file:
        parts = re.split(r"^\.Ss qduino (\w+)\n", file.read(), flags=re.M)
    sections = {}
    for name, body in zip(parts[1::2], parts[2::2]):
        body = re.split(r"^\.Sh ", body, flags=re.M)[0]
        items = " , ".join(re.findall(r"^\.It (Fl .*)$", body, re.M))
        sections[name] = {"--" + n for n in re.findall(r"Fl Fl ([\w-]+)", items)}
        sections[name] |= {"-" + n for n in re.findall(r"(?<!Fl )Fl (?!Fl)(\w)\b", items)}
    return sections


class Pages(unittest.TestCase):
    def test_the_main_page_names_every_command(self):
        text = help_of()
        self.assertEqual(re.findall(r"^  (\w+) ", text.split("Subcommands:")[1], re.M), COMMANDS)

    def test_every_help_page_fits_a_terminal_and_has_an_example(self):
        for command in [(), *((name,) for name in COMMANDS)]:
            done = run(PROGRAM, *command, "--help")
            self.assertEqual(done.returncode, 0)
            self.assertIn("Example: ", done.stdout, command)
            self.assertLessEqual(max(map(len, done.stdout.splitlines())), 80, command)

    def test_the_manual_page_has_the_options_that_there_are(self):
        sections = sections_of_page()
        self.assertEqual(list(sections), COMMANDS)
        for name in COMMANDS:
            self.assertEqual(sections[name], options_in_help(help_of(name)), name)
        self.assertIn("--only", sections["build"])  # that something was compared
        self.assertIn("-o", sections["trace"])

    def test_the_manual_page_is_clean(self):
        if shutil.which("mandoc"):
            done = run("mandoc", "-T", "lint", "-W", "warning", PAGE)
            self.assertEqual(done.stdout, "")
        if not shutil.which("man"):
            self.skipTest("no man here")
        done = run("man", "--warnings", "-E", "UTF-8", "-l", "-Tutf8", "-Z", PAGE)
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_the_version_is_said(self):
        self.assertRegex(run(PROGRAM, "--version").stdout, r"^qduino \d+\.\d+\.\d+\n$")

    def complete(self, *words):
        script = "source <(\"$0\" completion bash); COMP_WORDS=(\"$@\"); COMP_CWORD=$(($# - 1)); _qduino; printf '%s\\n' \"${COMPREPLY[@]}\""
        done = run("bash", "-c", script, PROGRAM, "qduino", *words)
        self.assertEqual(done.stderr, "")
        return done.stdout.split()

    def test_bash_completes_commands_options_and_words(self):
        self.assertEqual(self.complete(""), [*COMMANDS, "-h", "--help", "--version"])
        self.assertEqual(self.complete("re"), ["restore"])
        self.assertEqual(self.complete("check", "--"), ["--help", "--verbose", "--json", "--certificate", "--board", "--cores",
                                                            "--seed", "--picture", "--from", "--length", "--plain"])
        self.assertEqual(self.complete("build", "--only", ""), ["sim", "linux"])
        self.assertEqual(self.complete("completion", "z"), ["zsh"])
        self.assertEqual(self.complete("run", "/usr/bi"), ["/usr/bin"])

    def test_the_other_shells_take_their_scripts(self):
        for shell in ("zsh", "fish"):
            script = run(PROGRAM, "completion", shell)
            self.assertEqual(script.returncode, 0)
            self.assertIn("restore", script.stdout)
            if shutil.which(shell):
                self.assertEqual(run(shell, "-n", "/dev/stdin", input=script.stdout).stderr, "", shell)


if __name__ == "__main__":
    unittest.main(verbosity=2)
