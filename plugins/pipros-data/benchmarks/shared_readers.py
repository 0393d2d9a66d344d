#!/usr/bin/env python3
"""Threads and forked workers that share a bag: items that are wrong, and errors, of pipros and others.

    .venv/bin/python plugins/pipros-data/benchmarks/shared_readers.py [--items 500] [--torch]

A bag of lz4 chunks with images is opened once. Then 8 threads, and 4 forked workers, read all images in
random order; each image is compared with what was written. With `--torch`, the workers are those of PyTorch's
DataLoader, in Debian's Python, which needs the Debian package python3-torch. Ends with 1 if pipros is wrong.
"""

import argparse
import datetime
import glob
import importlib.metadata
import json
import multiprocessing
import os
import random
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

THREADS, WORKERS = 8, 4
DEBIANS = "/usr/bin/python3"
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
PATHS = os.pathsep.join(
    glob.glob(os.path.join(ROOT, "p*", "pipros*", "src"))
    + glob.glob(os.path.join(ROOT, "p*", "pipros*", "facades"))
)
WRONG, FAILED = "wrong", "errors"


def content(number):
    return random.Random(number).randbytes(30000)  # noqa: S311 # repeatable


class Images:
    """The images of a bag that is open."""

    def __init__(self, library, path):
        self.library = library
        if library == "rosbags":
            from pathlib import Path

            from rosbags.highlevel import AnyReader

            self.reader = AnyReader([Path(path)])
            self.reader.open()
        else:
            import rosbag

            self.reader = rosbag.Bag(path)

    def __getitem__(self, number):
        """Return "", or what is wrong with an image."""
        try:
            return "" if self.data(number) == content(number) else WRONG
        except Exception:
            return FAILED

    def data(self, number):
        if self.library == "rosbags":
            start = (number + 1) * 10**9
            [(connection, _, data)] = self.reader.messages(start=start, stop=start + 1)
            return bytes(self.reader.deserialize(data, connection.msgtype).data)
        import rospy

        at = rospy.Time(number + 1)
        [(_, message, _)] = self.reader.read_messages(start_time=at, end_time=at)
        return bytes(message.data)


class Dataset:
    """A data set in PyTorch's sense."""

    def __init__(self, images, items):
        self.images, self.items = images, items

    def __len__(self):
        return self.items

    def __getitem__(self, number):
        return self.images[number]


_images = {}


def _item(number):
    return _images[0][number]


def found(library, path, how, items):
    images = _images[0] = Images(library, path)
    numbers = random.Random(1).sample(range(items), items)  # noqa: S311 # repeatable
    if how == "threads":
        with ThreadPoolExecutor(THREADS) as pool:
            return list(pool.map(_item, numbers))
    if how == "DataLoader":
        from torch.utils.data import DataLoader

        loader = DataLoader(Dataset(images, items), batch_size=None, num_workers=WORKERS, shuffle=True)
        return list(loader)
    with multiprocessing.get_context("fork").Pool(WORKERS) as pool:
        return pool.map(_item, numbers, 1)


def measure(library, path, how, items):
    """Run a library in its own Python. Return the numbers of wrong items and of errors."""
    is_debians = library == "genuine rosbag" or how == "DataLoader"
    python = DEBIANS if is_debians else sys.executable
    more = {"PYTHONPATH": PATHS} if library == "pipros" and is_debians else {}
    words = [python, os.path.abspath(__file__), "--items", str(items), "--worker", library, how, path]
    ended = subprocess.run(words, env=os.environ | more, capture_output=True, text=True, check=False)
    if ended.returncode:
        raise SystemExit(f"{library}, {how}: {ended.stderr}")
    return json.loads(ended.stdout.splitlines()[-1])


def version(library):
    if library != "genuine rosbag":
        return importlib.metadata.version(library)
    words = ["dpkg-query", "-W", "-f", "${Version}", "python3-rosbag"]
    return subprocess.run(words, capture_output=True, text=True, check=True).stdout


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--items", type=int, default=500)
    parser.add_argument("--torch", action="store_true")
    parser.add_argument("--worker", nargs=3, help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.worker:
        library, how, path = chosen.worker
        results = found(library, path, how, chosen.items)
        print(json.dumps([results.count(WRONG), results.count(FAILED)]))
        return
    from sensor_msgs.msg import Image

    import rosbag
    import rospy

    hows = ("threads", "forked workers")
    libraries = ["pipros", "genuine rosbag", "rosbags"]
    if chosen.torch:
        if subprocess.run([DEBIANS, "-c", "import torch"], capture_output=True, check=False).returncode:
            raise SystemExit("Debian's package python3-torch is needed: apt-get install python3-torch")
        hows, libraries = ("DataLoader",), libraries[:2]
    is_wrong = False
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "run.bag")
        with rosbag.Bag(path, "w", compression="lz4", chunk_threshold=100_000) as bag:
            for number in range(chosen.items):
                bag.write("/camera", Image(data=content(number)), rospy.Time(number + 1))
        print(f"{datetime.datetime.now(datetime.timezone.utc).date()}, {chosen.items} images:\n")
        print("| library | " + " | ".join(f"{how}: {WRONG}, {FAILED}" for how in hows) + " |")
        print("| --- |" + " --- |" * len(hows))
        for library in libraries:
            counts = [measure(library, path, how, chosen.items) for how in hows]
            is_wrong |= library == "pipros" and any(map(any, counts))
            cells = " | ".join(f"{wrong}, {failed}" for wrong, failed in counts)
            print(f"| {library} {version(library)} | {cells} |", flush=True)
    raise SystemExit(is_wrong)


if __name__ == "__main__":
    main()
