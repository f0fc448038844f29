"""Visitors of the machines that this folder boots: ports that are free here, a request, and what tests/metal/network answers."""
import contextlib
import hashlib
import http.client
import socket


def free_ports(count):
    with contextlib.ExitStack() as all_taken:
        return [all_taken.enter_context(socket.create_server(('127.0.0.1', 0))).getsockname()[1] for _ in range(count)]


def free_port():
    return free_ports(1)[0]


def ask(port, path='/', body=None, host='127.0.0.1'):
    """The answer's status and text."""
    connection = http.client.HTTPConnection(host, port, timeout=60)
    try:
        connection.request('GET' if body is None else 'POST', path, body)
        answer = connection.getresponse()
        return answer.status, answer.read().decode()
    finally:
        connection.close()


def size_and_hash(body):
    """As tests/metal/network answers."""
    return f'{len(body)} {hashlib.sha256(body).hexdigest()}'
