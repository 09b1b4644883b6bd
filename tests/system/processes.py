"""What the system tests ask about processes and ports."""
import os
import pathlib
import socket


def free_ports():
    """Three, as in --ports."""
    sockets = [socket.create_server(("127.0.0.1", 0)) for _ in range(3)]
    ports = ",".join(str(taken.getsockname()[1]) for taken in sockets)
    for taken in sockets:
        taken.close()
    return ports


def cpu_seconds(pid):
    try:
        fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    except (FileNotFoundError, ProcessLookupError):
        return 0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
