"""A Slurm of one controller and some nodes, all on this machine's loopback and in one folder, from Debian's packages that are unpacked there:
nothing is installed, no root and no munge is needed, and nothing is left."""
import getpass
import os
import pathlib
import shutil
import socket
import subprocess
import time

PACKAGES = ["slurmctld", "slurmd", "slurm-client", "slurm-wlm-basic-plugins", "libslurm38", "liblua5.1-0", "libmunge2"]
CPUS_PER_NODE = 16  # More than there are: what is tested is who is started and ended, not how fast it is.

CONFIGURATION = """
ClusterName=small
SlurmctldHost={host}(127.0.0.1)
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/none
CredType=cred/none
AuthInfo=cred_expire=5
SlurmctldPort={controller_port}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool.%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.%n.log
PluginDir={libraries}/slurm-wlm
MailProg=/bin/true
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
SchedulerParameters=sched_interval=2,batch_sched_delay=0,sched_min_interval=100000
ReturnToService=2
KillWait=5
MessageTimeout=60
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


class CannotBeHad(Exception):
    """Why there is no Slurm to test with."""


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        return taken.getsockname()[1]


class SmallSlurm:
    def __init__(self, folder, nodes=4):
        self.folder = pathlib.Path(folder)
        self.daemons = []
        self.unpack()
        libraries = next((self.folder / "root/usr/lib").glob("*/slurm-wlm")).parent
        (self.folder / "state").mkdir()
        text = CONFIGURATION.format(host=socket.gethostname().split(".")[0], user=getpass.getuser(), folder=self.folder,
                                    libraries=libraries, controller_port=free_port())
        self.nodes = [f"n{i + 1}" for i in range(nodes)]
        for node in self.nodes:
            (self.folder / f"spool.{node}").mkdir()
            text += (f"NodeName={node} NodeHostname={socket.gethostname().split('.')[0]} NodeAddr=127.0.0.1 Port={free_port()} "
                     f"CPUs={CPUS_PER_NODE} State=UNKNOWN\n")
        self.configuration = self.folder / "slurm.conf"
        self.configuration.write_text(text)
        self.environment = dict(os.environ, SLURM_CONF=str(self.configuration),
                                LD_LIBRARY_PATH=f"{libraries}/slurm-wlm:{libraries}")

    def unpack(self):
        for tool in "apt-get", "dpkg":
            if not shutil.which(tool):
                raise CannotBeHad(f"there is no {tool}")
        try:
            subprocess.run(["apt-get", "download", "--quiet", *PACKAGES], cwd=self.folder, check=True, capture_output=True, timeout=60)
        except (subprocess.CalledProcessError, subprocess.TimeoutExpired) as error:
            raise CannotBeHad(f"Debian's packages cannot be downloaded: {(error.stderr or b'').decode().strip() or error}") from None
        for package in self.folder.glob("*.deb"):
            subprocess.run(["dpkg", "-x", package, self.folder / "root"], check=True)

    def start(self, patience_s=60):
        sbin, conf = self.folder / "root/usr/sbin", self.configuration
        self.daemon(sbin / "slurmctld-wlm", "-D", "-i", "-c", "-f", conf)
        for node in self.nodes:
            self.daemon(sbin / "slurmd-wlm", "-D", "-N", node, "-d", sbin / "slurmstepd-wlm", "-f", conf)
        limit = time.monotonic() + patience_s
        while self.run("sinfo", "--noheader", "-o", "%D %t", check=False).split() != [str(len(self.nodes)), "idle"]:
            if time.monotonic() > limit:
                logs = "\n".join(f"{log.name}: {log.read_text()[-800:]}" for log in sorted(self.folder.glob("*.log")))
                raise CannotBeHad(f"its nodes do not come up on this machine:\n{logs}")
            time.sleep(0.1)

    def daemon(self, *command):
        self.daemons.append(subprocess.Popen([str(word) for word in command], env=self.environment, cwd=self.folder,
                                             stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))

    def run(self, command, *words, check=True, **environment):
        done = subprocess.run([self.folder / "root/usr/bin" / command, *map(str, words)], cwd=self.folder, text=True,
                              env={**self.environment, **environment}, capture_output=True, timeout=120)
        if check and done.returncode != 0:
            raise AssertionError(f"{command}: {done.stderr}")
        return done.stdout.strip()

    def stop(self, patience_s=30):
        """All jobs, then the daemons; what does not end is killed. Only processes of this folder."""
        if self.daemons:
            self.run("scancel", "--user", getpass.getuser(), check=False)
            limit = time.monotonic() + patience_s
            while self.run("squeue", "--noheader", check=False) and time.monotonic() < limit:
                time.sleep(0.2)
        for daemon in reversed(self.daemons):  # The nodes first.
            daemon.terminate()
        for daemon in self.daemons:
            try:
                daemon.wait(patience_s)
            except subprocess.TimeoutExpired:
                daemon.kill()
                daemon.wait()

    def processes(self):
        """What runs from this folder, or was started from it: pid and command."""
        found = {}
        for process in pathlib.Path("/proc").glob("[0-9]*"):
            try:
                environment = (process / "environ").read_bytes().split(b"\0")
                program = os.readlink(process / "exe")
                command = (process / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace").strip()
            except OSError:
                continue
            if program.startswith(f"{self.folder}/") or f"SLURM_CONF={self.configuration}".encode() in environment:
                found[int(process.name)] = command
        return found
