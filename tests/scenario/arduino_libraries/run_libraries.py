#!/usr/bin/env python3
"""Builds a sketch for each class of library that once failed here, runs it in the simulator, and compares what it says.

    run_libraries.py QDUINO               all cases, and the table in docs/arduino-libraries.md is as they went
    run_libraries.py QDUINO --write       writes that table
    run_libraries.py QDUINO CASE…         these cases alone

The libraries in libraries/ are rebuilt from the classes of a survey of 116 published ones: each does what its class does, in a few lines.
A case fails without its cure. The table in the docs is made here, and the test fails when the docs have another.
"""
import dataclasses
import os
import pathlib
import re
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
PAGE = HERE.parents[2] / "docs" / "arduino-libraries.md"
BEGIN, END = "<!-- made by tests/scenario/arduino_libraries/run_libraries.py --write -->\n", "<!-- end -->\n"


@dataclasses.dataclass
class Case:
    sketch: str
    trouble: str   # what libraries of this class do
    met_in: str    # where the survey met it
    here: str      # what it does on this board
    expected: str  # a pattern of the lines on Serial
    seconds: int = 1  # of virtual time
    report: str = ""  # a pattern of the simulator's lines on the parts


CASES = [
    Case("AskedVersion", "asks `#if ARDUINO >= 100` before it includes anything", "AccelStepper, PID, Bounce2, I2Cdev, GFX and 18 more",
         "the version is on the command line", r"25"),
    Case("Timers", "takes hardware timers 1 and 2", "TimerOne, MsTimer2",
         "`TimerOne.h`, `MsTimer2.h`: a loop of 500 µs in 5 ms calls the function", r"4(49|50|51) 1[78]"),
    Case("TimerInterrupts", "takes any of five timers, for a time or with an argument, and makes sixteen of one", "TimerInterrupt",
         "`TimerInterrupt.h`, `ISR_Timer.h`: a loop of 500 µs in 5 ms for each timer", r"10 1 75 1\n"),
    Case("Tasks", "runs tasks, which a kernel of its own switches by the watchdog's interrupt", "Arduino_FreeRTOS_Library",
         "`Arduino_FreeRTOS.h`, `queue.h`, `semphr.h`, `timers.h`, `event_groups.h`: each task is a loop with a budget by its priority",
         r"6\nearly 0\nbeats 5\nbits 6\nleft 0\nstate 2\nsum 3090\nnotified 42\n", 2),
    Case("Motors", "moves motors by a timer's hardware, with a list of the boards that have one", "FastAccelStepper",
         "`FastAccelStepper.h`: one loop makes the steps of six motors, at the instants of their ramps", r"1\n0\n1000\n-50\n", 5),
    Case("Encoders", "reads the registers of its pins, with a list of the boards whose interrupts it knows", "Encoder",
         "`Encoder.h`: a handler on its I/O VCPU looks at both pins at each edge", r"40\n25\n1004\n0\n"),
    Case("Sleep", "sleeps by the watchdog's registers until its time, or an interrupt", "Low-Power",
         "`LowPower.h`: the loop sleeps, and consumes no budget", r"woken (19\d|20[0-3])\nslept 200[0-2]\nidle 12[56]\n", 4),
    Case("AvrHeaders", "includes `avr/io.h`, `avr/interrupt.h`, `avr/wdt.h`, `avr/sleep.h`, `util/delay.h`, `util/atomic.h`, `util/crc16.h`",
         "FreeRTOS, MPU6050, Ethernet, OneWire", "the headers, with what stands behind them here", r"4B37\n3[45]\d\d"),
    Case("SmallMacros", "uses `_BV`, `microsecondsToClockCycles`, `SERIAL_PORT_HARDWARE`, `UDP_TX_PACKET_MAX_SIZE`, `strlcpy`, `itoa`, `dtostrf`",
         "RF24, DHT, Ethernet, ArduinoModbus", "they exist", r"more than the packet ca\n33\n40\n-1234\nabcd\n   3\.142\n7"),
    Case("BoardPins", "includes `pins_arduino.h`, compares `NUM_DIGITAL_PINS` in `#if`", "ILI9341, ST7735, TouchScreen",
         "the Mega's numbers", r"52\n127"),
    Case("SoftwarePort", "has a serial port on any two pins", "TinyGPS++, TMC2209",
         "`SoftwareSerial.h`: a loop that owns core 1, both ways at once", r"asked\n-1"),
    Case("LibcNames", "its sketch, its headers or the library have a global `pipe`, `clock`, `time` or `close`",
         "RF24, LiquidCrystal_I2C, RFM69, WiFi101", "they get another name", r"38\nF0E1\nclock"),
    Case("InC", "has a .c file that includes `Arduino.h`", "Modbus, WiFi101", "C's half of the language", r"318"),
    Case("Networks", "uses the whole WiFi and Ethernet API, or includes `ESP8266WiFi.h`", "the examples of WiFi, Ethernet, ArduinoHttpClient, PubSubClient",
         "the host's network; joining and scanning are the host's", r"network\n-1\nauto\n192\.168\.0\.1\n1\n127\.0\.0\.1\n1\nnobody\n1\na station\n17\n0\n10"),
    Case("Ports", "writes PORTx, or asks for `portOutputRegister`", "many sketches; DHTlib and CapacitiveSensor insist on an address, see below",
         "the registers are objects over the Mega's pins; a library that asks is told no and uses `digitalWrite()`",
         r"1\n0\n80\nC0\ndigitalWrite\n40"),
    Case("Features", "asks `#ifdef SPI_HAS_TRANSACTION`, `digitalPinToInterrupt`, `HIGH`, `A0`, `#if BUFFER_LENGTH`",
         "RF24, RFM69, SSD1306, GFX, TFT_eSPI, SPIFlash", "they are macros as well", r"a transaction\n256\n18"),
    Case("Scale", "shifts 24 bits out of an HX711, and extends their sign in an `unsigned long`", "HX711",
         "a simulated chip: `chip = \"hx711\"` in the board file", r"-12345\n123\.45\n-1\n-12345\n40[01]\n", 4,
         r"hx711 on pins 2 and 3: 8 results read, switched off 1 times"),
    Case("Thermometers", "times the slots of a 1-Wire bus by busy waits with interrupts held back, finds the chips on it and checks their CRC",
         "OneWire, DallasTemperature", "a simulated chip: `chip = \"ds18b20\"`; slots are exact to the cost of a pin's calls",
         r"28C0B2A305000059 85\.0000\n28C1B2A30500006E 85\.0000\n2807000000008017 85\.0000\n"
         r"28C0B2A305000059 85\.8125\n28C1B2A30500006E 21\.5625\n2807000000008017 -10\.1250\n2807000000008017 -10\.5000\n-127\.00", 10,
         r"ds18b20 \w+ on pin 4: 3 conversions\n" * 3),
    Case("Screen", "keeps a picture in memory and sends it over `Wire` in pieces of its buffer", "SSD1306, SSD1306Ascii, GFX",
         "a simulated chip: `chip = \"ssd1306\"`, whose picture is a file in the end", r"0\n1\nshown", 1, r"ssd1306 at 0x3c of I2C 0: "),
    Case("Strip", "counts an AVR's clocks between the edges of a waveform", "NeoPixel",
         "`Adafruit_NeoPixel.h`: edges at their instants, or SPI; a simulated strip, `chip = \"ws2812\"`", r"9600", 1,
         r"ws2812 on pin 6: 6 frames; shows 320000 001d00 001d00 001d00\n"),
    Case("Palettes", "takes a computer, by `__linux__`, for a board without pins", "FastLED",
         "`FastLED.h`: its names and results; strips as above, and those with a clock on any two pins or on SPI",
         r"3\n255\n\d+\n120\nbeats\n", 1,
         r"ws2812 on pin 6: \d+ frames; shows 800000 561d00 563b00 005800 005800 563b00 561d00 800000\n"
         r"ws2812 on pin 51: \d+ frames; shows 000080 3f0040 000080\n"),
    Case("Remote", "takes a timer to look at an infrared receiver, and another one to send", "IRremote",
         "`IRremote.hpp`: NEC's code by `attachInterrupt()` and PWM; a simulated module and remote, `chip = \"ir\"`",
         r"Protocol=NEC Address=0x4 Command=0x18 Raw-Data=0xE718FB04 32 bits LSB first\n68\n"
         r"(Protocol=NEC Address=0x4 Command=0x18 Repeat\n4\n){2}"
         r"Protocol=NEC Address=0x1234 Command=0x56 Raw-Data=0xA9561234 32 bits LSB first\n68\n"
         r"Protocol=NEC Address=0x1234 Command=0x56 Repeat", 2, r"ir on pin 7: 36 flashes of the LED on pin 8"),
    Case("Card", "keeps files on a card, with a table of each CPU's pins", "SD, ArduinoJson, Seeed CAN",
         "`SD.h`: a folder of the host", r"0,0\n1,1\n2,4\ntoday/\nin"),
    Case("NewApi", "uses ArduinoCore-API: `arduino::String`, IPv6 in `IPAddress`, `RingBufferN`, `HardwareCAN`", "code for newer boards",
         "the same classes; CAN is the host's", r"10\.0\.0\.7\n2001:db8::1:0:0:7\nabcd\n\[123\] \(2\) : CAFE\nno bus"),
    Case("GlobalObjects", "sets pins in the constructor of a global object; has a `typedef` named `ulong`", "AccelStepper, Stepper, Encoder; Keypad",
         "what holds of it when `setup()` begins; `ulong` has 32 bits", r"enabled\n1\nreleased\n1073741\n4"),
    Case("OwnReader", "defines `pgm_read_byte` before it includes `Arduino.h`", "SSD1306", "its own reader stays", r"303"),
]


