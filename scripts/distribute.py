"""Builds one city on several workers, by Dask: shares with hlod-build --subset, then hlod-build merge.

Without --scheduler on worker processes of this machine. With it on a cluster that is there already, whose
machines see inputs and output under the same paths: `dask scheduler` and `dask worker` by hand, or what
dask-jobqueue starts on Slurm or PBS, or Dask's operator on Kubernetes. A worker that dies costs the share
that it was building: that is built again by another.
"""

import argparse
import json
import os
import shutil
import socket
import subprocess
import sys
import time
from pathlib import Path


def main():
    arguments = parse()
    import dask
    from distributed import Client, LocalCluster

    dask.config.set({"distributed.scheduler.allowed-failures": arguments.retries})
    begin = time.monotonic()
    cores = os.cpu_count() or 1
    if arguments.scheduler:
        client = Client(arguments.scheduler)
    else:
        workers = arguments.workers or cores
        arguments.threads = arguments.threads or max(1, cores // workers)
        cluster = LocalCluster(
            n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None
        )
        client = Client(cluster)
    with client:
        workers = len(client.scheduler_info()["workers"])
        # Several for each worker, so that none waits long for the last.
        of = arguments.shares or min(4 * max(1, workers), blocks_of(arguments))
        shares = build(client, arguments, of)
    merging = time.monotonic()
    merge = [arguments.program, "merge", "--quiet", "--threads", "0", arguments.build[-1]]
    if subprocess.run(merge).returncode != 0:
        sys.exit("distribute: merging failed; all subsets are built, and are not built again")
    end = time.monotonic()
    tell(arguments, shares, workers, end - begin, end - merging)


def parse():
    parser = argparse.ArgumentParser(
        prog="distribute",
        description=__doc__,
        usage="%(prog)s [OPTIONS] -- [HLOD-BUILD OPTIONS] INPUT... OUT",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of a cluster, such as tcp://host:8786")
    parser.add_argument("--workers", type=int, help="processes on this machine [one for each core]")
    parser.add_argument("--shares", type=int, help="subsets [4 for each worker, one for each block at most]")
    parser.add_argument("--threads", type=int, default=0, help="of each hlod-build [its worker's part of the cores]")
    parser.add_argument("--retries", type=int, default=3, help="times that a share is tried again [3]")
    parser.add_argument("--program", default=shutil.which("hlod-build"), help="hlod-build, where it is not in PATH")
    parser.add_argument("--report", metavar="FILE", help="what each share took, as JSON")
    parser.add_argument("build", nargs=argparse.REMAINDER, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    arguments.build = arguments.build[1:] if arguments.build[:1] == ["--"] else arguments.build
    if len(arguments.build) < 2:
        parser.error("expected -- INPUT... OUT")
    if not arguments.program:
        parser.error("no hlod-build in PATH; name it by --program")
    arguments.program = os.path.abspath(arguments.program)
    return arguments


def blocks_of(arguments):
    """Returns the number of blocks, from the message with which hlod-build refuses more subsets than blocks.

    The probe scans all inputs. --shares avoids it.
    """
    probe = [arguments.program, "--quiet", "--subset", "1/4294967295", *arguments.build]
    done = subprocess.run(probe, capture_output=True, text=True)
    found = done.stderr.rstrip().rpartition("found ")[2]
    if not found.isdigit():
        sys.exit(done.stderr.strip() or "distribute: cannot tell how many blocks there are")
    return int(found)


def build(client, arguments, of):
    """Builds all shares; what each took."""
    from distributed import as_completed

    def command(number):
        subset = ["--quiet", "--subset", f"{number}/{of}", "--threads", str(arguments.threads)]
        return [arguments.program, *subset, *arguments.build]

    folder = os.getcwd()
    waiting = [
        client.submit(build_share, command(number), folder, number, pure=False, retries=arguments.retries)
        for number in range(1, of + 1)
    ]
    shares = []
    for future in as_completed(waiting):
        try:
            shares.append(future.result())
        except Exception as error:
            sys.exit(f"distribute: a share failed {arguments.retries + 1} times: {error}")
        share = shares[-1]
        where, seconds = f"{share['host']}, {share['pid']}", share["seconds"]
        print(f"{len(shares)} of {of}: subset {share['number']}, {seconds:.1f} s on {where}", file=sys.stderr)
    return sorted(shares, key=lambda share: share["number"])


def build_share(command, folder, number):
    """Builds one share, on a worker."""
    begin = time.monotonic()
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"exit code {done.returncode} of subset {number}: {done.stderr.strip()}")
    seconds = time.monotonic() - begin
    return {"number": number, "host": socket.gethostname(), "pid": os.getpid(), "seconds": seconds}


def tell(arguments, shares, workers, seconds, merge_seconds):
    work = sum(share["seconds"] for share in shares)
    longest = max(share["seconds"] for share in shares)
    print(
        f"{len(shares)} subsets on {workers} workers: {seconds:.1f} s, of which merging {merge_seconds:.1f} s; "
        f"{work:.1f} s of work, the longest subset {longest:.1f} s"
    )
    if arguments.report:
        report = {"workers": workers, "seconds": seconds, "merge_seconds": merge_seconds, "subsets": shares}
        beside = f"{arguments.report}.partial"
        Path(beside).write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")
        os.replace(beside, arguments.report)


if __name__ == "__main__":
    main()
