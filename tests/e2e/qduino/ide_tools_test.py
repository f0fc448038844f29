"""The tools of the board's platform, started and asked as the Arduino IDE 2 and arduino-cli start and ask them.

Neither is in Debian, so their side is written here after arduino-cli's specifications of discoveries and monitors.
"""

import json
import os
import select
import shlex
import socket
import stat
import subprocess
import time
import unittest

from sketch_case import SketchCase

HELLO = 'HELLO 1 "arduino-cli 1.2.3"'
HERE = {"address": "this_computer", "label": "this computer", "protocol": "qduino", "protocolLabel": "QduinoMC",
        "properties": {"board": "here"}}
THERE = dict(HERE, address="pi@there", label="pi@there", properties={"board": "to_pi_there"})


class Tool:
    """A tool's process, and the client's side of it: lines to it, JSON texts of any shape from it."""

    def __init__(self, command, environment):
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment)
        self.heard = ""

    def send(self, command):
        self.process.stdin.write(command.encode() + b"\n")
        self.process.stdin.flush()

    def message(self):
        while True:
            self.heard = self.heard.lstrip()
            try:
                message, end = json.JSONDecoder().raw_decode(self.heard)
            except ValueError:
                self.more()
                continue
            self.heard = self.heard[end:]
            return message

    def more(self):
        if not select.select([self.process.stdout], [], [], 20)[0]:
            raise AssertionError("no answer: " + self.heard)
        chunk = os.read(self.process.stdout.fileno(), 4096)
        if not chunk:
            raise AssertionError("the tool has ended: " + self.heard)
        self.heard += chunk.decode()

    def ask(self, command):
        self.send(command)
        return self.message()

    def end(self):
        self.process.stdin.close()
        if self.process.stdout.closed:
            return self.process.returncode
        status = self.process.wait(timeout=100)
        self.process.stdout.close()
        return status