def run(qduino, case, cache):
    """What is wrong with a case; '' when nothing is. Files that the sketch's parts write come into the cache."""
    environment = dict(os.environ, XDG_CACHE_HOME=cache, XDG_STATE_HOME=cache, QDUINO_LIBRARIES=str(HERE / "libraries"),
                       QDUINO_CAN="nobus", LC_ALL="C.UTF-8")
    folder = HERE / "sketches" / case.sketch
    board = folder / "board.toml"
    wired = ["--board", board] if board.exists() else []
    done = subprocess.run([qduino, "sim", folder, "--for", str(case.seconds), *wired], env=environment, cwd=cache, capture_output=True, text=True,
                          timeout=300, check=False)
    said = done.stdout.replace("\r\n", "\n")
    if done.returncode != 0:
        return f"status {done.returncode}\n{done.stderr[-3000:]}"
    if not re.match(rf"(?:{case.expected})(?:\n|\Z)", said):
        return f"said:\n{said[:600]}expected: {case.expected}\n{done.stderr[-1500:]}"
    if not re.search(case.report, done.stderr):
        return f"reported:\n{done.stderr[:1500]}expected: {case.report}"
    return wrong_picture(folder, pathlib.Path(cache))


def wrong_picture(folder, made):
    """Where a picture differs from the one that was recorded beside the sketch; '' when none does."""
    for recorded in folder.glob("*.pbm"):
        want, have = recorded.read_text(encoding="ascii").split(), (made / recorded.name).read_text(encoding="ascii").split()
        for row, (wanted, had) in enumerate(zip(want, have, strict=True)):
            if wanted != had:
                return f"{recorded.name}: line {row}:\n{had}\nexpected:\n{wanted}"
    return ""


