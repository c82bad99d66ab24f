import type { Color, Group, PerspectiveCamera } from "three";
import type { GLTFLoaderPlugin, GLTFParser } from "three/addons/loaders/GLTFLoader.js";

/**
 * For GLTFLoader: `loader.register((parser) => new SoupLoader(parser))`. Files without our extension are left alone.
 */
export class SoupLoader implements GLTFLoaderPlugin {
  constructor(parser: GLTFParser);
  readonly name: "TRISOUP_neural_textures";
}

/** A soup, in the coordinates of its file: an Object3D among others. */
export class Soup extends Group {
  readonly isSoup: true;
  /** Names of the model's cameras, test views first. */
  readonly cameras: string[];
  /** What lay behind the soup in training. */
  readonly background: Color;
  /**
   * Puts a camera where a photograph was taken: its place, direction and field of view. Its `aspect` and its clip
   * planes stay. Throws an error where the model has no such camera.
   */
  lookThrough(camera: PerspectiveCamera, which?: number | string): void;
  /** Frees what lies on the GPU, of all clones too. */
  dispose(): void;
}
