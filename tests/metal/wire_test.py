"""A wire that means harm: Ethernet frames that no honest computer sends, and a crowd that connects and says nothing.

  this program ─► raw frames ─────────┐
  this program ─► Linux's own TCP ────┴─► tap ─► card [ lwIP, tests/metal/network ]

The frames are honest ones (ARP, DHCP, ICMP, UDP, TCP) in which bits, lengths and ends were changed, half of them with sums that are right again,
so that a first look at them finds nothing. (None says that this computer's address is at another card: ARP believes that, everywhere.)
The machine has to live, to keep its pulses, and to answer as before.

  wire_test.py QDUINO [Class.test]"""
import contextlib
import os
import pathlib
import random
import re
import socket
import struct
import subprocess
import sys
import time
import unittest

from runs import CACHE, ENVIRONMENT, HERE, QDUINO, SKIPPED, main, metal, missing, read_to
from visits import ask, size_and_hash

FRAMES = 20_000
CROWD = 50
CARD, PEER = bytes.fromhex('525400123456'), bytes.fromhex('525400aabbcc')
MACHINE, AROUND = socket.inet_aton('10.0.2.15'), socket.inet_aton('10.0.2.2')
WIRE, PLACE = 'wire', ('10.0.2.15', 80)
ARP, IP, ICMP, TCP, UDP = 0x0806, 0x0800, 1, 6, 17


def checksum(data):
    """RFC 1071."""
    total = sum(struct.unpack(f'!{(len(data) + 1) // 2}H', data + b'\0' * (len(data) % 2)))
    while total > 0xffff:
        total = (total & 0xffff) + (total >> 16)
    return ~total & 0xffff


def ethernet(kind, payload, target=CARD):
    return bytearray(target + PEER + struct.pack('!H', kind) + payload)


def internet(protocol, payload, flags=0, options=b''):
    return ethernet(IP, struct.pack('!BBHHHBBH4s4s', 0x45 + len(options) // 4, 0, 20 + len(options) + len(payload), 7, flags, 64, protocol, 0,
                                    AROUND, MACHINE) + options + payload)


