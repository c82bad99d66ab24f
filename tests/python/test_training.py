"""Trainings in pieces, with callbacks, in threads, interrupted, and from arrays."""

import os
import signal
import threading
import time
import unittest

import numpy as np

import trisoup
from common import CPU, SANITIZED, SOURCE, TINY, SceneTest, bits


class Pieces(SceneTest):
    def test_progress(self) -> None:
        training = self.train(40)
        self.assertEqual((training.step, training.last_step, training.finished), (0, 40, False))
        reports = list(training.steps(every=10, evaluate=True))
        self.assertEqual([p.step for p in reports], [10, 20, 30, 40])
        self.assertTrue(training.finished and all(p.last_step == 40 for p in reports))
        self.assertLess(reports[-1].loss, reports[0].loss)
        self.assertGreater(reports[-1].test.mean.psnr, reports[0].test.mean.psnr)
        self.assertGreater(reports[-1].cpu_seconds, reports[0].cpu_seconds)
        self.assertEqual(list(training.steps()), [])
        self.assertIsNone(next(iter(self.train().steps())).test)

    def test_callback_stops(self) -> None:
        training = self.train(40)
        seen = []
        training.run(lambda progress: seen.append(progress.step) or progress.step < 20, every=10)
        self.assertEqual((seen, training.finished), ([10, 20], False))
        training.run()
        self.assertTrue(training.finished)

    def test_exception_of_a_callback(self) -> None:
        training = self.train(40)
        with self.assertRaisesRegex(ZeroDivisionError, "by zero"):
            training.run(lambda progress: 1 / 0)
        self.assertEqual(training.step, 10)
        training.run()
        self.assertEqual(bytes(training.model()), bytes(self.model(40)))

    def test_interrupt_stops_between_steps(self) -> None:
        training = self.train(20_000)
        threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
        start = time.monotonic()
        with self.assertRaises(KeyboardInterrupt):
            training.run()
        self.assertLess(time.monotonic() - start, 5)
        step = training.step
        self.assertGreater(step, 0)
        training.save_checkpoint(self.folder / "stopped.safetensors")
        resumed = trisoup.Training.resume(self.scene, self.folder / "stopped.safetensors", device=CPU)
        self.assertEqual(resumed.step, step)
        views = self.scene.train + self.scene.test
        other = trisoup.Dataset.from_arrays([v.image for v in views], [v.camera for v in views], test_every=3)
        with self.assertRaises(trisoup.Error) as raised:
            trisoup.Training.resume(other, self.folder / "stopped.safetensors", device=CPU)
        self.assertRegex(str(raised.exception), "; start a new training$")
        for one in (training, resumed):
            next(one.steps(every=5))
        self.assertEqual(bytes(training.model()), bytes(resumed.model()))

    def test_signals_are_handled_while_a_dataset_loads_and_a_training_starts(self) -> None:
        class Alarm(Exception):
            pass

        def handle(*_: object) -> None:
            nonlocal handled
            handled += 1
            if handled == 3:  # one can be after the call
                raise Alarm

        garden = trisoup.Dataset(SOURCE / "assets/garden")
        side = 2000  # of photographs, so that loading takes several times as long as three signals
        cameras = [view.camera.resized(side, side) for view in garden.train[:12]]
        image = np.broadcast_to(np.arange(side, dtype=np.uint16)[:, None, None] % 251, (side, side, 3)).astype(np.uint8)
        large = self.folder / "large"
        trisoup.Dataset.from_arrays([image] * 12, cameras).write_transforms(large)
        self.addCleanup(signal.signal, signal.SIGALRM, signal.signal(signal.SIGALRM, handle))
        self.addCleanup(signal.setitimer, signal.ITIMER_REAL, 0)
        for work in (lambda: trisoup.Dataset(large),
                     lambda: trisoup.Training(garden, device=CPU, settings={"init": "surface"})):
            handled = 0
            signal.setitimer(signal.ITIMER_REAL, 0.01, 0.01)
            with self.assertRaises(Alarm):
                work()
            signal.setitimer(signal.ITIMER_REAL, 0)

    @unittest.skipIf(SANITIZED, "the sanitizer forbids threads after fork")
    def test_devices_do_not_pass_to_a_fork(self) -> None:
        model, camera = self.model(), self.scene.test[0].camera
        expected, training = bits(model.render(camera, device=CPU)), self.train(40)
        calls = [lambda: model.render(camera, device=CPU), training.run, training.model]
        try:
            trisoup.Device("vulkan")
            calls.append(lambda: trisoup.Device("vulkan"))
        except trisoup.Error:
            pass  # there is none

        def child() -> bool:
            for call in calls:
                try:
                    call()
                    return False
                except trisoup.Error as error:
                    if "fork" not in str(error):
                        return False
            self.train(40, device="cpu").run()
            return bits(model.render(camera, device="cpu")) == expected

        process = os.fork()
        if process == 0:
            signal.alarm(60)
            os._exit(0 if child() else 1)
        self.assertEqual(os.waitpid(process, 0)[1], 0)
        self.assertEqual(bits(model.render(camera, device=CPU)), expected)

    def test_python_runs_beside_a_training(self) -> None:
        training = self.train(400)
        count = 0
        thread = threading.Thread(target=training.run)
        thread.start()
        while thread.is_alive():
            count += 1
            time.sleep(0.001)
        thread.join()
        self.assertGreater(count, 10)

    def test_two_at_once_and_one_after_another(self) -> None:
        models = {}

        def train(seed: int) -> None:
            training = self.train(80, seed=seed, device="cpu")
            training.run()
            models[seed] = bytes(training.model())

        threads = [threading.Thread(target=train, args=(seed,)) for seed in (0, 1)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        together = dict(models)
        for seed in (0, 1):
            train(seed)
        self.assertEqual(models, together)
        self.assertNotEqual(models[0], models[1])

    def test_threads_share_a_device(self) -> None:
        model = self.model()
        camera = self.scene.test[0].camera
        expected = bits(model.render(camera, device=CPU))
        wrong = []

        def render() -> None:
            for _ in range(10):
                if bits(model.render(camera, device=CPU)) != expected:
                    wrong.append(1)

        threads = [threading.Thread(target=render) for _ in range(4)]
        for thread in threads:
            thread.start()
        training = self.train(40)
        training.run(lambda progress: model.render(camera, device=CPU) is not None)
        for thread in threads:
            thread.join()
        self.assertEqual(wrong, [])


class ImageLoss(SceneTest):
    def test_pictures_are_those_of_the_step(self) -> None:
        """A gradient of zeros trains as no callback does; targets are the photographs."""
        images = {view.name: view.image for view in self.scene.train}
        names = []

        def look(picture, target, view):
            names.append(view)
            self.assertEqual((picture.dtype, picture.shape), (np.float32, target.shape))
            if target.shape == images[view].shape:  # sampled up to a quarter of a pixel off
                self.assertLess(np.abs(target - images[view] / 255).mean(), 0.1)

        training = self.train(20, settings=TINY | {"random_background": 0})
        training.run(image_loss=look)
        self.assertTrue(set(names) <= set(images) and len(names) >= 40, names)
        without = self.train(20, settings=TINY | {"random_background": 0})
        without.run()
        self.assertEqual(bytes(training.model()), bytes(without.model()))

    def test_a_running_training_cannot_be_called(self) -> None:
        for call in ("run", "evaluate"):
            training = self.train(10)
            with self.assertRaises(trisoup.Error):
                training.run(image_loss=lambda picture, target, view: getattr(training, call)() and None)
            self.assertEqual(training.step, 0)
            training.run()
            self.assertEqual(bytes(training.model()), bytes(self.model(10)), call)

    def test_a_further_loss_decides(self) -> None:
        """A loss that wants red makes pictures red."""
        red = np.float32([1, 0, 0])
        training = self.train(60)
        training.run(image_loss=lambda picture, target, view: 100 * (picture - red) / picture.size)
        camera = self.scene.test[0].camera
        picture, alpha = training.model().render(camera, ("colour", "alpha"), device=CPU)
        usual = self.model(60).render(camera, device=CPU)
        distance = lambda image: np.abs(image - red)[alpha > 0].mean()
        self.assertLess(distance(picture), 0.5 * distance(usual))

    def test_wrong_answers(self) -> None:
        for answer, error in [(np.zeros((2, 2, 3)), ValueError), ("red", TypeError), (np.nan, ValueError)]:
            training = self.train(20)
            with self.assertRaises(error):
                training.run(image_loss=lambda picture, target, view: (
                    picture * answer if isinstance(answer, float) else answer))
            self.assertEqual(training.step, 0)
            training.run()
            self.assertEqual(bytes(training.model()), bytes(self.model(20)))


class Arrays(SceneTest):
    def arrays(self, kind=np.uint8, **options):
        views = self.scene.train + self.scene.test
        convert = (lambda image: image) if kind == np.uint8 else (lambda image: image.astype(kind) / 255)
        return trisoup.Dataset.from_arrays([convert(v.image) for v in views], [v.camera for v in views],
                                           names=[v.name for v in views], test=[v.test for v in views],
                                           background="white", **options)

    def test_photographs_as_arrays(self) -> None:
        from_arrays = self.arrays()
        for before, after in zip(self.scene.train + self.scene.test, from_arrays.train + from_arrays.test):
            self.assertEqual((before.name, bits(before.image)), (after.name, bits(after.image)))
            np.testing.assert_allclose(before.camera.world_to_camera, after.camera.world_to_camera, atol=1e-12)
        floats = self.arrays(np.float32)
        self.assertEqual(bits(floats.train[0].image), bits(from_arrays.train[0].image))
        settings = {**TINY, "recipe": "synthetic"}
        quality = []
        for scene in (self.scene, from_arrays):
            training = trisoup.Training(scene, "fast", steps=60, triangles=40, device=CPU, settings=settings)
            training.run()
            quality.append(training.model().evaluate(self.scene, device=CPU).mean.psnr)
        self.assertAlmostEqual(*quality, delta=0.5)

    def test_alpha_and_masks(self) -> None:
        view = self.scene.train[0]
        height, width, _ = view.image.shape
        alpha = np.zeros((height, width, 1), np.uint8)
        alpha[: height // 2] = 255
        rgba = np.concatenate([view.image, alpha], axis=2)
        mask = np.ones((height, width), bool)
        mask[:, 0] = False
        cameras = [v.camera for v in self.scene.train[:3]]
        scene = trisoup.Dataset.from_arrays([rgba] * 3, cameras, masks=[mask, None, None], test_every=0)
        self.assertEqual(len(scene.train), 3)
        image = scene.train[0].image
        self.assertEqual(bits(image[: height // 2]), bits(view.image[: height // 2]))
        self.assertTrue((image[height // 2:] == 255).all())  # white, because there is alpha
        self.assertTrue((scene.train[0].mask[:, 0] == 0).all() and (scene.train[0].mask[:, 1:] >= 128).all())
        self.assertTrue((scene.train[1].mask >= 128).all())
        self.assertEqual(trisoup.Dataset.from_arrays([rgba] * 3, cameras, test=[False] * 3).test, [])
        trisoup.Dataset.from_arrays([rgba] * 3, cameras, test_every=0).write_transforms(self.folder / "alpha")
        self.assertFalse((self.folder / "alpha" / "masks").exists())
        masked = trisoup.Dataset.from_arrays([rgba] * 3, cameras, alpha="mask", test_every=0)
        self.assertEqual(bits(masked.train[0].mask), bits(alpha[:, :, 0]))

    def test_start_from_arrays(self) -> None:
        """Training begins with these triangles and colours."""
        rng = np.random.default_rng(0)
        vertices = rng.uniform(-0.5, 0.5, (30, 1, 3)) + rng.uniform(-0.2, 0.2, (30, 3, 3))
        colours = np.tile(np.float32([0.1, 0.8, 0.3]), (30, 3, 1))
        training = trisoup.Training(self.scene, "fast", steps=20, device=CPU, vertices=vertices, colours=colours,
                                    settings={"opaque": True})
        self.assertEqual(training.triangles, 30)
        model = training.model()
        np.testing.assert_allclose(model.vertices, vertices, atol=1e-6)
        np.testing.assert_allclose(model.features[:, :3], np.tile([0.1, 0.8, 0.3], (len(model.features), 1)), atol=0.01)
        training.run()
        self.assertTrue(training.finished)

    def test_datasets_of_other_programs(self) -> None:
        """COLMAP models and transforms give cameras, pictures, masks, points and the split back."""
        points = np.random.default_rng(1).uniform(-0.3, 0.3, (50, 3))
        colours = np.random.default_rng(2).integers(0, 256, (50, 3)).astype(np.uint8)
        views = self.scene.train + self.scene.test
        height, width, _ = views[0].image.shape
        masks = [np.ones((height, width), np.uint8) for _ in views]
        masks[1][3:5, 2:9] = 0
        scene = trisoup.Dataset.from_arrays([v.image for v in views], [v.camera for v in views], masks=masks,
                                            names=[f"images/{v.name}.jpg" for v in views],
                                            test=[v.test for v in views], points=points, point_colours=colours)
        self.assertEqual(sum((view.mask == 0).sum() for view in scene.train + scene.test), 14)
        scene.write_colmap(self.folder / "colmap")
        scene.write_transforms(self.folder / "transforms")
        with self.assertRaisesRegex(trisoup.Error, "colmap: is not an empty folder"):
            scene.write_colmap(self.folder / "colmap")
        for name in ("colmap", "transforms"):
            again = trisoup.Dataset(self.folder / name)
            self.assertEqual(again.warnings, [])
            for before, after in ((scene.train, again.train), (scene.test, again.test)):
                self.assertEqual(len(before), len(after))
                for one, two in zip(before, after):
                    np.testing.assert_allclose(one.camera.world_to_camera, two.camera.world_to_camera, atol=1e-9)
                    np.testing.assert_allclose(one.camera.intrinsics, two.camera.intrinsics, atol=1e-9)
                    self.assertEqual((bits(one.image), bits(one.mask)), (bits(two.image), bits(two.mask)))
            np.testing.assert_allclose(again.points, points, atol=1e-6)
            self.assertEqual(bits(again.point_colours), bits(colours))


if __name__ == "__main__":
    unittest.main()
