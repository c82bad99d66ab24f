// API of <tri-soup>. Examples: examples/page/index.html.

/** Anti-aliasing: none; four visibility samples per pixel; 2 x 2 shaded samples per pixel. */
export type AntiAliasing = "none" | "msaa" | "ssaa";

/** x, y, z in world coordinates: those of the dataset that the model was trained on. */
export type Vector3 = [number, number, number];

/** A camera that the element shows. World coordinates, angles in degrees. */
export interface CameraState {
  position: Vector3;
  /** The point that the camera looks at and that it turns around. */
  target: Vector3;
  /** Up direction of the image, unit length. */
  up: Vector3;
  /** Vertical field of view of an image of this aspect. Narrower elements show the same width and more height. */
  fov: number;
  /** Width / height. */
  aspect: number;
  /**
   * Camera to world, 4 x 4, column-major, with OpenGL axes (x right, y up, z backward), as matrixWorld.elements of
   * three.js.
   */
  matrix: number[];
  /** Number of the model's camera, if it is shown exactly; else null. */
  index: number | null;
  /** Its name; null if it is none of the model's. */
  name: string | null;
}

/**
 * A camera to show: `position` and `target`, or `matrix` (if position or target is missing). What is missing stays as
 * it is. fov: 1 to 170 degrees; aspect: 0.1 to 10; a matrix may have a uniform scale.
 */
export interface CameraInput {
  position?: ArrayLike<number>;
  target?: ArrayLike<number>;
  up?: ArrayLike<number>;
  fov?: number;
  aspect?: number;
  matrix?: ArrayLike<number>;
}

/** One key frame: a camera at a time in seconds, from 0, ascending. */
export type KeyFrame = CameraInput & { time: number };

/**
 * A path of cameras, as JSON or as an object. `soup-view --cameras` draws the same. The eye follows a Catmull-Rom
 * spline through the positions, rotations are interpolated by quaternions (slerp).
 */
export interface CameraPath {
  keyframes: KeyFrame[];
  /** Start again at the end. */
  loop?: boolean;
}

/**
 * A camera path of nerfstudio's viewer. Its coordinates are nerfstudio's: give `dataparser` to play(), unless the scene
 * was neither turned nor scaled.
 */
export interface NerfstudioPath {
  /** camera_to_world: 4 x 4, row-major; fov: vertical, degrees. */
  camera_path: { camera_to_world: number[] | number[][]; fov?: number; aspect?: number }[];
  fps?: number;
  seconds?: number;
  is_cycle?: boolean;
}

/** Contents of dataparser_transforms.json of nerfstudio. transform: 3 x 4, row-major. */
export interface NerfstudioTransforms {
  transform: number[][];
  scale: number;
}

export interface PlayOptions {
  /** Takes nerfstudio's coordinates to the dataset's; or the URL of the file. */
  dataparser?: NerfstudioTransforms | string | null;
}

/**
 * Shows a soup in a page: `<tri-soup src="model.glb" poster="poster.webp" controls></tri-soup>`. A block element;
 * without a height its aspect ratio is 16:9. Mouse, touch and keys move the camera as in soup-view; a double click or
 * tap sets the point that it turns around. Keys work while the element has the focus, and at once if it fills the page.
 * Nothing is drawn while nothing changes. Visitors who prefer reduced motion see changes at once.
 *
 * Hotspots are children with `slot="hotspot-NAME"` and `data-position="x y z"` (world coordinates), best buttons. They
 * stay at their place; those behind something are faded. `data-normal="x y z"` fades one that is seen from behind,
 * `data-camera="3"` flies to a camera on a click. Each click is also a `hotspot` event.
 *
 * Bad input never empties the page: it gives an `error` event and one line in the console.
 *
 * Shadow parts for styles: canvas, poster, progress, message, controls, hint, help.
 */