def honest(chance):
    """A frame of each kind that the machine understands, or is to know that it does not."""
    port = chance.randrange(1, 65536)
    data = chance.randbytes(chance.randrange(0, 200))
    option = chance.choice([b'', b'\x02\x04\x05\xb4', b'\x02\x00', b'\x02\xff\0\0', b'\x08\x0a' + chance.randbytes(8) + b'\x01\x01', b'\x05\x22' + chance.randbytes(34)])
    option += b'\0' * (-len(option) % 4)
    tcp = struct.pack('!HHIIBBHHH', port, chance.choice([80, 80, 81]), chance.getrandbits(32), chance.getrandbits(32), (5 + len(option) // 4) << 4,
                      chance.choice([2, 16, 18, 4, 1, 17, 24, 0, 63, 41]), chance.choice([0, 1, 65535]), 0, chance.choice([0, 1, 65535])) + option + data
    dhcp = struct.pack('!BBBBIHH4s4s4s4s16s192s4s', 2, 1, 6, 0, chance.getrandbits(32), 0, 0, b'\0' * 4, MACHINE, AROUND, b'\0' * 4,
                       CARD + b'\0' * 10, b'\0' * 192, b'\x63\x82\x53\x63') + chance.randbytes(60) + b'\xff'

    def datagram(source, target, payload):
        return struct.pack('!HHHH', source, target, 8 + len(payload), 0) + payload

    return chance.choice([
        lambda: ethernet(ARP, struct.pack('!HHBBH6s4s6s4s', 1, IP, 6, 4, chance.choice([1, 2, 3]), PEER, chance.randbytes(4), CARD, MACHINE)),
        lambda: internet(ICMP, struct.pack('!BBHHH', chance.choice([8, 0, 3, 5, 11, 13]), 0, 0, 1, 1) + data),
        lambda: internet(UDP, datagram(67, 68, dhcp)),
        lambda: internet(UDP, datagram(port, port, data)),
        lambda: internet(TCP, tcp),
        lambda: internet(TCP, tcp, options=chance.choice([b'\x07\x04\x04\0', b'\x83\xff\x04\0', b'\x01\0\0\0'])),
        lambda: internet(UDP, datagram(port, 80, data), flags=chance.choice([0x2000, 0x2001, 0x1fff, 0x4000])),
        lambda: ethernet(chance.choice([0x86dd, 0x8100, 0x0026, 0x8863]), chance.randbytes(chance.randrange(0, 1600))),
    ])()


def summed(frame):
    """With sums that are right, whatever else the frame says."""
    if frame[12:14] != b'\x08\x00' or len(frame) < 34:
        return frame
    head = (frame[14] & 15) * 4
    frame[24:26] = b'\0\0'
    frame[24:26] = struct.pack('!H', checksum(bytes(frame[14:14 + head])))
    payload, place = frame[14 + head:], {ICMP: 2, UDP: 6, TCP: 16}.get(frame[23])
    if place is None or len(payload) < place + 2:
        return frame
    payload[place:place + 2] = b'\0\0'
    before = b'' if frame[23] == ICMP else bytes(frame[26:34]) + struct.pack('!BBH', 0, frame[23], len(payload))
    payload[place:place + 2] = struct.pack('!H', checksum(before + bytes(payload)))
    return frame[:14 + head] + payload


def harmful(chance):
    frame = honest(chance)
    for _ in range(chance.choice([0, 1, 1, 2, 4])):
        at = chance.randrange(12, len(frame)) if len(frame) > 12 else 0
        what = chance.randrange(4)
        if what == 0:
            frame[at] ^= 1 << chance.randrange(8)
        elif what == 1:
            frame[at] = chance.choice([0, 1, 127, 128, 255])
        elif what == 2:
            del frame[max(at, 14):]
        else:
            frame += chance.randbytes(chance.randrange(1, 1500))
    return bytes(summed(frame) if chance.random() < .5 else frame)[:1600]


class Wired:
    """One boot of tests/metal/network, whose wire ends in this program's own network."""

    def __init__(self, card, visit):
        image = subprocess.run(metal('build', HERE / 'network'), capture_output=True, text=True, timeout=200, check=True, env=ENVIRONMENT).stdout.strip()
        pins = pathlib.Path(CACHE) / 'pins'
        words = ['qemu-system-x86_64', '-machine', 'q35', '-cpu', 'max', '-m', '128', '-smp', '2', '-display', 'none', '-nodefaults', '-no-reboot',
                 '-icount', 'shift=4,sleep=off', '-kernel', image, '-append', 'for=600', '-serial', 'stdio',
                 '-chardev', 'file,id=report,path=/dev/fd/2,append=on', '-device', 'isa-debugcon,iobase=0xe9,chardev=report',
                 '-chardev', f'file,id=pins,path={pins}', '-device', 'isa-debugcon,iobase=0x2e8,chardev=pins',
                 '-device', 'isa-debug-exit,iobase=0xf4,iosize=0x01',
                 '-netdev', f'tap,id=net,ifname={WIRE},script=no,downscript=no', '-device', f'{card},netdev=net,romfile=,mac={CARD.hex(":")}']
        with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, bufsize=0) as process:
            try:
                read_to(process.stdout, b'ready')
                self.result = visit()
                process.stdin.write(b'!')
                self.report = process.communicate(timeout=60)[1].decode(errors='replace')
            except OSError as error:
                process.kill()
                raise AssertionError(f'{error}; the machine: {process.stderr.read().decode(errors="replace")}') from error
            finally:
                process.kill()
        self.rises = sum(byte == 0x86 for byte in pins.read_bytes())


BODY = random.Random(14).randbytes(20_000)


def is_connected(one):
    """Not so when it was refused, nor while nobody has answered."""
    try:
        one.getpeername()
        return True
    except OSError:
        return False


def crowd():
    """How many of CROWD visitors were let in at once. Each says nothing, and leaves."""
    with contextlib.ExitStack() as visitors:
        sockets = [visitors.enter_context(socket.socket()) for _ in range(CROWD)]
        for one in sockets:
            one.setblocking(False)
            one.connect_ex(PLACE)
        time.sleep(2)
        return sum(map(is_connected, sockets))