class IdeTools(SketchCase):
    def setUp(self):
        super().setUp()
        self.environment["XDG_STATE_HOME"] = str(self.folder / "state")
        self.run_qduino("ide", "install", self.folder / "Arduino", "--to", "pi@there")
        text = (self.folder / "Arduino/hardware/qduino/linux/platform.txt").read_text(encoding="utf-8")
        self.properties = dict(line.split("=", 1) for line in text.splitlines() if "=" in line and line[0] != "#")

    def tool(self, name):
        tool = Tool(shlex.split(self.properties[name]), self.environment)
        self.addCleanup(tool.end)
        return tool

    def sketch(self):
        """What a keeper listens at."""
        folder = self.folder / "state" / "qduino" / "board"
        folder.mkdir(parents=True, exist_ok=True)
        listener = socket.socket(socket.AF_UNIX)
        self.addCleanup(listener.close)
        listener.bind(str(folder / "serial"))
        listener.listen()
        return listener

    def client(self):
        """Where the IDE waits for the monitor's data, and the command to open a port."""
        listener = socket.create_server(("127.0.0.1", 0))
        self.addCleanup(listener.close)
        return listener, f"OPEN 127.0.0.1:{listener.getsockname()[1]} "

    def accept(self, listener):
        listener.settimeout(100)
        end, _ = listener.accept()
        end.settimeout(100)
        self.addCleanup(end.close)
        return end

    def hear(self, end, count):
        heard = b""
        while len(heard) < count:
            more = end.recv(count - len(heard))
            self.assertTrue(more, heard)
            heard += more
        return heard

    def test_the_ports_are_listed_and_announced(self):
        tool = self.tool("pluggable_discovery.qduino.pattern")
        self.assertEqual(tool.ask(HELLO), {"eventType": "hello", "protocolVersion": 1, "message": "OK"})
        self.assertEqual(tool.ask("START"), {"eventType": "start", "message": "OK"})
        self.assertEqual(tool.ask("LIST"), {"eventType": "list", "ports": [HERE, THERE]})
        self.assertEqual(tool.ask("STOP"), {"eventType": "stop", "message": "OK"})
        self.assertEqual(tool.ask("START_SYNC"), {"eventType": "start_sync", "message": "OK"})
        self.assertEqual([tool.message() for _ in range(2)], [{"eventType": "add", "port": port} for port in (HERE, THERE)])
        self.assertEqual(tool.ask("FIND"), {"eventType": "command_error", "error": True, "message": "Unknown command FIND"})
        self.assertEqual(tool.ask("QUIT"), {"eventType": "quit", "message": "OK"})
        self.assertEqual(tool.process.wait(timeout=100), 0)
        boards = (self.folder / "Arduino/hardware/qduino/linux/boards.txt").read_text(encoding="utf-8")
        for port in (HERE, THERE):
            board = port["properties"]["board"]
            self.assertIn(f"\n{board}.upload_port.board={board}\n", boards)
        # A client that dies says nothing.
        self.assertEqual(self.tool("pluggable_discovery.qduino.pattern").end(), 0)

    def old_ide(self):
        """The tool of the IDE 1.8, which says no HELLO, and the links to its ports."""
        tool = self.tool("discovery.qduino.pattern")
        self.assertEqual(tool.ask("START_SYNC"), {"eventType": "start_sync", "message": "OK"})
        ports = [tool.message()["port"] for _ in range(2)]
        links = [self.folder / "state/qduino/board" / f"port-{port['properties']['board']}" for port in (HERE, THERE)]
        self.assertEqual(ports, [dict(HERE, address=str(links[0]), protocol="serial"), dict(THERE, address=str(links[1]), protocol="serial")])
        self.wait_until(lambda: all(link.exists() for link in links))
        return tool, links

    def wait_until(self, holds):
        end = time.monotonic() + 20
        while not holds():
            self.assertLess(time.monotonic(), end)
            time.sleep(0.02)

    def test_the_old_ide_has_serial_ports_while_it_runs(self):
        sketch = self.sketch()
        tool, links = self.old_ide()
        port = os.open(links[0], os.O_RDWR | os.O_NOCTTY)
        self.addCleanup(os.close, port)
        serial = self.accept(sketch)
        serial.sendall(b"shown\n")
        self.assertEqual(os.read(port, 6), b"shown\n")
        os.write(port, b"typed\n")
        self.assertEqual(self.hear(serial, 6), b"typed\n")
        self.assertEqual(tool.ask("QUIT"), {"eventType": "quit", "message": "OK"})
        self.assertEqual(tool.process.wait(timeout=100), 0)
        self.assertEqual([link.is_symlink() for link in links], [False, False])

        # An IDE that is closed kills its tools, and one that dies says nothing.
        tool, links = self.old_ide()
        tool.process.terminate()
        self.assertEqual(tool.process.wait(timeout=100), 0)
        self.assertEqual([link.is_symlink() for link in links], [False, False])
        tool, links = self.old_ide()
        self.assertEqual(tool.end(), 0)
        self.assertEqual([link.is_symlink() for link in links], [False, False])

    def test_serial_goes_both_ways_until_an_end_goes(self):
        tool = self.tool("pluggable_monitor.pattern.qduino")
        client, command = self.client()
        self.assertEqual(tool.ask(HELLO)["eventType"], "hello")
        self.assertEqual(tool.ask("DESCRIBE"), {"eventType": "describe", "message": "OK", "port_description": {
            "protocol": "qduino", "configuration_parameters": {}}})
        none = tool.ask(command + "this_computer")
        self.assertEqual((none["eventType"], none["error"]), ("open", True))
        self.assertIn("no sketch was uploaded", none["message"])

        sketch = self.sketch()
        self.assertEqual(tool.ask(command + "this_computer"), {"eventType": "open", "message": "OK"})
        ide, serial = self.accept(client), self.accept(sketch)
        self.assertTrue(tool.ask(command + "this_computer")["error"])  # it is open
        # More than any buffer between the two holds. While the IDE reads nothing, the tool reads no
        # more, and answers commands.
        much = bytes(range(256)) * 40000
        serial.setblocking(False)
        sent = 0
        while sent < len(much) and select.select([], [serial], [], 0.3)[1]:
            sent += serial.send(much[sent:])
        self.assertLess(sent, len(much))
        self.assertEqual(tool.ask("DESCRIBE")["eventType"], "describe")
        ide.sendall(b"typed\n")
        serial.settimeout(100)
        self.assertEqual(self.hear(serial, 6), b"typed\n")
        self.assertEqual(self.hear(ide, sent), much[:sent])
        # The last words come, and then the end.
        serial.sendall(b"last words")
        serial.close()
        self.assertEqual(self.hear(ide, 10), b"last words")
        self.assertEqual(tool.message(), {"eventType": "port_closed", "message": "The sketch has ended"})
        self.assertEqual(ide.recv(1), b"")

        self.assertEqual(tool.ask(command + "this_computer")["message"], "OK")
        ide, serial = self.accept(client), self.accept(sketch)
        ide.close()
        self.assertEqual(tool.message()["eventType"], "port_closed")
        self.assertEqual(serial.recv(1), b"")
        self.assertEqual(tool.ask(command + "this_computer")["message"], "OK")
        serial = self.accept(sketch)
        self.assertEqual(tool.ask("CLOSE"), {"eventType": "close", "message": "OK"})
        self.assertEqual(serial.recv(1), b"")
        self.assertTrue(tool.ask("CLOSE")["error"])
        client.close()  # nobody waits for the data
        self.assertTrue(tool.ask(command + "this_computer")["error"])
        self.assertEqual(tool.end(), 0)

    def test_another_computer_is_reached_by_ssh(self):
        fake = self.write("ssh", "#!/bin/sh\necho \"$2\"\nexec cat\n")
        fake.chmod(fake.stat().st_mode | stat.S_IXUSR)
        self.environment["QDUINO_SSH"] = str(fake)
        tool = self.tool("pluggable_monitor.pattern.qduino")
        client, command = self.client()
        tool.send(HELLO)
        self.assertEqual(tool.message()["eventType"], "hello")
        self.assertEqual(tool.ask(command + "pi@there")["message"], "OK")
        ide = self.accept(client)
        ide.sendall(b"typed\n")
        self.assertEqual(self.hear(ide, 15), b"pi@there\ntyped\n")
        self.assertEqual(tool.ask("CLOSE")["message"], "OK")
        self.assertEqual(ide.recv(1), b"")
        self.assertEqual(tool.end(), 0)


if __name__ == "__main__":
    unittest.main()
