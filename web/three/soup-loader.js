// Soups in three.js scenes: a plugin of GLTFLoader for model.glb, and the object that it creates. See docs/viewer.md.
//
// The two passes of renderer.js become two meshes with one geometry. The first writes only depth and reads only
// opacity. The second shades fragments of exactly that depth, so the MLP runs once per pixel, however many triangles
// are behind. three.js handles the rest: depth against other meshes, render targets, XR, lost contexts.
import {
  BufferAttribute, BufferGeometry, Color, DataArrayTexture, DoubleSide, EqualDepth, GLSL3, Group, LinearSRGBColorSpace,
  Matrix4, Mesh,
  RGBAFormat, RGBAIntegerFormat, RawShaderMaterial, RedFormat, SRGBColorSpace, UnsignedByteType, UnsignedIntType,
  Vector2, Vector3, Vector4,
} from "three";
import { SoupError } from "../error.js";
import { EXTENSION, decodeDocument } from "../model.js";
import { DEPTHS, TABLE_WIDTH, maskedFragment, meshFragment, opaqueFragment, soupVertex,
  withPlainUniforms } from "../shaders.js";
import { unpackModel } from "./unpack.js";

/**
 * Plugin for GLTFLoader: `loader.register((parser) => new SoupLoader(parser))`. Files without the trisoup extension
 * load as usual.
 */
export class SoupLoader {
  name = EXTENSION;

  constructor(parser) {
    this.parser = parser;
  }

  loadMesh(index) {
    const { json } = this.parser;
    // A model has one mesh, or none if its vertices are coded. Meshes that were added later load as usual.
    const model = json.extensions?.[EXTENSION];
    return model && !model.vertices && index === 0 ? this.#soup(json) : null;
  }

  createNodeMesh(index) {
    const { json } = this.parser;
    // Without a mesh, a node with the extension gives the position of the soup.
    return json.nodes[index].mesh === undefined && json.nodes[index].extensions?.[EXTENSION] ? this.#soup(json) : null;
  }

  async #soup(json) {
    const binary = new Uint8Array(await this.parser.getDependency("buffer", 0));
    // The group receives the transform of the file's node.
    return new Group().add(new Soup(await unpackModel(decodeDocument(json, binary, "model.glb"))));
  }
}

/** A soup in the coordinates of its file. */
export class Soup extends Group {
  isSoup = true;
  type = "Soup";

  /** @param {import("./unpack.js").Unpacked} [unpacked] missing in copy() */
  constructor(unpacked) {
    super();
    if (!unpacked) return;
    const { model } = unpacked, parts = makeParts(unpacked);
    this.model = model;
    this.background = new Color().setRGB(...model.background, SRGBColorSpace);
    // The meshes use normalised coordinates, like cameras and shaders.
    this.scale.setScalar(1 / model.normalisation.scale);
    this.position.fromArray(model.normalisation.middle);
    const depth = new SoupMesh(parts.geometry, [parts.opaque, parts.masked]),
      surface = new SoupMesh(parts.geometry, parts.surface);
    depth.name = "depth";
    surface.name = "surface";
    surface.renderOrder = 1;
    surface.raycast = () => {};  // the depth mesh is picked instead
    this.add(depth, surface);
  }

  copy(source, recursive) {
    super.copy(source, recursive);
    this.model = source.model;
    this.background = source.background;
    return this;
  }

  /** Names of the model's cameras, test views first. */
  get cameras() { return this.model.cameras.map((camera) => camera.name); }

  /**
   * Sets position, direction and field of view of a camera to those of one of `cameras`. Keeps its `aspect` and clip
   * planes.
   * @param {import("three").PerspectiveCamera} camera without a parent, or with a parent at the origin
   * @param {number | string} which number or name of one of `cameras`
   * @throws {SoupError} if there is no such camera
   */
  lookThrough(camera, which = 0) {
    const { cameras, name } = this.model, found = cameras[which] ?? cameras.find((other) => other.name === which);
    if (!found) throw new SoupError(
      `${name}: has no camera ${which}; give a name, or a number below ${cameras.length} (from 0)`);
    const { pose, width, height, fy, cx, cy } = found, [a, b, c, x, d, e, f, y, g, h, i, z] = pose;
    // The pose has OpenCV axes: x right, y down, z forward.
    const view = new Matrix4().set(a, b, c, x, -d, -e, -f, -y, -g, -h, -i, -z, 0, 0, 0, 1);
    this.updateWorldMatrix(true, false);
    const world = this.matrixWorld.clone().multiply(view.invert());
    world.decompose(camera.position, camera.quaternion, new Vector3());
    camera.fov = (2 * Math.atan((0.5 * height) / fy) * 180) / Math.PI;
    // Shifts the view by the principal point, in pixels of an image of the same height.
    const wide = camera.aspect * height;
    camera.setViewOffset(wide, height, 0.5 * width - cx, 0.5 * height - cy, wide, height);
  }