def storm():
    """The answers behind each quarter of the storm."""
    answers = []
    with socket.socket(socket.AF_PACKET, socket.SOCK_RAW) as wire:
        wire.bind((WIRE, 0))
        for quarter in range(4):
            chance = random.Random(quarter)
            for number in range(FRAMES // 4):
                wire.send(harmful(chance))
                if number % 50 == 49:
                    time.sleep(.005)  # a machine that loses frames reads fewer of them
            answers.append(ask(PLACE[1], host=PLACE[0], body=BODY))
    return answers


def let_go():
    """The machine has closed its end of all connections: none of ours waits for that (FIN_WAIT1, FIN_WAIT2 of the kernel's table)."""
    rows = [line.split() for line in pathlib.Path('/proc/net/tcp').read_text().splitlines()[1:]]
    return not any(row[3] in ('04', '05') for row in rows)


def asked_again():
    """Behind the crowd: a visitor comes back until the sketch has seen that it left."""
    for _ in range(60):
        try:
            if not let_go():
                raise ConnectionError
            return ask(PLACE[1], host=PLACE[0], body=BODY)
        except OSError:
            time.sleep(1)
    return 'never answered'


class HostileFrames:
    """Mixed into each test case below, which has a `card`."""

    def test_it_lives_and_answers(self):
        machine = Wired(self.card, lambda: (storm(), [(crowd(), asked_again()) for _ in range(3)]))
        answers, crowds = machine.result
        self.assertEqual(answers, [(200, size_and_hash(BODY))] * 4)
        for let_in, behind_it in crowds:
            self.assertGreater(let_in, 0)
            self.assertEqual(behind_it, (200, size_and_hash(BODY)))
        seconds = float(re.search(r'Charged in (\S+) us', machine.report)[1]) / 1e6
        self.assertGreater(machine.rises, 5_000 * seconds)
        self.assertRegex(machine.report.rsplit('  core 1:', 1)[1], r'timer 0, devices 0')


class VirtioNet(HostileFrames, unittest.TestCase):
    card = 'virtio-net-pci'


class E1000(HostileFrames, unittest.TestCase):
    card = 'e1000'


@contextlib.contextmanager
def own_network():
    """A network of this program's own, with a wire in it at which a machine gets its address."""
    for words in 'link set lo up', f'tuntap add dev {WIRE} mode tap', f'link set {WIRE} address {PEER.hex(":")} mtu 9000 up', f'addr add 10.0.2.2/24 dev {WIRE}':
        subprocess.run(['ip', *words.split()], check=True)
    with subprocess.Popen(['dnsmasq', '--keep-in-foreground', '--conf-file=/dev/null', '--port=0', f'--interface={WIRE}', '--dhcp-range=10.0.2.15,10.0.2.15',
                           '--dhcp-leasefile=/dev/null', '--dhcp-authoritative', '--user=root', '--group=root', '--pid-file'], stderr=subprocess.DEVNULL) as addresses:
        try:
            yield
        finally:
            addresses.terminate()


def begin():
    """The tests, in a network of their own."""
    if os.environ.get('QDUINO_OWN_NETWORK') != '1':
        if lacking := missing(dnsmasq='dnsmasq-base', ip='iproute2', unshare='util-linux'):
            print('skipped:', lacking)
            sys.exit(SKIPPED)
        inside = ['unshare', '--net']
        if subprocess.run([*inside, 'ip', 'tuntap', 'add', 'dev', WIRE, 'mode', 'tap'], capture_output=True, check=False).returncode:
            print('skipped: a network of its own takes root and /dev/net/tun')
            sys.exit(SKIPPED)
        os.execvpe('unshare', [*inside, sys.executable, '-B', __file__, QDUINO, *sys.argv[1:]], {**os.environ, 'QDUINO_OWN_NETWORK': '1'})
    with own_network():
        main(qemu_system_x86_64='qemu-system-x86')


if __name__ == '__main__':
    begin()
