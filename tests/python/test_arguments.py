"""Wrong arguments raise exceptions with one line and never end the interpreter."""

import math
import random
import unittest

import numpy as np

import trisoup
from common import CPU, SANITIZED, TINY, SceneTest

SEED = 20


class Messages(SceneTest):
    def fails(self, kind: type, text: str, function, *arguments, **named) -> None:
        with self.assertRaises(kind) as raised:
            function(*arguments, **named)
        message = str(raised.exception)
        self.assertIn(text, message)
        self.assertNotIn("\n", message)

    def test_library(self) -> None:
        """The same lines as the programs print."""
        train = lambda **options: trisoup.Training(self.scene, device=CPU, **options)
        self.fails(trisoup.Error, "nowhere", trisoup.Dataset, self.folder / "nowhere")
        self.fails(trisoup.Error, "the path of the dataset is empty", trisoup.Dataset, "")
        self.fails(trisoup.Error, "toaster", trisoup.Device, "toaster")
        self.fails(trisoup.Error, "there is no 'slow'", train, preset="slow")
        self.fails(trisoup.Error, "preset: is empty", train, preset="")
        self.fails(trisoup.Error, "no such device", trisoup.Device, "cpu", "a\nb")
        self.fails(trisoup.Error, "nearest is huber", train, settings={"hubber": 1})
        self.fails(trisoup.Error, "`knee` is", train, settings={"knee": "much"})
        self.fails(trisoup.Error, "soup-simplify", train, settings={"target_psnr": 30})
        self.fails(trisoup.Error, "transforms_train.json", trisoup.Model.load,
                   self.folder / "scene/transforms_train.json")
        self.fails(trisoup.Error, "`test_every` 1", trisoup.Dataset, self.folder / "scene", test_every=1)
        self.fails(trisoup.Error, "there is no 'green'", trisoup.Dataset, self.folder / "scene", background="green")
        self.fails(trisoup.Error, "test_every", self.model().evaluate,
                   trisoup.Dataset.from_arrays([v.image for v in self.scene.train],
                                               [v.camera for v in self.scene.train], test_every=0))
        self.fails(trisoup.Error, "none: cannot be opened", trisoup.Training.resume, self.scene, self.folder / "none",
                   device=CPU)

    def test_cameras(self) -> None:
        model, good = self.model(), self.scene.test[0].camera
        render = lambda **changes: model.render(trisoup.Camera(**{
            **dict(width=8, height=8, fx=8, fy=8, cx=4, cy=4, world_to_camera=good.world_to_camera), **changes}),
            device=CPU)
        self.assertEqual(render().shape, (8, 8, 3))
        for name in ("width", "height"):
            for value in (0, -1, 2**31 - 1):
                self.fails(trisoup.Error, "camera:", render, **{name: value})
        for name in ("fx", "fy", "cx", "cy"):
            for value in (math.nan, math.inf, 1e300):
                self.fails(trisoup.Error, "camera:", render, **{name: value})
        self.fails(trisoup.Error, "rotation", render, world_to_camera=2 * np.eye(4))
        self.fails(trisoup.Error, "rotation", render, world_to_camera=np.diag([1, 1, -1, 1]))
        self.fails(ValueError, "world_to_camera", render, world_to_camera=np.eye(3))
        self.fails(ValueError, "not finite", render, world_to_camera=np.full((4, 4), np.nan))
        self.fails(TypeError, "world_to_camera", render, world_to_camera="identity")
        self.fails(TypeError, "world_to_camera", render, world_to_camera=np.eye(4) * 1j)
        look = lambda **changes: trisoup.Camera.look_at(**{
            **dict(eye=(0, 0, 3), target=(0, 0, 0), up=(0, 1, 0), fov=40, width=8, height=8), **changes})
        self.assertEqual(look().width, 8)
        self.fails(trisoup.Error, "up", look, up=(0, 0, 1))
        self.fails(trisoup.Error, "up", look, target=(0, 0, 3))
        self.fails(trisoup.Error, "degrees", look, fov=180)
        self.fails(trisoup.Error, "pixels", look, width=0)
        self.fails(trisoup.Error, "pixels", good.resized, 0, 5)

    def test_render(self) -> None:
        model, camera = self.model(), self.scene.test[0].camera
        self.fails(ValueError, "there is no 'color'; give some of colour, alpha", model.render, camera, "color")
        self.fails(ValueError, "twice", model.render, camera, ("depth", "depth"))
        self.fails(TypeError, "outputs", model.render, camera, 3)
        self.fails(TypeError, "outputs", model.render, camera, (3,))
        self.fails(ValueError, "background", model.render, camera, background=(1, 2))
        self.fails(trisoup.Error, "background", model.render, camera, background=(1, 2, 0), device=CPU)
        self.fails(TypeError, "device", model.render, camera, device=3)
        self.fails(ValueError, "views", model.evaluate, self.scene, "all")
        self.assertEqual(model.render(camera, (), device=CPU), ())

    def test_arrays(self) -> None:
        images, cameras = [v.image for v in self.scene.train], [v.camera for v in self.scene.train]
        make = lambda images=images, cameras=cameras, **options: trisoup.Dataset.from_arrays(images, cameras, **options)
        wide = np.zeros((24, 30, 3), np.uint8)
        self.fails(trisoup.Error, "there are none", make, [], [])
        self.fails(ValueError, "cameras: has 5", make, images, cameras[:5])
        self.fails(ValueError, "00000: is 30 x 24", make, [wide] + images[1:])
        self.fails(ValueError, "channels", make, [wide[:, :, :2]] * 6)
        self.fails(ValueError, "shape", make, [wide.ravel()] * 6)
        self.fails(TypeError, "type", make, [images[0].astype(np.int32)] * 6)
        self.fails(ValueError, "from 0 to 1", make, [images[0].astype(np.float32)] * 6)
        self.fails(ValueError, "not finite", make, [np.full(images[0].shape, np.nan)] * 6)
        self.fails(TypeError, "camera", make, images, [1] * 6)
        self.fails(ValueError, "mask", make, masks=[wide[:, :, 0]] * 6)
        self.fails(trisoup.Error, "two have the name", make, names=["a"] * 6)
        self.fails(trisoup.Error, "all are test views", make, test=[True] * 6)
        self.fails(TypeError, "True or False", make, test=[0.5] * 6)
        self.fails(trisoup.Error, "masks exclude", make, masks=[np.zeros(images[0].shape[:2], bool)] * 6)
        self.fails(ValueError, "points", make, points=np.zeros((3, 2)))
        self.fails(ValueError, "not finite", make, points=np.full((3, 3), np.inf))
        self.fails(trisoup.Error, "points", make, points=np.zeros((3, 3)), point_colours=np.zeros((2, 3), np.uint8))
        self.fails(trisoup.Error, "at one spot", make, images, [cameras[0]] * 6)
        self.fails(trisoup.Error, "focal", make, images, [trisoup.Camera(24, 24, -1, 1, 1, 1)] * 6)

    def test_truths_are_no_numbers(self) -> None:
        scene = self.folder / "scene"
        for truth in (True, np.True_):
            self.fails(TypeError, "resolution: is a bool", trisoup.Dataset, scene, resolution=truth)
            self.fails(TypeError, "test_every: is a bool", trisoup.Dataset, scene, test_every=truth)
            self.fails(TypeError, "width: is a bool", trisoup.Camera, truth, 1, 1, 1, 1, 1)
            self.fails(TypeError, "cy: is a bool", trisoup.Camera, 1, 1, 1, 1, 1, truth)
            self.fails(TypeError, "height: is a bool", self.scene.test[0].camera.resized, 5, truth)
        self.fails(TypeError, "fx: is a str; give a number", trisoup.Camera, 1, 1, "1", 1, 1, 1)
        self.fails(TypeError, "width: is a float; give a whole number", trisoup.Camera, 1.5, 1, 1, 1, 1, 1)
        self.fails(ValueError, "width", trisoup.Camera, 2**40, 1, 1, 1, 1, 1)
        self.assertEqual(trisoup.Camera(np.int32(7), 5, np.float32(2.5), 3, 1, 1).fx, 2.5)

    def test_start(self) -> None:
        train = lambda **options: trisoup.Training(self.scene, "fast", steps=5, device=CPU, **options)
        self.fails(ValueError, "vertices", train, vertices=np.zeros((3, 3)))
        self.fails(ValueError, "there are none", train, vertices=np.zeros((0, 3, 3)))
        self.fails(ValueError, "not finite", train, vertices=np.full((1, 3, 3), np.nan))
        self.fails(trisoup.Error, "colour values", train, vertices=np.zeros((2, 3, 3)), colours=np.zeros((1, 3, 3)))
        self.fails(trisoup.Error, "give 0 to 1", train, vertices=np.eye(3)[None], colours=np.full((1, 3, 3), 2))
        self.fails(ValueError, "vertices", train, colours=np.zeros((1, 3, 3)))
        self.fails(ValueError, "steps", trisoup.Training, self.scene, steps=0, device=CPU)
        self.fails(TypeError, "steps: is a str; give a whole number", trisoup.Training, self.scene, steps="many")
        for steps in (-1, 2**40, 2**80, np.int64(-3)):
            self.fails(ValueError, f"steps: {steps}; give 1 to", trisoup.Training, self.scene, steps=steps, device=CPU)
        for seed in (-1, 2**64):
            self.fails(ValueError, f"seed: {seed}; give 0 to", trisoup.Training, self.scene, seed=seed, device=CPU)
        for steps in (2.0, np.True_, True):
            self.fails(TypeError, "give a whole number", trisoup.Training, self.scene, steps=steps, device=CPU)
        self.fails(trisoup.Error, "too far", train, vertices=np.full((1, 3, 3), 1e30))
        self.fails(TypeError, "image_loss", self.train().steps, image_loss=3)
        for function in (self.train().steps, self.train().run):
            self.fails(ValueError, "every: 0", function, every=0)
            self.fails(ValueError, "every: -1", function, every=-1)

    def test_values_of_numpy(self) -> None:
        """Numbers and truths of NumPy are those of Python."""
        training = self.train(np.int32(20), settings={**TINY, "exposure": np.True_})
        self.assertIs(training.settings["exposure"], True)
        training.run(lambda progress: np.False_, every=np.uint8(10))
        self.assertEqual(training.step, 10)
        cameras = [v.camera for v in self.scene.train]
        white = np.ones((*self.scene.train[0].image.shape,), bool)
        scene = trisoup.Dataset.from_arrays([white] * len(cameras), cameras)
        self.assertTrue((scene.train[0].image == 255).all())

    def test_arrays_with_other_strides(self) -> None:
        """Transposed, reversed and non-native arrays give what their copies give."""
        images, cameras = [v.image for v in self.scene.train], [v.camera for v in self.scene.train]
        expected = trisoup.Dataset.from_arrays(images, cameras).train[0].image
        for change in (lambda a: a[::-1].copy()[::-1], np.asfortranarray, lambda a: a.astype(">f4") / 255,
                       lambda a: np.repeat(a, 2, axis=1)[:, ::2], lambda a: a.tolist() and a.astype(np.float64) / 255):
            scene = trisoup.Dataset.from_arrays([change(image) for image in images], cameras)
            np.testing.assert_array_equal(scene.train[0].image, expected)