export class TriSoup extends HTMLElement {
  /** URL of a model.glb, or "#id" of an element whose text is one in base64. */
  src: string;
  /** URL of an image to show until the first frame is drawn. */
  poster: string;
  /** "lazy": loads when the element comes near the window. Default: "eager". */
  loading: "eager" | "lazy";
  /** Default: "msaa". */
  aa: AntiAliasing;
  /** Rotates the scene until the visitor moves it. Ignored if the visitor prefers reduced motion. */
  autorotate: boolean;
  /**
   * Shows buttons. The attribute can name some: `controls="cameras help"` of cameras, path, reset, link, xr,
   * fullscreen, help. Buttons without a use (one camera, no path, no headset, ...) are left out.
   */
  controls: boolean;
  /** "none": visitors cannot move the camera. Default: "auto". */
  interaction: "auto" | "none";
  /**
   * When the wheel zooms. "auto": if the page does not scroll, else after a click or with Ctrl; "modifier": with Ctrl
   * only. Default: "auto".
   */
  wheel: "auto" | "always" | "modifier" | "never";
  /**
   * The address of the page has the camera: `#camera=3`, or its numbers. The attribute's value is another name than
   * `camera`, for pages with several elements.
   */
  permalink: boolean;
  /** URL of a CameraPath or NerfstudioPath, or "#id" of an element whose text is one. Attribute `autoplay` plays it. */
  path: string;
  /** Starts a path again at its end. */
  loop: boolean;

  /**
   * The camera. Null before the model is loaded; a camera that is set before is shown then. A number (from 0, test
   * views first) or a name of one of the model's cameras sets the attribute `camera`, with which the page starts.
   */
  get camera(): CameraState | null;
  set camera(value: CameraInput | string | number);
  /** Names of the model's cameras, test views first; empty until it is loaded. */
  readonly cameras: string[];
  /** One of the model's cameras; null if it has none such, or is not loaded. */
  cameraAt(which: string | number): CameraState | null;
  /**
   * Shows another model of the same scene, as a training makes them: the camera stays, and the picture until the model
   * is loaded. `src` stays, too. True once it is shown.
   */
  replace(url: string): Promise<boolean>;
  /** True once `src` has been drawn. */
  readonly loaded: boolean;
  /** True while the camera moves, or a change has not been drawn. */
  readonly moving: boolean;
  /** Address of the page with this camera. */
  readonly link: string;

  /** Moves the camera, by default in 0.8 seconds. False if it is none, or something else moves it before it arrives. */
  flyTo(camera: CameraInput | string | number, options?: { seconds?: number }): Promise<boolean>;
  /** Flies to the next (1) or previous (-1) camera of the model. */
  stepCamera(step: number): Promise<boolean>;
  /** Flies to the camera with which the page starts. */
  resetCamera(): Promise<boolean>;
  /** Puts the camera into the address of the page. */
  showLink(): void;

  /** Plays a path, by default the last one or the attribute's. True once it plays. A visitor's movement pauses it. */
  play(path?: string | CameraPath | NerfstudioPath, options?: PlayOptions): Promise<boolean>;
  pause(): void;
  readonly paused: boolean;
  /** True if there is a path to play. */
  readonly hasPath: boolean;
  /** Seconds from the start of the path. */
  currentTime: number;
  /** Seconds; NaN without a path. */
  readonly duration: number;

  /**
   * Shows the scene in a headset, from this camera; the target is two metres away (attribute `xr-scale`: metres per
   * world unit). Call it from a click. True if it starts. Tested with a simulated headset only; no real one has run it.
   */
  enterXR(mode?: "immersive-vr" | "immersive-ar"): Promise<boolean>;
  exitXR(): void;

  addEventListener<K extends keyof TriSoupEventMap>(type: K,
    listener: (this: TriSoup, event: TriSoupEventMap[K]) => void, options?: boolean | AddEventListenerOptions): void;
  addEventListener(type: string, listener: EventListenerOrEventListenerObject,
    options?: boolean | AddEventListenerOptions): void;
}

export interface TriSoupEventMap
  extends Omit<HTMLElementEventMap, "load" | "progress" | "error" | "play" | "pause" | "ended" | "timeupdate"> {
  /** The first frame has been drawn. */
  load: Event;
  /** Part of the model has been downloaded. */
  progress: ProgressEvent;
  /**
   * Something cannot be shown or used; `message` names it and a fix. If the model cannot be shown (`loaded` stays
   * false), the element shows the message.
   */
  error: ErrorEvent;
  /** Another camera has been drawn; at most once per frame. */
  camerachange: Event;
  /** A hotspot was clicked. name: its slot. */
  hotspot: CustomEvent<{ name: string; position: Vector3 }>;
  /** A path plays, pauses, has moved the camera, has ended. */
  play: Event;
  pause: Event;
  timeupdate: Event;
  ended: Event;
  /** A headset shows the scene, and no longer. */
  xrstart: Event;
  xrend: Event;
  /** The graphics device was lost. The last frame stays visible, with a message. */
  contextlost: Event;
  /** The device was restored, and the scene is drawn again. */
  contextrestored: Event;
}

declare global {
  interface HTMLElementTagNameMap {
    "tri-soup": TriSoup;
  }
}
