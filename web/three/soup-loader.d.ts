import type { Color, Group, PerspectiveCamera } from "three";
import type { GLTFLoaderPlugin, GLTFParser } from "three/addons/loaders/GLTFLoader.js";

/**
 * Plugin for GLTFLoader: `loader.register((parser) => new SoupLoader(parser))`. Files without the trisoup extension
 * load as usual.
 */
export class SoupLoader implements GLTFLoaderPlugin {
  constructor(parser: GLTFParser);
  readonly name: "TRISOUP_neural_textures";
}

/** A soup in the coordinates of its file. */
export class Soup extends Group {
  readonly isSoup: true;
  /** Names of the model's cameras, test views first. */
  readonly cameras: string[];
  /** Background colour of the training. */
  readonly background: Color;
  /**
   * Sets position, direction and field of view of `camera` to those of one of `cameras`, by number or name. Keeps its
   * `aspect` and clip planes. Throws an error if the model has no such camera.
   */
  lookThrough(camera: PerspectiveCamera, which?: number | string): void;
  /** Frees the GPU memory of this soup and of all its clones. */
  dispose(): void;
}
