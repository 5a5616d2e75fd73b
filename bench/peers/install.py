"""Makes a virtual environment for each peer beside this file and installs the pinned wheels into it, once.

Any Python 3 can run it. LIGHTPATHS_PEERS=DIR puts the environments elsewhere.
"""

import glob
import hashlib
import os
import shutil
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
PEERS = {"mitsuba": "import mitsuba", "cycles": "import bpy"}
VERSION = "3.11"
"""The one that Blender's wheel is made for; Mitsuba's exists for it too."""
LIBRARIES = "libxxf86vm1 libxfixes3 libxi6 libxkbcommon0 libgl1 libsm6"
CHECK = "import sys, venv, ensurepip; sys.exit('%d.%d' % sys.version_info[:2] != '" + VERSION + "')"


def find_python():
    """A Python of VERSION that can make virtual environments, from PATH or from pyenv's folder."""
    named = [shutil.which("python" + VERSION), shutil.which("python3"), sys.executable]
    root = os.environ.get("PYENV_ROOT", os.path.expanduser("~/.pyenv"))
    named += sorted(glob.glob(os.path.join(root, "versions", VERSION + "*", "bin", "python")), reverse=True)
    for python in filter(None, named):
        if subprocess.run([python, "-c", CHECK], stderr=subprocess.DEVNULL).returncode == 0:
            return python
    sys.exit(
        "peers: Python {0} with venv is missing: Blender's wheel exists for no other. "
        "Debian 12: apt-get install python{0}-venv; elsewhere: pyenv install {0}, or uv python install {0}".format(
            VERSION
        )
    )


def install(name, trial):
    folder = os.path.join(os.environ.get("LIGHTPATHS_PEERS", HERE), ".venv-" + name)
    wanted = os.path.join(HERE, "requirements-" + name + ".txt")
    with open(wanted, "rb") as file:
        fingerprint = hashlib.sha256(file.read()).hexdigest()
    stamp, python = os.path.join(folder, "installed"), os.path.join(folder, "bin", "python")
    if os.path.exists(stamp) and open(stamp).read() == fingerprint:
        return
    print("peers: installing {} into {}".format(name, folder), file=sys.stderr)
    subprocess.run([find_python(), "-m", "venv", "--clear", folder], check=True)
    subprocess.run([python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r", wanted], check=True)
    tried = subprocess.run(
        [python, "-c", trial], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, universal_newlines=True
    )
    if tried.returncode != 0:
        last = (tried.stderr.strip().splitlines() or ["no message"])[-1]
        hint = "; it may lack libraries. Debian: apt-get install " + LIBRARIES if ".so" in last else ""
        sys.exit("peers: {} does not start: {}{}".format(name, last, hint))
    with open(stamp, "w") as file:
        file.write(fingerprint)


if __name__ == "__main__":
    try:
        for name, trial in PEERS.items():
            install(name, trial)
    except subprocess.CalledProcessError as failure:
        sys.exit("peers: {} failed with {}".format(" ".join(failure.cmd), failure.returncode))
