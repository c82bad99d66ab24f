"""Shared by the tests of the Python module: the programs, a tiny scene, and trainings of a few steps on the CPU.

TRISOUP_BIN names the folder of the programs. The module is found by PYTHONPATH.
"""

import json
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np

import trisoup

BIN = Path(os.environ["TRISOUP_BIN"])
SOURCE = Path(__file__).resolve().parents[2]
SANITIZED = "TRISOUP_PRELOAD" in os.environ  # slower, and memory is kept to find its wrong use
CPU = trisoup.Device("cpu")
# As common.sh of the end-to-end tests.
TINY = {"init_count": 120, "init_radius": 0.2, "init_box": 0.7, "refine_every": 20}


def run(program: str, *arguments: object) -> str:
    """Returns the standard output of a program."""
    environment = {name: value for name, value in os.environ.items() if name != "LD_PRELOAD"}
    done = subprocess.run([BIN / program, *map(str, arguments)], capture_output=True, text=True, env=environment)
    if done.returncode != 0:
        raise AssertionError(f"{program}: {done.stderr}")
    return done.stdout


class SceneTest(unittest.TestCase):
    """A test with a folder of its own and a tiny scene."""

    @classmethod
    def setUpClass(cls) -> None:
        cls.temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.temporary.cleanup)
        cls.folder = Path(cls.temporary.name)
        run("make-tiny-scene", cls.folder / "scene")
        cls.scene = trisoup.Dataset(cls.folder / "scene")

    def train(self, steps: int = 20, device: object = None, **options: object) -> trisoup.Training:
        """A training of the tiny scene, at its beginning."""
        options.setdefault("settings", TINY)
        return trisoup.Training(self.scene, "fast", steps=steps, triangles=40, device=device or CPU, **options)

    def model(self, steps: int = 20) -> trisoup.Model:
        training = self.train(steps)
        training.run()
        return training.model()


def memory() -> int:
    """Bytes of memory of this process."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


def metrics(text: str) -> dict:
    return json.loads(text)


def bits(array: np.ndarray) -> bytes:
    return np.ascontiguousarray(array).tobytes()