class Fuzz(SceneTest):
    """Calls everything with random arguments. An exception is right; a crash, a hang or silence of errors is not."""

    CALLS = 500 if SANITIZED else 1500

    def setUp(self) -> None:
        self.random = random.Random(SEED)
        self.soup = self.model(1)
        self.values = self.make_values()

    def array(self):
        r = self.random
        shape = tuple(r.choice((0, 1, 2, 3, 4, 8, 24)) for _ in range(r.randrange(5)))
        kind = r.choice((np.uint8, np.int64, np.float32, np.float64, bool, complex, object, "U3", ">f4", "M8[s]"))
        array = np.zeros(shape, kind)
        if array.dtype.kind == "f" and array.size:
            array.flat[r.randrange(array.size)] = r.choice((1, np.nan, np.inf, -1, 1e30))
        return array[::-1].T if r.random() < 0.3 and array.ndim else array

    def make_values(self) -> list:
        camera, view = self.scene.test[0].camera, self.scene.train[0]
        small = trisoup.Camera(8, 8, 8, 8, 4, 4, camera.world_to_camera)
        return [None, True, 0, 1, 3, -1, 2**40, 0.5, math.nan, math.inf, "", "colour", "cpu", "fast", "\0", "ü", b"x",
                ("depth", "triangle"), [], {}, {"knee": 0.1}, {"steps": math.nan}, {1: 2}, camera, small, view,
                self.scene, self.soup, CPU, object(), len, [camera] * 6, [small] * 2, [view.image] * 6,
                self.folder / "scene", self.folder / "new" / "file", np.eye(4), self.train(2)]

    def value(self):
        return self.array() if self.random.random() < 0.35 else self.random.choice(self.values)

    def functions(self) -> list:
        training = self.train(2)
        return [
            (trisoup.Camera, ("width", "height", "fx", "fy", "cx", "cy", "world_to_camera"), 6),
            (trisoup.Camera.look_at, ("eye", "target", "up", "fov", "width", "height"), 6),
            (self.scene.test[0].camera.resized, ("width", "height"), 2),
            (trisoup.Dataset.from_arrays, ("images", "cameras", "masks", "names", "test", "points", "point_colours",
                                           "test_every", "background", "alpha"), 2),
            (trisoup.Dataset, ("path", "resolution", "test_every", "background", "alpha"), 1),
            (trisoup.Model.load, ("path",), 1),
            (self.soup.render, ("camera", "outputs", "background", "device"), 1),
            (self.soup.exposure, ("view",), 1),
            (self.soup.evaluate, ("dataset", "views", "device"), 1),
            (trisoup.Training, ("dataset", "preset", "steps", "triangles", "seed", "settings", "vertices", "colours"),
             1),
            (training.steps, ("every", "evaluate", "image_loss"), 0),
            (training.run, ("on_progress", "every", "image_loss"), 0),
            (trisoup.Training.resume, ("dataset", "path"), 2),
        ]

    def good(self, name):
        """An argument that is right, so that calls get beyond the first one."""
        camera = self.scene.test[0].camera
        right = {"camera": camera, "dataset": self.scene, "steps": 1, "triangles": 20, "width": 8, "height": 8,
                 "images": [v.image for v in self.scene.train], "cameras": [v.camera for v in self.scene.train],
                 "path": self.folder / "scene", "preset": "fast", "device": CPU, "settings": TINY}
        return right.get(name, 1.0 if len(name) < 4 else None)

    def test_random_arguments(self) -> None:
        functions = self.functions()
        raised = worked = 0
        for _ in range(self.CALLS):
            function, names, needed = self.random.choice(functions)
            arguments = {}
            for i, name in enumerate(names):
                if i < needed or self.random.random() < 0.3:
                    right = self.random.random() < 0.7
                    arguments[name] = self.good(name) if right else self.value()
            if function is trisoup.Training:
                arguments.setdefault("steps", 1)
                arguments.update(device=CPU)
            try:
                function(**arguments)
                worked += 1
            except (trisoup.Error, TypeError, ValueError, OverflowError, IndexError, MemoryError) as error:
                raised += 1
                if isinstance(error, trisoup.Error):
                    self.assertNotIn("\n", str(error))
        self.assertGreater(raised, self.CALLS // 10)
        self.assertGreater(worked, self.CALLS // 10)


if __name__ == "__main__":
    unittest.main()
