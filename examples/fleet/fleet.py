#!/usr/bin/env python3
"""Identifies a robot from the logs of a fleet, reduced by the workers of a Dask cluster.

    pip install "dask[distributed]"
    python examples/fleet/fleet.py --urdf robot.urdf --declare viscous_friction --out out logs/*.csv

Without --scheduler the workers are processes of this machine. With it they are those of a cluster, on which
phiw is installed and the logs are seen under the same paths. The result is that of `phiw identify` on one
machine, to the last bit.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from dask.distributed import Client, LocalCluster, as_completed


def phiw(command, *words, threads=None):
    """Runs the command `phiw`; what it says of a failure is the error's message."""
    environment = dict(os.environ)
    if threads is not None:
        environment["RAYON_NUM_THREADS"] = str(threads)
    done = subprocess.run([command, *map(str, words)], capture_output=True, text=True, env=environment)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip())
    return done.stdout


def reduced(command, plan, log):
    """The factors of one log. They travel as bytes, so workers need no folder in common."""
    with tempfile.TemporaryDirectory() as folder:
        own_plan, shard = Path(folder, "plan.json"), Path(folder, "log.factor")
        own_plan.write_bytes(plan)
        phiw(command, "reduce", "--quiet", "--plan", own_plan, log, "--out", shard, threads=1)
        return shard.read_bytes()


def identify(client, arguments):
    """Plans here, reduces on the workers, fits here."""
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        plan = folder / "plan.json"
        options = []
        for name, values in [("--declare", arguments.declare), ("--hold", arguments.hold)]:
            options += [name, values] if values else []
        options += ["--validate", *arguments.validate] if arguments.validate else []
        phiw(arguments.phiw, "plan", "--urdf", arguments.urdf, *arguments.logs, *options, "--out", plan)
        logs = [*arguments.logs, *arguments.validate]
        everywhere = client.scatter(plan.read_bytes(), broadcast=True)
        futures = {
            client.submit(reduced, arguments.phiw, everywhere, str(log.resolve()), pure=False): place
            for place, log in enumerate(logs)
        }
        shards = []
        for future, content in as_completed(futures, with_results=True):
            shard = folder / f"{futures[future]}.factor"
            shard.write_bytes(content)
            shards.append(shard)
        return phiw(
            arguments.phiw, "identify", "--plan", plan, "--factors", *shards, "--out", arguments.out
        )


def main():
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("logs", nargs="+", type=Path, help="logs that the model is fitted to")
    parser.add_argument("--urdf", required=True, type=Path)
    parser.add_argument("--validate", nargs="+", type=Path, default=[], metavar="LOG")
    parser.add_argument("--declare", metavar="KIND,…", help="effects beside the rigid body")
    parser.add_argument("--hold", metavar="JOINT[=VALUE],…", help="joints that do not move")
    parser.add_argument("--out", required=True, type=Path, help="folder for the results")
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="processes of a local cluster")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="a cluster's scheduler")
    parser.add_argument("--phiw", default="phiw", help="the command, where it is not on the PATH")
    arguments = parser.parse_args()
    if arguments.scheduler:
        with Client(arguments.scheduler) as client:
            print(identify(client, arguments), end="")
        return
    with LocalCluster(arguments.workers, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        with Client(cluster) as client:
            print(identify(client, arguments), end="")


if __name__ == "__main__":
    try:
        main()
    except RuntimeError as error:
        sys.exit(str(error))