def table(passed):
    lines = ["| What the library does | Met in | Here | The rebuilt case runs |\n", "|---|---|---|---|\n"]
    lines += [f"| {case.trouble} | {case.met_in} | {case.here} | {'yes' if case.sketch in passed else 'NO'} |\n" for case in CASES]
    return "".join(lines)


def page_is_right(passed, write):
    """True when the page has the table of these results; `write` puts it there."""
    page = PAGE.read_text(encoding="utf-8")
    before, rest = page.split(BEGIN)
    made = before + BEGIN + table(passed) + END + rest.split(END)[1]
    if write:
        PAGE.write_text(made, encoding="utf-8")
    elif made != page:
        print(f"{PAGE.name} has another table: run this with --write")
    return write or made == page


def main():
    qduino, words = sys.argv[1], sys.argv[2:]
    asked = [word for word in words if word != "--write"]
    cases = [case for case in CASES if not asked or case.sketch in asked]
    passed = []
    with tempfile.TemporaryDirectory() as cache:
        for case in cases:
            wrong = run(qduino, case, cache)
            print(f"{case.sketch}: {wrong or 'ok'}", flush=True)
            passed += [] if wrong else [case.sketch]
    print(f"{len(passed)} of {len(cases)} cases run as they should")
    right = bool(asked) or page_is_right(passed, "--write" in words)
    sys.exit(len(passed) != len(cases) or not right)


if __name__ == "__main__":
    main()
