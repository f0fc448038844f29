"""What qduino says and shows of pins, judged from outside. A generator makes a sketch and the pulses that it means; a reader of the test's own reads
the dump; both must be the same, and what the sentences say of it."""

import random
import re
import unittest
import xml.etree.ElementTree as ElementTree

from sketch_case import SketchCase
from value_change_dump import Dump

SVG = "{http://www.w3.org/2000/svg}"
BLINK = """
void setup() { pinMode(LED_BUILTIN, OUTPUT); }
void loop() {
  digitalWrite(LED_BUILTIN, HIGH);
  delay(500);
  digitalWrite(LED_BUILTIN, LOW);
  delay(500);
}
"""
UNIT_NS = {"ns": 1, "us": 1e3, "ms": 1e6, "s": 1e9}


class Meant:
    """Pulses on some pins, in whole microseconds, and a sketch that makes them. It owns its core, so nothing delays an edge."""

    def __init__(self, seed):
        dice = random.Random(seed)
        self.pins = dice.sample(range(2, 60), 4)
        self.pulses = {pin: [] for pin in self.pins}
        for number, pin in enumerate(self.pins):
            at = dice.randrange(1, 500)
            for _ in range(dice.randrange(2, 40)):
                high, low = (700, 1300) if number == 0 else (dice.randrange(1, 3000), dice.randrange(1, 9000))
                self.pulses[pin].append((at * 1000, (at + high) * 1000))
                at += high + low
        edges = sorted((at, pin, level) for pin, pulses in self.pulses.items() for pulse in pulses for at, level in zip(pulse, (1, 0)))
        table = ", ".join("{%dL, %d, %d}" % (at // 1000, pin, level) for at, pin, level in edges)
        self.sketch = """
            struct Edge { long at_us; int pin; int level; };
            const Edge edges[] = {%s};
            void setup() { for (const Edge& edge : edges) pinMode(edge.pin, OUTPUT); }
            void loop(1, 1, 1, 1) {
              long now = 0;
              for (const Edge& edge : edges) {
                if (edge.at_us > now) delayBusyMicroseconds(edge.at_us - now);
                now = edge.at_us;
                digitalWrite(edge.pin, edge.level ? HIGH : LOW);
              }
              while (true) delay(1000);
            }
        """ % table

    def compare(self, text):
        """Raises AssertionError when the dump is not what is meant."""
        dump = Dump(text)
        assert set(dump.changes) == {"pin%d" % pin for pin in self.pins}, dump.changes.keys()
        for pin, pulses in self.pulses.items():
            assert dump.pulses("pin%d" % pin) == pulses, (pin, dump.pulses("pin%d" % pin), pulses)


def sentences(said):
    return {int(pin): words for pin, words in re.findall(r"^pin (\d+): (.*)$", said, re.M)}


def lengths(words):
    """The durations of a sentence's part, in ns."""
    return [float(number) * UNIT_NS[unit] for number, unit in re.findall(r"([\d.]+) (ns|us|ms|s)\b", words)]


class Pins(SketchCase):
    def check_sentence(self, words, pulses):
        begins = [begin for begin, _ in pulses]
        periods = [b - a for a, b in zip(begins, begins[1:])]
        self.assertEqual(int(re.match(r"(\d+) pulses?", words)[1]), len(pulses), words)
        told = lengths(re.search(r"period (.*?), each", words)[1])
        if "…" in words.split(", each")[0]:
            for said, true in zip(told, (min(periods), max(periods))):
                self.assertAlmostEqual(said / true, 1, delta=0.006, msg=words)
        else:
            self.assertAlmostEqual(told[0], sum(periods) / len(periods), delta=0.6, msg=words)
            self.assertEqual(len(told) == 1, len(set(periods)) == 1, words)

    def test_the_dump_and_the_sentences_are_what_the_sketch_meant(self):
        for seed in range(4):
            meant = Meant(seed)
            self.write("pulses/pulses.ino", meant.sketch)
            done = self.run_qduino("sim", "pulses", "--for", "1", "--vcd", "a.vcd")
            dump = (self.folder / "a.vcd").read_text(encoding="ascii")
            meant.compare(dump)
            self.assertEqual(Dump(dump).end_ns, 10**9, "it lasts as long as the run")
            said = sentences(done.stderr)
            self.assertEqual(set(said), set(meant.pins))
            for pin, pulses in meant.pulses.items():
                self.check_sentence(said[pin], pulses)
        self.run_qduino("sim", "pulses", "--for", "1", "--vcd", "b.vcd")
        self.assertEqual(dump, (self.folder / "b.vcd").read_text(encoding="ascii"), "the same every time")
        # The comparison sees a dropped edge, and a time that is off by one microsecond.
        edges = [m for m in re.finditer(r"^[01]p\d+\n", dump, re.M)]
        dropped = edges[len(edges) // 2]
        moved = re.search(r"^#(\d+)$", dump[dropped.start():], re.M)
        at = dropped.start() + moved.start(1)
        later = dump[:at] + str(int(moved[1]) + 1000) + dump[at + len(moved[1]):]
        for mutant in (dump[:dropped.start()] + dump[dropped.end():], later):
            with self.assertRaises((AssertionError, ValueError)):
                meant.compare(mutant)

    def test_blink_is_to_be_seen(self):
        self.write("blink/blink.ino", BLINK)
        done = self.run_qduino("sim", "blink", "--vcd", "a.vcd", "--picture", "a.svg")
        self.assertIn("\npin 13: 10 pulses, period 1000.000 ms ± 0, each 500.000 ms\n", done.stderr)
        self.assertEqual(Dump((self.folder / "a.vcd").read_text()).pulses("pin13"),
                         [(second * 10**9, second * 10**9 + 5 * 10**8) for second in range(10)])
        self.assertRegex(done.stderr, r"\n  pin 13  ▔+▁+▔+▁+▔+▁+\n")
        self.assertIn("The bars of the loops are empty", done.stderr)
        page = ElementTree.parse(self.folder / "a.svg").getroot()
        (pin,) = [group for group in page.iter(SVG + "g") if group.get("data-pin")]
        self.assertEqual(pin.find(SVG + "title").text, "pin 13: 10 pulses, period 1000.000 ms ± 0, each 500.000 ms")
        self.assertEqual(sum(rect.get("class") == "high" for rect in pin.iter(SVG + "rect")), 3, "three periods are shown")
        plain = self.run_qduino("sim", "blink", "--plain")
        self.assertNotRegex(plain.stderr, "[▔▁█·]")
        self.assertIn("pin 13: 10 pulses", plain.stderr)

    def test_the_sketch_that_new_makes_shows_its_pulses(self):
        self.run_qduino("new", "fresh")
        done = self.run_qduino("sim", "fresh", "--for", "3")
        self.assertIn("\npin 13: 6 pulses, period 500.000 ms ± 0, each 250.000 ms\n", done.stderr)

    def test_pwm_and_tones_are_told_as_such(self):
        self.write("sounds/sounds.ino", """
            void setup() { tone(8, 440, 500); analogWrite(9, 51); delay(100); analogWrite(9, 204); }
            void loop() { delay(100); }
        """)
        done = self.run_qduino("sim", "sounds", "--for", "1", "--vcd", "a.vcd")
        said = sentences(done.stderr)
        self.assertRegex(said[8], r"^2\d\d pulses, a tone of 440\.0 Hz")
        self.assertEqual(said[9], "PWM, duty 20.0 % … 80.0 %, changed 1 time")
        dump = Dump((self.folder / "a.vcd").read_text())
        self.assertEqual([duty for _, duty in dump.changes["pin9_duty"]][1:], [0.2, 0.8])
        self.assertEqual({end - begin for begin, end in dump.pulses("pin8")[:-1]}, {1136363}, "the last one ends with the tone")

    def test_many_pins_are_bounded(self):
        self.write("many/many.ino", """
            void setup() { for (int pin = 20; pin < 44; ++pin) { pinMode(pin, OUTPUT); digitalWrite(pin, HIGH); } }
            void loop() { delay(100); }
        """)
        done = self.run_qduino("sim", "many", "--for", "1")
        self.assertEqual(len(sentences(done.stderr)), 12)
        self.assertEqual(re.findall(r"^ *and 12 more$", done.stderr, re.M), ["  and 12 more", "and 12 more"])

    def test_pins_on_linux_are_seen_where_nothing_is_connected(self):
        """Ordinary scheduling, so times are not judged: the dump, the sentence and the picture tell of one run."""
        self.write("blink/blink.ino", BLINK.replace("500", "20"))
        done = self.run_qduino("run", "blink", "--for", "1", "--best-effort", "--vcd", "a.vcd", "--picture", "a.svg")
        pulses = Dump((self.folder / "a.vcd").read_text()).pulses("pin13")
        self.assertGreater(len(pulses), 0)
        self.assertTrue(all(end - begin >= 20_000_000 for begin, end in pulses[:-1]), "no pulse is shorter than its delay()")
        self.assertTrue(sentences(done.stderr)[13].startswith("%d pulse" % len(pulses)), done.stderr)
        self.assertIn("data-pin", (self.folder / "a.svg").read_text())
        refused = self.run_qduino("run", "blink", "--for", "1", "--pins", "blink/blink.ino", "--vcd", "b.vcd", status=1)
        self.assertIn("--vcd is about pins that are connected to nothing", refused.stderr)

    def test_help_and_numbers(self):
        self.assertEqual(self.run_qduino("help").stdout, self.run_qduino("--help").stdout)
        self.assertEqual(self.run_qduino("help", "sim").stdout, self.run_qduino("sim", "--help").stdout)
        self.assertIn("no such command: nosuch", self.run_qduino("help", "nosuch", status=109).stderr)
        for wrong in ("x", "0", "-1", "nan", "inf", "1e300", "5s"):
            said = self.run_qduino("sim", "--for=" + wrong, status=105).stderr
            self.assertIn("'%s' is not a number above 0" % wrong, said)
            self.assertLess(max(map(len, said.splitlines())), 80, said)


if __name__ == "__main__":
    unittest.main(verbosity=2)
