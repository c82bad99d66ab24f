#!/usr/bin/env python3
"""Measures what a training costs that is looked at: soup-train --serve with 0, 1 and 8 clients, in turn. A client asks
for the state once a second and for each new model, as the page does, and draws nothing."""
import argparse
import json
import os
import statistics
import subprocess
import tempfile
import threading
import time
import urllib.request
from pathlib import Path

CLIENTS = (0, 1, 8)


def look(url, end, counts):
    """One client, until `end` is set."""
    model = points = 0
    while not end.is_set():
        try:
            text = urllib.request.urlopen(f"{url}state.json?from={points}", timeout=10).read()
            state = json.loads(text)
            points += len(state["points"])
            counts["bytes"] += len(text)
            if state["model"] != model:
                model = state["model"]
                counts["bytes"] += len(urllib.request.urlopen(f"{url}model.glb?{model}", timeout=10).read())
                counts["models"] += 1
        except OSError:
            pass
        end.wait(1)


def seconds_of_page(process):
    """CPU seconds of the threads that encode models and serve them: those of low priority."""
    ticks = 0
    for task in Path(f"/proc/{process}/task").iterdir():
        fields = (task / "stat").read_text().rpartition(")")[2].split()
        if int(fields[16]) > int(os.nice(0)):
            ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def sample(process, end, counts):
    """Keeps seconds_of_page() up to date until `end` is set."""
    while not end.wait(0.2):
        try:
            counts["page"] = max(counts["page"], seconds_of_page(process))
        except OSError:
            pass  # it has ended


def run(program, options, out, clients):
    """One training. Returns seconds of its steps, CPU seconds of the process and of its page, bytes and models sent."""
    process = subprocess.Popen([program, *options, "-o", out, "--overwrite", "-q", "--serve", "0"],
                               stdout=subprocess.PIPE, text=True)
    url = process.stdout.readline().split()[0]
    end, counts = threading.Event(), {"bytes": 0, "models": 0, "page": 0.0}
    threads = [threading.Thread(target=look, args=(url, end, counts)) for _ in range(clients)]
    threads.append(threading.Thread(target=sample, args=(process.pid, end, counts)))
    for thread in threads:
        thread.start()
    _, status, usage = os.wait4(process.pid, 0)
    end.set()
    for thread in threads:
        thread.join()
    if status != 0:
        raise SystemExit(f"the training ended with {status}")
    steps = json.loads((Path(out) / "metrics.json").read_text())["parts"]["steps"]["seconds"]
    return steps, usage.ru_utime + usage.ru_stime, counts["page"], counts["bytes"], counts["models"]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program", help="path of soup-train")
    parser.add_argument("dataset")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("options", nargs=argparse.REMAINDER, help="options of soup-train")
    given = parser.parse_args()
    results = {clients: [] for clients in CLIENTS}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(given.repeats):
            for clients in CLIENTS:
                time.sleep(1)
                results[clients].append(run(given.program, [given.dataset, *given.options], folder + "/out", clients))
    print("|clients|steps, s|CPU, s|of it the page|KB sent|models sent|\n|---|---|---|---|---|---|")
    for clients, rows in results.items():
        steps, cpu, page, size, models = (statistics.median(column) for column in zip(*rows))
        print(f"|{clients}|{steps:.1f}|{cpu:.1f}|{page:.2f}|{size / 1e3:.0f}|{models:.0f}|")


main()
