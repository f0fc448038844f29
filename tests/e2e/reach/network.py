"""Networks of a test's own, in the kernel's network namespaces: made as root, removed with the test."""

import ctypes
import os
import socket
import subprocess
import threading

CLONE_NEWNET = 0x40000000


def ip(*words):
    done = subprocess.run(["ip", *words], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise OSError("ip %s: %s" % (" ".join(words), done.stderr.strip()))


def can_make_networks():
    """Why not; empty: it can."""
    if os.geteuid() != 0:
        return "only root makes network namespaces"
    try:
        ip("netns", "add", "qduino-probe-%d" % os.getpid())
        ip("netns", "del", "qduino-probe-%d" % os.getpid())
    except OSError as error:
        return str(error)
    return ""


class Lan:
    """Computers on one wire: 10.77.0.1 is the first, 10.77.0.2 the second, ..."""

    def __init__(self, names):
        self.spaces = {name: "qduino-%d-%s" % (os.getpid(), name) for name in names}
        self.made = []
        self.address = {name: "10.77.0.%d" % (i + 1) for i, name in enumerate(names)}
        bridge = "qduino-%d-wire" % os.getpid()
        try:
            self.add(bridge)
            ip("-n", bridge, "link", "add", "wire", "type", "bridge", "mcast_snooping", "0")
            ip("-n", bridge, "link", "set", "wire", "up")
            for i, name in enumerate(names):
                space = self.spaces[name]
                self.add(space)
                ip("-n", bridge, "link", "add", "port%d" % i, "type", "veth", "peer", "name", "eth0", "netns", space)
                ip("-n", bridge, "link", "set", "port%d" % i, "master", "wire", "up")
                ip("-n", space, "addr", "add", self.address[name] + "/24", "dev", "eth0")
                # Its address of IPv6 counts at once. One that comes a second later is a change of
                # the network, and a browser gives up the page that it is about to open.
                if os.path.exists("/proc/sys/net/ipv6"):
                    ip("netns", "exec", space, "sysctl", "-q", "-w", "net.ipv6.conf.eth0.accept_dad=0")
                ip("-n", space, "link", "set", "lo", "up")
                ip("-n", space, "link", "set", "eth0", "up")
                ip("-n", space, "route", "add", "default", "dev", "eth0")
        except OSError:
            self.remove()
            raise

    def add(self, space):
        ip("netns", "add", space)
        self.made.append(space)

    def remove(self):
        for space in self.made:
            ip("netns", "del", space)
        self.made = []

    def inside(self, name):
        """What stands before a command that is to run on that computer."""
        return ["ip", "netns", "exec", self.spaces[name]]

    def run(self, name, *command, timeout_s=60, **options):
        return subprocess.run(self.inside(name) + list(command), capture_output=True, timeout=timeout_s, check=False, **options)

    def on(self, name, function):
        """The value of `function`, called by a thread that is on that computer: its sockets stay there."""
        result = []

        def enter():
            with open("/run/netns/" + self.spaces[name], "rb") as space:
                if ctypes.CDLL(None, use_errno=True).setns(space.fileno(), CLONE_NEWNET) != 0:
                    result.append(OSError(ctypes.get_errno(), "setns"))
                    return
            try:
                result.append(function())
            except OSError as error:
                result.append(error)
        thread = threading.Thread(target=enter)
        thread.start()
        thread.join()
        if isinstance(result[0], OSError):
            raise result[0]
        return result[0]

    def connect(self, name, to, port, timeout_s=10):
        return self.on(name, lambda: socket.create_connection((to, port), timeout=timeout_s))
