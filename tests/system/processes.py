"""What the system tests, and tools/endure, ask about processes and ports."""
import os
import pathlib
import random
import socket
import time


def free_ports():
    """Three, as in --ports. Below those that the system gives to whoever dials: between here and the program that takes them, no
    connection of another test, which runs at the same time, gets one."""
    taken = []
    while len(taken) < 3:
        try:
            taken.append(socket.create_server(("127.0.0.1", random.randrange(10_000, 32_000))))
        except OSError:
            pass
    ports = ",".join(str(one.getsockname()[1]) for one in taken)
    for one in taken:
        one.close()
    return ports


def wait_for(condition, what, patience_s, pause_s=0.01):
    """What `condition` gives, as soon as that is something."""
    limit = time.monotonic() + patience_s
    while not (found := condition()):
        if time.monotonic() > limit:
            raise AssertionError("waited in vain for " + what)
        time.sleep(pause_s)
    return found


def cpu_seconds(pid):
    try:
        fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    except (FileNotFoundError, ProcessLookupError):
        return 0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
