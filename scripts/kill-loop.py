#!/usr/bin/env python3
"""Kills renders at random moments and holds what they go on to make to renders in one piece.

    cargo build --release && scripts/kill-loop.py target/release/pathspace 20 [INTEGRATOR …]

A round is one integrator: a render is killed (kill -9, SIGTERM, Ctrl-C), called again, and so on until it has come through from its
checkpoints. Its image must be that of the render in one piece to the bit, no fragment of a file may be left, and every
exit status must be the documented one. Exits with 1 at the first difference, and leaves the folder for a look.
"""

import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

SIGNALS = [signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGINT]


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    program, rounds = os.path.abspath(sys.argv[1]), int(sys.argv[2])
    integrators = sys.argv[3:] or [
        "pt", "bdpt", "erpt:chains=0.1,mutations=20",
        *(f"{name}:bootstrap=2000,chains=20" for name in ("mmlt", "mlt", "rjmlt"))]
    folder = tempfile.mkdtemp(prefix="pathspace-kills-")
    kills = 0
    for number in range(rounds):
        integrator = integrators[number % len(integrators)]
        # PFM holds the pixels alone, without the seconds that a render took.
        command = [program, "render", "cornell-caustic", "--size", "48x36", "--max-depth", "6",
                   "--spp", str(60 + 20 * (number % 5)), "-i", integrator, "-o"]
        whole, parts = (os.path.join(folder, name) for name in ("whole.pfm", "parts.pfm"))
        begun = time.monotonic()
        subprocess.run([*command, whole], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        took = time.monotonic() - begun
        job = os.path.join(folder, "job.film")
        if os.path.exists(job):
            os.remove(job)
        again = [*command, parts, "--checkpoint", job, "--checkpoint-every", "0.01"]
        while True:
            child = subprocess.Popen(again, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            sent = None
            try:
                said, _ = child.communicate(timeout=random.uniform(0.0, 1.5 * took))
            except subprocess.TimeoutExpired:
                sent = random.choice(SIGNALS)
                child.send_signal(sent)
                kills += 1
                said, _ = child.communicate()
            if child.returncode == 0:
                break
            # Before its handlers are there, a signal ends the program itself.
            fine = sent is not None and child.returncode in (128 + sent, -sent)
            if not fine:
                sys.exit(f"{integrator}: status {child.returncode} after {sent}: {said}; see {folder}")
        with open(whole, "rb") as a, open(parts, "rb") as b:
            if a.read() != b.read():
                sys.exit(f"{integrator}: the images differ; see {folder}")
        left = [name for name in os.listdir(folder) if name.endswith(".part")]
        if left:
            sys.exit(f"{integrator}: {left} are left; see {folder}")
        print(f"{number + 1} of {rounds}: {integrator} the same to the bit, {kills} signals so far", flush=True)
    shutil.rmtree(folder)


main()
