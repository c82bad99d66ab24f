"""The examples run, and the first lines of the documentation do what they say."""

import contextlib
import importlib.util
import io
import re
import runpy
import sys
import unittest

import numpy as np

import trisoup
from common import SOURCE, SceneTest


class Examples(SceneTest):
    def example(self, name: str, *arguments: object) -> str:
        """Runs an example in this process and returns what it prints."""
        said, before = io.StringIO(), sys.argv
        sys.argv = [name, *map(str, arguments)]
        try:
            with contextlib.redirect_stdout(said):
                runpy.run_path(str(SOURCE / "examples/python" / name), run_name="__main__")
        finally:
            sys.argv = before
        return said.getvalue()

    def test_examples(self) -> None:
        out = self.folder / "out"
        said = self.example("train_and_compare.py", self.folder / "scene", out, 10)
        self.assertEqual(said.count(" dB"), 2 * len(self.scene.test) + 2)
        model = trisoup.Model.load(out / "fast.glb")
        height, width, _ = self.scene.test[0].image.shape
        compared = np.load(out / "compare.npy")
        self.assertEqual(compared.shape, (height, 3 * width, 3))
        np.testing.assert_allclose(compared[:, :width], self.scene.test[0].image / 255, atol=1e-6)

        self.model(100).save(out / "tiny.glb")
        self.example("render_path.py", out / "tiny.glb", out / "path", 3)
        pictures = [np.load(out / "path" / f"{i:03}.npy") for i in range(3)]
        self.assertTrue(all(picture.shape == (240, 320, 4) for picture in pictures))
        for picture in pictures:  # the cube is in the middle of each
            self.assertTrue(np.isfinite(picture[100:140, 140:180, 3]).mean() > 0.2)
        self.assertFalse(np.array_equal(pictures[0], pictures[1]))

        said = self.example("read_a_model.py", out / "fast.glb", out / "soup.obj")
        self.assertIn("trained for 10 steps", said)
        lines = (out / "soup.obj").read_text().splitlines()
        self.assertEqual(sum(line.startswith("f ") for line in lines), model.triangles)
        vertices = np.array([line.split()[1:] for line in lines if line.startswith("v ")], float)
        np.testing.assert_allclose(vertices, model.vertices.reshape(-1, 3), rtol=1e-6)

    def test_error_by_views(self) -> None:
        self.model(100).save(self.folder / "soup.glb")
        said = self.example("error_by_views.py", self.folder / "scene", self.folder / "soup.glb").splitlines()
        shares = [[float(share) for share in re.findall(r"([\d.]+)%", line)] for line in said[1:]]
        np.testing.assert_allclose(np.sum(shares, axis=0), 100, atol=0.3)
        self.assertGreater(shares[3][0], 10)  # the scene is photographed all round

        # Cameras 1 above a plane and beside each other.
        example = runpy.run_path(str(SOURCE / "examples/python/error_by_views.py"), run_name="example")
        plane = np.ones((16, 16))
        above = lambda x: trisoup.Camera.look_at((x, 0, 1), (x, 0, 0), (0, 1, 0), 60, 16, 16)
        points = example["surface"](above(0), plane)
        np.testing.assert_allclose(points[:, 2], 0, atol=1e-9)
        row = lambda *train: example["row_of_pixels"](above(0), points, list(train))[16 * 8 + 8]
        near, far, beyond = (above(0.1), plane), (above(0.2), plane), (above(-0.3), plane)
        self.assertEqual([row(), row(near), row(near, far), row(near, far, beyond)], [0, 1, 2, 3])
        self.assertEqual([row(near, (above(-0.3), 0.9 * plane)), row((above(9), plane))], [1, 0])

    @unittest.skipUnless(importlib.util.find_spec("matplotlib"), "matplotlib is not installed")
    def test_chart(self) -> None:
        said = self.example("sweep_budget.py", self.folder / "scene", self.folder / "chart.png", 5, 20, 40)
        self.assertEqual(said.count(" MB"), 2)
        self.assertEqual((self.folder / "chart.png").read_bytes()[1:4], b"PNG")

    @unittest.skipIf(sys.version_info < (3, 11), "needs tomllib")
    def test_project_file(self) -> None:
        """pyproject.toml names the version, the target and the component of CMake."""
        import tomllib

        project = tomllib.loads((SOURCE / "pyproject.toml").read_text())
        build = project["tool"]["scikit-build"]
        version = build["metadata"]["version"]
        found = re.search(version["regex"], (SOURCE / version["input"]).read_text(), re.MULTILINE)
        self.assertEqual(found["value"], trisoup.__version__)
        cmake = (SOURCE / "python/CMakeLists.txt").read_text()
        for name in build["cmake"]["targets"] + build["install"]["components"]:
            self.assertRegex(cmake, rf"\b{name}\b")

    def test_documentation(self) -> None:
        """Runs the blocks of docs/python.md in one process, on smaller trainings."""
        text = (SOURCE / "docs/python.md").read_text()
        blocks = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
        self.assertGreaterEqual(len(blocks), 2)
        code = "\n".join(blocks).replace("assets/garden", str(self.folder / "scene"))
        code, count = re.subn(r'preset="fast"', 'preset="fast", steps=4', code)
        self.assertGreaterEqual(count, 1)
        names = {}
        with contextlib.redirect_stdout(io.StringIO()), contextlib.chdir(self.folder):
            exec(code, names)  # noqa: S102
        self.assertEqual(names["image"].dtype, np.float32)


if __name__ == "__main__":
    unittest.main()
