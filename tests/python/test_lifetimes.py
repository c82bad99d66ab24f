"""Arrays outlive their owners, and memory does not grow."""

import gc
import pickle
import re
import subprocess
import sys
import unittest
import weakref

import numpy as np

import trisoup
from common import CPU, SANITIZED, SOURCE, SceneTest, bits, memory

ARRAYS = ("vertices", "faces", "texture_offsets", "texture_levels", "texels", "features")


class Lifetimes(SceneTest):
    def test_arrays_outlive_the_model(self) -> None:
        model = self.model()
        arrays = {name: getattr(model, name) for name in ARRAYS}
        arrays |= {f"mlp {i} {k}": part for i, layer in enumerate(model.mlp) for k, part in enumerate(layer)}
        copies = {name: array.copy() for name, array in arrays.items()}
        pointers = {name: getattr(model, name).ctypes.data for name in ARRAYS}
        self.assertEqual(pointers, {name: arrays[name].ctypes.data for name in ARRAYS})  # no copies
        del model
        gc.collect()
        for _ in range(3):
            self.model(1)  # would reuse the memory
        for name, array in arrays.items():
            self.assertEqual(bits(array), bits(copies[name]), name)
            self.assertFalse(array.flags.writeable, name)
            self.assertTrue(array.flags.c_contiguous, name)
            with self.assertRaises(ValueError):
                array[...] = 0
            with self.assertRaises(ValueError):
                array.flags.writeable = True

    def test_photographs_outlive_the_dataset(self) -> None:
        scene = trisoup.Dataset(self.folder / "scene")
        view = scene.train[0]
        image, mask = view.image, view.mask
        copy = image.copy()
        self.assertEqual(image.ctypes.data, scene.train[0].image.ctypes.data)
        del scene, view
        gc.collect()
        trisoup.Dataset(self.folder / "scene")
        self.assertEqual(bits(image), bits(copy))
        self.assertTrue((mask >= 128).all())
        self.assertFalse(image.flags.writeable or mask.flags.writeable)

    def test_objects_outlive_their_makers(self) -> None:
        device = trisoup.Device("cpu")
        scene = trisoup.Dataset(self.folder / "scene")
        training = trisoup.Training(scene, "fast", steps=20, triangles=40, device=device)
        steps = training.steps(every=10)
        camera = scene.test[0].camera
        del scene, device, training
        gc.collect()
        progress = next(steps)
        del steps
        gc.collect()
        self.assertEqual(progress.step, 10)
        self.assertEqual(camera.width, self.scene.test[0].camera.width)

    def test_cycles_are_collected(self) -> None:
        class Study:
            def __init__(self, training: trisoup.Training) -> None:
                self.steps = training.steps(every=5, image_loss=self.loss)

            def loss(self, picture, target, view) -> None:
                return None

        study = Study(self.train())
        self.assertEqual(next(study.steps).step, 5)
        gone = weakref.ref(study)
        del study
        gc.collect()
        self.assertIsNone(gone())

    def test_threads_may_outlive_the_interpreter(self) -> None:
        """Threads that are in C++ while Python ends do not end the process with an error."""
        code = ("import sys, threading, time, trisoup\n"
                "model, device = trisoup.Model.load(sys.argv[1]), trisoup.Device('cpu')\n"
                "camera = model.cameras[0].camera.resized(300, 300)\n"
                "def draw():\n"
                "    while True: model.render(camera, device=device)\n"
                "threading.Thread(target=draw, daemon=True).start()\n"
                "time.sleep(0.3)\n")
        self.model().save(self.folder / "threads.glb")
        for _ in range(1 if SANITIZED else 3):
            done = subprocess.run([sys.executable, "-c", code, self.folder / "threads.glb"], capture_output=True,
                                  text=True)
            # The address sanitizer notes that it does not know the stack of a thread that Python ends.
            said = re.sub(r"==\d+==WARNING: ASan is ignoring requested __asan_handle_no_return(.*\n){3}", "",
                          done.stderr)
            self.assertEqual((done.returncode, said), (0, ""))

    def test_cameras_can_be_pickled(self) -> None:
        camera = self.scene.test[0].camera
        again = pickle.loads(pickle.dumps(camera))
        self.assertEqual(bits(again.world_to_camera), bits(camera.world_to_camera))
        self.assertEqual(bits(again.intrinsics), bits(camera.intrinsics))
        self.assertEqual((again.width, again.height), (camera.width, camera.height))

    def test_dlpack(self) -> None:
        """Arrays go to other libraries by DLPack, as far as NumPy passes them on."""
        image = self.model().render(self.scene.test[0].camera, device=CPU)
        self.assertEqual(np.from_dlpack(image).ctypes.data, image.ctypes.data)

    @unittest.skipIf(SANITIZED, "sanitizers keep memory")
    def test_memory_does_not_grow(self) -> None:
        model = self.model()
        camera = self.scene.test[0].camera.resized(160, 160)
        outputs = ("colour", "triangle", "barycentrics", "depth", "normal", "alpha")

        def work(renders: int, trainings: int) -> None:
            for _ in range(renders):
                model.render(camera, outputs, device=CPU)
                model.features, self.scene.train[0].image
            for _ in range(trainings):
                self.train(3).model().render(camera, device=CPU)
            gc.collect()

        work(30, 3)
        before = memory()
        work(300, 6)
        grown = memory() - before
        # One rendering has 1.1 MB, one model 0.3 MB.
        self.assertLess(grown, 16 << 20, f"{grown >> 20} MB")

    def test_page_of_a_notebook(self) -> None:
        """The HTML is one sandboxed frame that holds the model and asks nothing of the network."""
        import base64
        import html
        import re

        model = self.model()
        text = model._repr_html_()
        frame = re.fullmatch(
            r'<iframe sandbox="allow-scripts" title="trisoup" style="[^"]*" srcdoc="([^"]*)"></iframe>', text)
        self.assertIsNotNone(frame)
        page = html.unescape(frame[1])
        self.assertTrue(page.startswith("<!doctype html>") or page.startswith("<!DOCTYPE html>"), page[:40])
        policy = re.search(r'<meta http-equiv="Content-Security-Policy"\s+content="([^"]*)"', page)
        self.assertIn("default-src 'none'", policy[1])
        for directive in policy[1].split(";"):
            for source in directive.split()[1:]:
                self.assertTrue(source.startswith("'") or source in ("data:", "blob:"), directive)
        self.assertIn(base64.b64encode(bytes(model)).decode(), page)
        outside = re.findall(r'(?:src|href)="(?!data:|#)([^"]*)"', page)
        self.assertEqual(outside, [])

    def test_stubs_have_the_names_of_the_module(self) -> None:
        import ast

        def names_of(tree: ast.AST) -> dict:
            return {node.name: node for node in tree.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}

        stubs = names_of(ast.parse((SOURCE / "python/trisoup/__init__.pyi").read_text()))
        public = {name for name in dir(trisoup) if not name.startswith("_")}
        self.assertEqual(set(stubs), public)
        for name, node in stubs.items():
            value = getattr(trisoup, name)
            self.assertTrue(value.__doc__, name)
            if not isinstance(node, ast.ClassDef) or name == "Error":
                continue
            members = {member for member in vars(value) if not member.startswith("_")}
            stub = {member for member in names_of(node) if not member.startswith("_")}
            if name == "ViewQuality":
                stub |= {member for member in names_of(stubs["Quality"]) if not member.startswith("_")}
            self.assertEqual(stub, members, name)


if __name__ == "__main__":
    unittest.main()