  /** Frees the GPU memory of this soup and of all its clones. */
  dispose() {
    const { geometry, material } = this.children[0];
    const { features, opacities, table } = this.children[1].material.uniforms;
    geometry.dispose();
    for (const each of [...material, this.children[1].material]) each.dispose();
    for (const texture of [features, opacities, table]) texture.value.dispose();
  }
}

const modelView = new Matrix4(), toModel = new Matrix4(), viewport = new Vector4();

/** A mesh that passes the camera to its material. */
class SoupMesh extends Mesh {
  onBeforeRender(renderer, scene, camera, geometry, material) {
    if (!material.isSoupMaterial) return;  // an override material of the scene
    if (camera.isOrthographicCamera)
      throw new SoupError("a soup needs a PerspectiveCamera; render with one");
    if (renderer.capabilities.logarithmicDepthBuffer)
      throw new SoupError(
        "a soup does not support logarithmicDepthBuffer; " +
        "create the renderer with reversedDepthBuffer instead");
    const { clip_from_world, eye, ray, ray_x, ray_y, pixel, linear } = material.uniforms;
    modelView.multiplyMatrices(camera.matrixWorldInverse, this.matrixWorld);
    clip_from_world.value.multiplyMatrices(camera.projectionMatrix, modelView);
    // three.js reverses the depth of a camera when it first draws with it, which is after this call.
    if (renderer.capabilities.reversedDepthBuffer && !camera.reversedDepth)
      reverseDepth(clip_from_world.value.elements);
    toModel.copy(modelView).invert();
    eye.value.set(0, 0, 0, 1).applyMatrix4(toModel);
    // The direction at NDC (x, y) is ((x + cx) / ax, (y + cy) / ay, -1) in camera axes.
    const projection = camera.projectionMatrix.elements, ax = projection[0], ay = projection[5], cx = projection[8],
      cy = projection[9];
    ray_x.value.set(-1 / ax, 0, 0, 0).applyMatrix4(toModel);
    ray_y.value.set(0, -1 / ay, 0, 0).applyMatrix4(toModel);
    ray.value.set(-cx / ax, -cy / ay, 1, 0).applyMatrix4(toModel);
    // The shader counts pixels from the corner of the target, not of the viewport.
    renderer.getCurrentViewport(viewport);
    pixel.value.set(2 / viewport.z, 2 / viewport.w);
    ray.value.addScaledVector(ray_x.value, -viewport.x * pixel.value.x)
      .addScaledVector(ray_y.value, -viewport.y * pixel.value.y);
    const target = renderer.getRenderTarget();
    const space = target === null ? renderer.outputColorSpace : target.isXRRenderTarget
      ? target.texture.colorSpace : LinearSRGBColorSpace;
    linear.value = space !== SRGBColorSpace;
    material.uniformsNeedUpdate = true;
  }
}

/** -1 near and 1 far become 1 and 0. */
function reverseDepth(elements) {
  for (const column of [0, 4, 8, 12]) elements[column + 2] = 0.5 * (elements[column + 3] - elements[column + 2]);
}

class SoupMaterial extends RawShaderMaterial {
  isSoupMaterial = true;
  type = "SoupMaterial";
}

function makeParts({ model, width, height, tiles, rows, features, opacities, table, position, number, opaque,
  masked }) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(position, 3));
  geometry.setAttribute("number", new BufferAttribute(number, 1));
  geometry.addGroup(0, 3 * opaque, 0);
  geometry.addGroup(3 * opaque, 3 * masked, 1);
  const uniforms = {
    clip_from_world: { value: new Matrix4() }, eye: { value: new Vector4() }, ray: { value: new Vector4() },
    ray_x: { value: new Vector4() },
    ray_y: { value: new Vector4() }, pixel: { value: new Vector2() }, linear: { value: false },
    move: { value: new Vector2() }, offset: { value: new Vector2() }, drop_behind: { value: false },
    features: { value: arrayTexture(features, width, height, 2 * tiles, RGBAFormat, UnsignedByteType) },
    opacities: { value: arrayTexture(opacities, width, height, tiles, RedFormat, UnsignedByteType) },
    table: { value: arrayTexture(table, TABLE_WIDTH, rows, 3, RGBAIntegerFormat, UnsignedIntType, "RGBA32UI") },
  };
  const material = (fragmentShader, settings) =>
    new SoupMaterial({
      glslVersion: GLSL3, side: DoubleSide, uniforms, vertexShader: withPlainUniforms(soupVertex(DEPTHS.usual)),
      fragmentShader: withPlainUniforms(fragmentShader), ...settings,
    });
  return {
    geometry,
    opaque: material(opaqueFragment, { name: "opaque", colorWrite: false }),
    masked: material(maskedFragment("none"), { name: "masked", colorWrite: false }),
    surface: material(meshFragment(model.mlp), { name: "surface", depthWrite: false, depthFunc: EqualDepth }),
  };
}

function arrayTexture(data, width, height, layers, format, type, internalFormat = null) {
  const texture = new DataArrayTexture(data, width, height, layers);
  Object.assign(texture, { format, type, internalFormat, needsUpdate: true });  // read with texelFetch, without filters
  return texture;
}
