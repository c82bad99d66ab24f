"""The module trains, renders and measures what the programs do."""

import math
import unittest

import numpy as np

import trisoup
from common import BIN, CPU, SOURCE, TINY, SceneTest, bits, metrics, run


class Results(SceneTest):
    def test_model_is_that_of_the_program(self) -> None:
        options = [word for name, value in TINY.items() for word in (
            ("--set", f"{name}={value}") if name == "refine_every" else ("--" + name.replace("_", "-"), value))]
        run("soup-train", self.folder / "scene", "-o", self.folder / "run", "--preset", "fast", "--steps", 60,
            "--triangles", 40, "--seed", 3, "--backend", "cpu", "-q", *options)
        training = self.train(60, seed=3)
        steps = [progress.step for progress in training.steps(every=7)]
        self.assertEqual(steps, [7, 14, 21, 28, 35, 42, 49, 56, 60])
        model = training.model()
        model.save(self.folder / "model.glb")
        file = (self.folder / "run" / "model.glb").read_bytes()
        self.assertEqual((self.folder / "model.glb").read_bytes(), file)
        self.assertEqual(bytes(model), file)
        other = self.train(60, seed=4)
        other.run()
        self.assertNotEqual(bytes(other.model()), file)

        # Quality of each view, as the training and soup-eval print it.
        expected = metrics(run("soup-eval", self.folder / "run", self.folder / "scene", "--backend", "cpu"))
        evaluation = model.evaluate(self.scene, device=CPU)
        self.assertEqual(len(evaluation.views), len(expected["views"]))
        for view, row in zip(evaluation.views, expected["views"]):
            self.assertEqual(view.name, row["name"])
            for measure, value in view.as_dict().items():
                expected_value = math.nan if row.get(measure) is None else row[measure]
                np.testing.assert_allclose(value, expected_value, atol=1e-9, err_msg=measure)
        self.assertAlmostEqual(evaluation.mean.psnr, expected["psnr"], places=9)
        self.assertEqual(evaluation.rows()[0]["psnr"], evaluation.views[0].psnr)

    def test_another_background(self) -> None:
        """A model is measured on the background of the dataset, as by soup-eval --background."""
        model = self.model(60)
        file = self.save(model)
        for background in ("grey", "black"):
            scene = trisoup.Dataset(self.folder / "scene", background=background)
            expected = metrics(run("soup-eval", file, self.folder / "scene", "--backend", "cpu",
                                   "--background", background))
            self.assertAlmostEqual(model.evaluate(scene, device=CPU).mean.psnr, expected["psnr"], places=9)

    def test_bundled_scene(self) -> None:
        """The five lines of the documentation, and bits on the scene of the repository."""
        run("soup-train", SOURCE / "assets/garden", "-o", self.folder / "garden", "--preset", "fast", "--steps", 4,
            "--backend", "cpu", "-q")
        scene = trisoup.Dataset(SOURCE / "assets/garden")
        training = trisoup.Training(scene, preset="fast", seed=0, steps=4, device="cpu")
        for progress in training.steps(every=2):
            self.assertGreater(progress.psnr, 0)
        model = training.model()
        self.assertEqual(bytes(model), (self.folder / "garden/model.glb").read_bytes())
        image = model.render(scene.test[0].camera, device=CPU)
        height, width, _ = scene.test[0].image.shape
        self.assertEqual((image.shape, image.dtype), ((height, width, 3), np.float32))

    def test_rendering_has_the_error_that_is_measured(self) -> None:
        model = self.model(60)
        for view, quality in zip(self.scene.test, model.evaluate(self.scene, device="cpu").views):
            image = model.render(view.camera, device=CPU)
            self.assertEqual(image.shape, view.image.shape)
            error = np.abs(np.clip(image, 0, 1) - view.image / np.float32(255))[view.mask >= 128].mean()
            self.assertAlmostEqual(float(error), quality.mae, places=5)
        again = trisoup.Model.load(self.save(model))
        self.assertEqual(bits(again.render(view.camera, device=CPU)), bits(image))

    def test_exposures_are_those_that_are_measured(self) -> None:
        """Photographs darker on one side: test views are compared in the exposure of their neighbours."""
        views, images = self.scene.train + self.scene.test, []
        for view in views:
            odds = math.exp(0.8 * np.sign(view.camera.world_to_camera[2, 0]))
            colour = view.image / 255
            images.append(np.round(255 * odds * colour / (1 + (odds - 1) * colour)).astype(np.uint8))
        scene = trisoup.Dataset.from_arrays(images, [v.camera for v in views], names=[v.name for v in views],
                                            test=[v.test for v in views])
        training = trisoup.Training(scene, preset="fast", steps=120, device="cpu",
                                    settings={**TINY, "exposure": True})
        training.run()
        model = training.model()
        for view, quality in zip(scene.test, model.evaluate(scene, device="cpu").views):
            odds = np.exp(model.exposure(view))
            self.assertGreater(np.abs(np.log(odds)).max(), 0.02)
            image = model.render(view.camera, device=CPU)
            shown = np.where(image == model.background, image, odds * image / (1 + (odds - 1) * image))
            error = np.abs(np.clip(shown, 0, 1) - view.image / np.float32(255))[view.mask >= 128].mean()
            self.assertAlmostEqual(float(error), quality.mae, places=5)

    def save(self, model: trisoup.Model):
        model.save(self.folder / "saved.glb")
        return self.folder / "saved.glb"

    def test_pixels_belong_to_their_triangles(self) -> None:
        """Barycentrics, depth and normals agree with vertices and camera."""
        model = self.model(60)
        camera = self.scene.test[0].camera
        ids, weights, depth, normal, alpha = model.render(
            camera, outputs=("triangle", "barycentrics", "depth", "normal", "alpha"), device=CPU)
        shown = ids >= 0
        self.assertTrue(shown.any() and not shown.all())
        self.assertEqual(bits(alpha), bits(shown.astype(np.float32)))
        self.assertTrue(np.isinf(depth[~shown]).all())
        np.testing.assert_allclose(weights[shown].sum(axis=1), 1, atol=1e-5)
        corners = model.vertices[ids[shown]].astype(np.float64) + model.origin
        points = np.einsum("nk,nkc->nc", weights[shown], corners)
        pose = camera.world_to_camera
        seen = points @ pose[:3, :3].T + pose[:3, 3]
        np.testing.assert_allclose(seen[:, 2], depth[shown], rtol=1e-4)
        projected = seen / seen[:, 2:] @ camera.intrinsics.T
        rows, columns = np.nonzero(shown)
        inside = (weights[shown] > 1e-3).all(axis=1)  # at edges points are moved into the triangle
        self.assertTrue(inside.any())
        np.testing.assert_allclose(projected[inside][:, 0], columns[inside] + 0.5, atol=1e-2)
        np.testing.assert_allclose(projected[inside][:, 1], rows[inside] + 0.5, atol=1e-2)
        np.testing.assert_allclose(np.linalg.norm(normal[shown], axis=1), 1, atol=1e-5)
        centre = -pose[:3, :3].T @ pose[:3, 3]
        self.assertTrue((((centre - points) * normal[shown]).sum(axis=1) > -1e-6).all())

    def test_features_of_pixels_are_those_of_their_lattices(self) -> None:
        model = self.model(60)
        ids, weights, features = model.render(
            self.scene.test[0].camera, outputs=("triangle", "barycentrics", "features"), device=CPU)
        self.assertEqual((features.shape, features.dtype), ((*ids.shape, 8), np.float32))
        self.assertFalse(features[ids < 0].any())
        for row, column in np.argwhere(ids >= 0)[::7]:
            side = 2 ** int(model.texture_levels[ids[row, column]])
            diagonals = [(n - y, y) for n in range(side + 1) for y in range(n + 1)]
            dx, dy = (side * weights[row, column, :2].astype(np.float64) - np.array(diagonals)).T
            hats = np.maximum(0, 1 - np.maximum(np.maximum(abs(dx), abs(dy)), abs(dx + dy)))
            first = model.texture_offsets[ids[row, column]]
            np.testing.assert_allclose(hats @ model.features[first:first + len(hats)], features[row, column], atol=1e-4)

    def test_pixels_are_those_of_the_viewer(self) -> None:
        """soup-view --data writes the same numbers, except where rounding decides between two triangles."""
        model = self.model(60)
        path = self.save(model)
        kinds = ("triangle", "barycentrics", "depth", "normal", "features")
        run("soup-view", path, "--screenshot", self.folder / "view.png", "--camera", 0, "--data", ",".join(kinds))
        arrays = dict(zip(kinds, model.render(model.cameras[0].camera, kinds, device=CPU)))
        files = {kind: np.load(self.folder / f"view.{kind}.npy") for kind in kinds}
        same = files["triangle"] == arrays["triangle"]
        self.assertGreater(same.mean(), 0.99)
        for kind, file in files.items():
            self.assertEqual((file.dtype, file.shape), (arrays[kind].dtype, arrays[kind].shape))
            np.testing.assert_allclose(file[same], arrays[kind][same], rtol=1e-5, atol=1e-6)

    def test_background_is_where_nothing_is(self) -> None:
        model = self.model()
        camera = self.scene.test[0].camera
        alpha = model.render(camera, "alpha", device=CPU)
        image = model.render(camera, background=(0.25, 0.5, 1), device=CPU)
        np.testing.assert_array_equal(image[alpha == 0], np.tile(np.float32([0.25, 0.5, 1]), ((alpha == 0).sum(), 1)))
        self.assertEqual(bits(model.render(camera, device=CPU)[alpha == 1]), bits(image[alpha == 1]))

    def test_a_model_without_the_engine(self) -> None:
        """Textures, table and MLP are enough to compute a pixel: the base colour and the MLP's residual."""
        model = self.model(60)
        levels, offsets = model.texture_levels, model.texture_offsets
        counts = np.array([3, 6, 15, 45, 153, 561])[levels]
        self.assertEqual(bits(np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.uint32)), bits(offsets))
        self.assertEqual(counts.sum(), len(model.texels))
        np.testing.assert_array_equal(model.features, model.texels / np.float32(255))
        self.assertEqual([w.shape for w, b in model.mlp], [(16, 16), (16, 16), (3, 16)])
        self.assertEqual([b.shape for w, b in model.mlp], [(16,), (16,), (3,)])
        self.assertEqual(model.vertices.shape, (model.triangles, 3, 3))
        self.assertEqual(model.faces.tolist(), np.arange(3 * model.triangles).reshape(-1, 3).tolist())
        self.assertEqual(model.settings["steps"], 60)
        self.assertEqual(len(model.cameras), len(self.scene.train) + len(self.scene.test))
        np.testing.assert_allclose(model.cameras[0].camera.world_to_camera, self.scene.test[0].camera.world_to_camera,
                                   atol=1e-6)

    def test_settings_are_those_of_the_table(self) -> None:
        names = [setting.name for setting in trisoup.settings()]
        self.assertEqual(len(names), len(set(names)))
        page = run("soup-train", "--settings-page")
        for setting in trisoup.settings():
            self.assertIn(f"`{setting.name}`", page)
            self.assertIn(setting.help, page.replace("\\", ""))
        self.assertTrue(set(names) <= set(self.train().settings), set(names) - set(self.train().settings))

    def test_version(self) -> None:
        self.assertEqual(run("soup-train", "--version").split()[1], trisoup.__version__)
        self.assertTrue(BIN.is_dir())


if __name__ == "__main__":
    unittest.main()
