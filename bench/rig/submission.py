#!/usr/bin/env python3
"""The paper's submission load (RTAS 2017, section III.C): print jobs of random size, sent to the print service at random intervals.

    submission.py --address http://127.0.0.1:8080 --key-file DIR/api-key
                  [--uploads 30] [--sizes 50e3 150e6] [--pause 0.1 10] [--seed 1]

Each job goes as a slicer sends it (multipart to /api/files/local), streamed, and is left held: it is not printed. A line of JSON is written for each:
{"name", "bytes", "status", "seconds", "id"}. Sizes are log-uniform, pauses uniform, both within the paper's bounds unless others
are given. --uploads 0 sends until it is stopped.
Exit status 0 when each was answered with 201.
"""
import argparse
import http.client
import json
import math
import random
import sys
import time
import urllib.parse

BLOCK_LINES = 2000


def block(generator):
    """Some 60 KB of G-code that stays within any machine's bounds."""
    return "".join("G1 X%.3f Y%.3f E%.5f F%d\n" % (generator.uniform(20, 120), generator.uniform(20, 120), 0.0, 3000)
                   for _ in range(BLOCK_LINES)).encode()


def gcode(size, generator):
    """`size` bytes in pieces: a file of its own, never all in memory."""
    head = b"; submission %d\nG28\nG1 Z5 F240\n" % generator.getrandbits(48)
    piece = block(generator)
    yield head
    left = size - len(head)
    while left > len(piece) + 2:
        yield piece
        left -= len(piece)
    yield b";" + b"-" * (left - 2) + b"\n"


def submit(address, key, name, size, generator, timeout_s):
    """Sends one file; (status, parsed answer)."""
    boundary = "submission%016x" % generator.getrandbits(64)
    head = ("--%s\r\nContent-Disposition: form-data; name=\"file\"; filename=\"%s\"\r\n"
            "Content-Type: application/octet-stream\r\n\r\n" % (boundary, name)).encode()
    tail = ("\r\n--%s--\r\n" % boundary).encode()

    def body():
        yield head
        yield from gcode(size, generator)
        yield tail

    connection = http.client.HTTPConnection(address.hostname, address.port, timeout=timeout_s)
    try:
        connection.request("POST", "/api/files/local", body=body(), headers={
            "X-Api-Key": key, "Content-Type": "multipart/form-data; boundary=" + boundary,
            "Content-Length": str(len(head) + size + len(tail))})
        answer = connection.getresponse()
        text = answer.read()
        return answer.status, json.loads(text) if text else {}
    finally:
        connection.close()


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--address", required=True, type=urllib.parse.urlsplit)
    parser.add_argument("--key-file", required=True)
    parser.add_argument("--uploads", type=int, default=30, help="how many; 0: until stopped")
    parser.add_argument("--sizes", type=float, nargs=2, default=[50e3, 150e6], metavar=("LEAST", "MOST"), help="bytes")
    parser.add_argument("--pause", type=float, nargs=2, default=[0.1, 10], metavar=("LEAST", "MOST"), help="seconds")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--timeout", type=float, default=120, help="seconds to wait for an answer")
    return parser.parse_args()


def main():
    options = arguments()
    generator = random.Random(options.seed)
    with open(options.key_file, encoding="ascii") as file:
        key = file.read().strip()
    sent, refused = 0, 0
    while options.uploads == 0 or sent < options.uploads:
        size = int(math.exp(generator.uniform(*map(math.log, options.sizes))))
        name = "submission-%d-%d.gcode" % (options.seed, sent)
        begin = time.monotonic()
        status, answer = submit(options.address, key, name, size, generator, options.timeout)
        print(json.dumps({"name": name, "bytes": size, "status": status, "seconds": round(time.monotonic() - begin, 3),
                          "id": answer.get("id"), "answer": answer if status != 201 else None}), flush=True)
        sent += 1
        refused += status != 201
        time.sleep(generator.uniform(*options.pause))
    return 1 if refused else 0


if __name__ == "__main__":
    sys.exit(main())
